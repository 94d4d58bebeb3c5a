/* The plan of the step loop, out of Python's arrays: all of it is checked, and turned into calls.

   Runs of like calls become groups: what is the same for a whole group stands in registers, and what is left of a call is
   the instance and a place. */

#include "growth.h"
#include "plan.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const char *const buffer_names[N_BUFFERS] = {
    "operations", "parts", "channels", "instances", "entries", "references", "forms", "courses", "notes", "loops", "solvers", "parties",
    "terms", "passed", "points", "states", "work", "stamps", "changes", "kept", "values", "history", "table", "places", "disturbed", "control",
};
static const size_t buffer_sizes[N_BUFFERS] = {
    sizeof(Operation), sizeof(int64_t), sizeof(Channel), sizeof(Instance), sizeof(Entry),
    sizeof(unsigned),  sizeof(int64_t), sizeof(Course),  sizeof(Noting),   sizeof(Loop),
    sizeof(Solver), sizeof(Party), sizeof(Term), sizeof(int64_t),   sizeof(Points),  sizeof(State),   sizeof(double),   sizeof(double),
    sizeof(Change),    sizeof(int64_t), sizeof(double),  sizeof(double),   sizeof(double),
    sizeof(Place),     sizeof(int64_t), sizeof(Control),
};

size_t length(const Py_buffer *buffers, int which)
{
    return (size_t)buffers[which].len / buffer_sizes[which];
}

/* NULL with an exception unless every buffer can be what it is said to be. */
static int check_buffers(const Py_buffer *buffers)
{
    for (int n = 0; n < N_BUFFERS; n++) {
        size_t alignment = buffer_sizes[n] < sizeof(double) ? sizeof(int) : sizeof(double);
        if (buffers[n].len > 0 &&
            ((size_t)buffers[n].len % buffer_sizes[n] != 0 || (uintptr_t)buffers[n].buf % alignment != 0)) {
            PyErr_Format(PyExc_ValueError, "kernel: %s is no aligned array of elements of %zu bytes", buffer_names[n],
                         buffer_sizes[n]);
            return 0;
        }
    }
    if (length(buffers, REFERENCES) != length(buffers, ENTRIES)) {
        PyErr_SetString(PyExc_ValueError, "kernel: there must be a reference for each of the entries");
        return 0;
    }
    if (length(buffers, DISTURBED) != length(buffers, OPERATIONS)) {
        PyErr_SetString(PyExc_ValueError, "kernel: there must be a mark for each of the operations");
        return 0;
    }
    size_t value_count = length(buffers, VALUES);
    if (length(buffers, FORMS) != 0 && length(buffers, FORMS) != value_count) {
        PyErr_SetString(PyExc_ValueError, "kernel: there must be a form for each of the values, or none at all");
        return 0;
    }
    if (length(buffers, STAMPS) != 0 && length(buffers, STAMPS) != value_count) {
        PyErr_SetString(PyExc_ValueError, "kernel: there must be a stamp for each of the values, or none at all");
        return 0;
    }
    if (value_count > 0 && length(buffers, HISTORY) % value_count != 0) {
        PyErr_SetString(PyExc_ValueError, "kernel: the history must be whole rows of values");
        return 0;
    }
    return 1;
}

/* One operation as a group of a single call; 0 if it points outside the plan. */
static int resolve(Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    *group = (Group){.begin = call, .end = call + 1};
    group->period = operation->period;
    group->phase = operation->phase;
    group->is_watched = operation->is_watched;
    group->is_late = operation->is_late;
    *call = (Call){0};
    if (operation->period < 1 || operation->phase < 0 || operation->phase >= operation->period) {
        return 0;
    }
    if (operation->kind == OPERATION_CHANGE) {
        if (!is_within(operation->index, 1, length(buffers, CHANGES))) {
            return 0;
        }
        group->kind = CHANGE;
        call->change = plan->changes + operation->index;
        if (!is_within(call->change->place, 1, plan->value_count)) {
            return 0;
        }
        call->values = plan->values + call->change->place;
        return 1;
    }
    if (operation->kind == OPERATION_STEP) {
        if (!is_within(operation->index, 1, length(buffers, INSTANCES))) {
            return 0;
        }
        const Instance *instance = (const Instance *)buffers[INSTANCES].buf + operation->index;
        group->kind = instance->told == 0 ? STEP : STEP_3;
        call->told = (Told *)(uintptr_t)instance->told;
        group->function = (uintptr_t)instance->function;
        call->component = (void *)(uintptr_t)instance->component;
        return group->function != 0;
    }
    switch (operation->kind) {
    case OPERATION_SET: case OPERATION_GET: case OPERATION_READ: case OPERATION_LOOK: case OPERATION_STAMP:
        return resolve_channel(plan, buffers, operation, operation->index, group, call);
    case OPERATION_EXTEND: case OPERATION_SLOPES:
        return resolve_course(plan, buffers, operation, group, call);
    case OPERATION_NOTE:
        return resolve_note(plan, buffers, operation, group, call);
    case OPERATION_BEGIN: case OPERATION_MARK: case OPERATION_END:
        return resolve_loop(plan, buffers, operation, group, call);
    case OPERATION_SOLVE:
        return resolve_solver(plan, buffers, operation, group, call);
    case OPERATION_ASK:
        return resolve_ask(plan, buffers, operation, group, call);
    default:
        return resolve_state(buffers, operation, group, call);
    }
}

/* Whether calls are alike; one after which to look at how numbers are rounded stands alone. */
static int are_alike(const Group *a, const Group *b)
{
    return !b->is_watched && a->kind == b->kind && a->function == b->function && a->count == b->count &&
           a->type == b->type && a->period == b->period && a->phase == b->phase && a->is_late == b->is_late &&
           a->is_unseen == b->is_unseen && b->kind < BEGIN &&
           (a->count == 0 || memcmp(a->references, b->references, a->count * sizeof *a->references) == 0);
}

void free_plan(Plan *plan)
{
    free(plan->calls);
    free(plan->groups);
    free(plan->bounds);
    free(plan->loop_groups);
    free(plan->group_of);
}

/* Where the operations of each part end: one part, or for each of n threads one that sets and steps, and then for each
   one that reads, or what is done at once where steps vary. 0 with an exception if they are not that. */
static int check_parts(Plan *plan, const Py_buffer *buffers, size_t count)
{
    const int64_t *ends = buffers[PARTS].buf;
    size_t n = length(buffers, PARTS);
    int is_varied = length(buffers, CONTROL) > 0;
    int is_sound = is_varied ? n == PROGRAMS : n == 1 || (HAS_THREADS && n >= 4 && n <= 2048 && n % 2 == 0);
    for (size_t k = 0; is_sound && k < n; k++) {
        is_sound = ends[k] >= (k > 0 ? ends[k - 1] : 0) && (uint64_t)ends[k] <= count;
    }
    if (!is_sound || (uint64_t)ends[n - 1] != count) {
        PyErr_SetString(PyExc_ValueError, "kernel: the parts must end one after the other, the last with the operations");
        return 0;
    }
    plan->ends = ends;
    plan->thread_count = n == 1 || is_varied ? 1 : (int)(n / 2);
    plan->bounds = calloc(n + 1, sizeof *plan->bounds);
    if (plan->bounds == NULL) {
        PyErr_NoMemory();
    }
    return plan->bounds != NULL;
}

/* 0 with an exception unless there is a place for each thread, among the operations. */
static int check_places(const Plan *plan, const Py_buffer *buffers, size_t count)
{
    const Place *places = buffers[PLACES].buf;
    int is_sound = length(buffers, PLACES) == (size_t)plan->thread_count;
    for (int n = 0; is_sound && n < plan->thread_count; n++) {
        is_sound = is_within(places[n].begin, 0, count);
    }
    if (!is_sound) {
        PyErr_SetString(PyExc_ValueError, "kernel: each thread must have a place among the operations");
    }
    return is_sound;
}

/* 0 with an exception unless what is said of steps that vary fits the plan. */
static int check_control(const Plan *plan, const Py_buffer *buffers)
{
    const Control *control = buffers[CONTROL].buf;
    if (length(buffers, CONTROL) == 0) {
        return 1;
    }
    int is_sound = is_within(0, control->value_count, plan->value_count) && is_within(0, control->point_count, length(buffers, POINTS)) &&
                   is_within(0, control->plain_count, length(buffers, PASSED)) &&
                   is_within(control->plain_count, control->shown_count, length(buffers, PASSED)) &&
                   is_within(control->work, (int64_t)work_of_control(plan, control), length(buffers, WORK));
    for (int64_t k = 0; is_sound && k < control->plain_count + control->shown_count; k++) {
        is_sound = is_within(plan->passed[k], 1, (size_t)control->value_count);
    }
    if (!is_sound) {
        PyErr_SetString(PyExc_ValueError, "kernel: the control of steps must fit the plan");
    }
    return is_sound;
}

int make_plan(Plan *plan, const Py_buffer *buffers, Py_ssize_t newest)
{
    if (!check_buffers(buffers)) {
        return 0;
    }
    const Operation *operations = buffers[OPERATIONS].buf;
    const int64_t *ends = buffers[PARTS].buf;
    size_t count = length(buffers, OPERATIONS), part = 0;
    plan->values = buffers[VALUES].buf;
    plan->value_count = length(buffers, VALUES);
    plan->history = buffers[HISTORY].buf;
    plan->depth = plan->value_count ? length(buffers, HISTORY) / plan->value_count : 0;
    plan->newest = (size_t)newest;
    plan->changes = buffers[CHANGES].buf;
    plan->forms = length(buffers, FORMS) == 0 ? NULL : buffers[FORMS].buf;
    plan->entries = buffers[ENTRIES].buf;
    plan->channels = buffers[CHANNELS].buf;
    plan->courses = buffers[COURSES].buf;
    plan->points = buffers[POINTS].buf;
    plan->stamps = length(buffers, STAMPS) == 0 ? NULL : buffers[STAMPS].buf;
    plan->loops = buffers[LOOPS].buf;
    plan->solvers = buffers[SOLVERS].buf;
    plan->parties = buffers[PARTIES].buf;
    plan->terms = buffers[TERMS].buf;
    plan->passed = buffers[PASSED].buf;
    plan->work = buffers[WORK].buf;
    plan->disturbed = buffers[DISTURBED].buf;
    plan->largest = 1;
    if (!check_parts(plan, buffers, count) || !check_places(plan, buffers, count) || !check_control(plan, buffers)) {
        return 0;
    }
    plan->calls = calloc(count + 1, sizeof *plan->calls);
    plan->groups = calloc(count + 1, sizeof *plan->groups);
    plan->loop_groups = calloc(2 * length(buffers, LOOPS) + 1, sizeof *plan->loop_groups);
    plan->group_of = calloc(count + 1, sizeof *plan->group_of);
    if (plan->calls == NULL || plan->groups == NULL || plan->loop_groups == NULL || plan->group_of == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    for (size_t n = 0; n < count; n++) {
        int begins = n == 0; /* a part, where no group may be continued */
        while (n == (size_t)ends[part]) {
            plan->bounds[++part] = plan->group_count;
            begins = 1;
        }
        Group *group = &plan->groups[plan->group_count];
        if (!resolve(plan, buffers, &operations[n], group, &plan->calls[n])) {
            PyErr_Format(PyExc_ValueError, "kernel: operation %zu does not fit the plan", n);
            return 0;
        }
        plan->largest = group->count > plan->largest ? group->count : plan->largest;
        if (!begins && are_alike(group - 1, group)) {
            group[-1].end++;
        } else {
            plan->group_count++;
        }
        plan->group_of[n] = plan->group_count - 1;
    }
    for (size_t n = part + 1; n <= length(buffers, PARTS); n++) {
        plan->bounds[n] = plan->group_count;
    }
    if (!are_loops_closed(plan, buffers)) {
        PyErr_SetString(PyExc_ValueError, "kernel: each loop must begin, mark its rounds and end");
        return 0;
    }
    return 1;
}

int make_room(Block *block, const Plan *plan, const Py_buffer *buffers, Py_ssize_t row)
{
    block->kept = buffers[KEPT].buf;
    block->kept_count = length(buffers, KEPT);
    int is_sound = length(buffers, TABLE) % (block->kept_count + 1) == 0;
    for (size_t k = 0; is_sound && k < block->kept_count; k++) {
        is_sound = is_within(block->kept[k], 1, plan->value_count);
    }
    block->stride = length(buffers, TABLE) / (block->kept_count + 1);
    if (!is_sound || !is_within(row, 0, block->stride)) {
        PyErr_SetString(PyExc_ValueError, "kernel: the table must have a column for the time and each of the values kept");
        return 0;
    }
    block->rows = (double *)buffers[TABLE].buf + row;
    block->capacity = block->stride - (size_t)row;
    return 1;
}

uint32_t layout(void)
{
    uint32_t sum = sizeof(Note) + sizeof(Swing);
    for (int n = 0; n < N_BUFFERS; n++) {
        sum = (31 * sum + (uint32_t)buffer_sizes[n]) & 0x7fffffffU;
    }
    return sum;
}
