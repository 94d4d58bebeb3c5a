/* The plan of the step loop, out of Python's arrays: all of it is checked, and turned into calls.

   Runs of like calls become groups: what is the same for a whole group stands in registers, and what is left of a call is
   the instance and a place. */

#include "growth.h"
#include "plan.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const char *const buffer_names[N_BUFFERS] = {
    "operations", "parts", "channels", "instances", "entries", "references", "forms", "changes", "kept", "values",
    "history", "table", "places", "disturbed",
};
static const size_t buffer_sizes[N_BUFFERS] = {
    sizeof(Operation), sizeof(int64_t), sizeof(Channel), sizeof(Instance), sizeof(Entry),
    sizeof(unsigned),  sizeof(int64_t), sizeof(Change),  sizeof(int64_t),  sizeof(double),
    sizeof(double),    sizeof(double),  sizeof(Place),   sizeof(int64_t),
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
    if (value_count > 0 && length(buffers, HISTORY) % value_count != 0) {
        PyErr_SetString(PyExc_ValueError, "kernel: the history must be whole rows of values");
        return 0;
    }
    return 1;
}

/* Whether so many elements, which are not less than none, stand from one on. */
static int is_within(int64_t begin, int64_t count, size_t length)
{
    return begin >= 0 && (uint64_t)begin <= length && (uint64_t)count <= length - (uint64_t)begin;
}

/* Whether a channel's entries can be read (or stand side by side among the values, where they must). */
static int entries_fit(const Plan *plan, const Entry *entries, int64_t count, size_t change_count, int is_row)
{
    for (int64_t k = 0; k < count; k++) {
        const Entry *entry = &entries[k];
        if (!is_within(entry->place, 1, plan->value_count) || entry->age < -1 || entry->change < -1 ||
            (entry->change >= 0 && (uint64_t)entry->change >= change_count) ||
            (entry->age >= 0 && (uint64_t)entry->age >= plan->depth) ||
            (is_row && entry->place != entries[0].place + k)) {
            return 0;
        }
    }
    return 1;
}

/* Whether the values stand among the live ones as they are to be set. */
static int are_in_place(const Entry *entries, int64_t count)
{
    for (int64_t k = 0; k < count; k++) {
        if (entries[k].form != NUMBER || entries[k].age >= 0 || entries[k].change >= 0 || entries[k].scale != 1.0 || entries[k].offset != 0.0 ||
            entries[k].place != entries[0].place + k) {
            return 0;
        }
    }
    return 1;
}

/* One operation as a group of a single call; 0 if it points outside the plan. */
static int resolve(const Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    *group = (Group){.begin = call, .end = call + 1};
    group->period = operation->period;
    group->phase = operation->phase;
    group->is_watched = operation->is_watched;
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
    int is_get = operation->kind == OPERATION_GET;
    if ((!is_get && operation->kind != OPERATION_SET) ||
        !is_within(operation->index, 1, length(buffers, CHANNELS))) {
        return 0;
    }
    const Channel *channel = (const Channel *)buffers[CHANNELS].buf + operation->index;
    if (channel->count < 1 || !is_within(channel->begin, channel->count, length(buffers, ENTRIES)) ||
        channel->type < 0 || channel->type > TYPE_BOOLEAN || channel->reference_count < 1 ||
        channel->reference_count > channel->count) {
        return 0;
    }
    const Entry *entries = (const Entry *)buffers[ENTRIES].buf + channel->begin;
    if (!entries_fit(plan, entries, channel->count, length(buffers, CHANGES), is_get && channel->type == 0)) {
        return 0;
    }
    int in_place = channel->type == 0 && channel->is_real && (is_get || are_in_place(entries, channel->count));
    group->kind = channel->type ? (is_get ? GET_3 : SET_3)
                  : in_place ? (is_get ? GET_REALS : SET_REALS_IN_PLACE)
                           : (is_get ? GET_INTEGERS : channel->is_real ? SET_REALS : SET_INTEGERS);
    group->function = (uintptr_t)channel->function;
    group->references = (const unsigned int *)buffers[REFERENCES].buf + channel->begin;
    group->count = (size_t)channel->count;
    group->reference_count = (size_t)channel->reference_count;
    group->type = (int)channel->type;
    call->component = (void *)(uintptr_t)channel->component;
    call->values = plan->values + (in_place || is_get ? entries[0].place : 0);
    call->entries = entries;
    return group->function != 0;
}

/* Whether calls are alike; one after which to look at how numbers are rounded stands alone. */
static int are_alike(const Group *a, const Group *b)
{
    return !b->is_watched && a->kind == b->kind && a->function == b->function && a->count == b->count &&
           a->period == b->period && a->phase == b->phase &&
           (a->count == 0 || memcmp(a->references, b->references, a->count * sizeof *a->references) == 0);
}

void free_plan(Plan *plan)
{
    free(plan->calls);
    free(plan->groups);
    free(plan->bounds);
}

/* Where the operations of each part end: one part, or for each of n threads one that sets and steps, and then for each
   one that reads. 0 with an exception if they are not that. */
static int check_parts(Plan *plan, const Py_buffer *buffers, size_t count)
{
    const int64_t *ends = buffers[PARTS].buf;
    size_t n = length(buffers, PARTS);
    int is_sound = n == 1 || (HAS_THREADS && n >= 4 && n <= 2048 && n % 2 == 0);
    for (size_t k = 0; is_sound && k < n; k++) {
        is_sound = ends[k] >= (k > 0 ? ends[k - 1] : 0) && (uint64_t)ends[k] <= count;
    }
    if (!is_sound || (uint64_t)ends[n - 1] != count) {
        PyErr_SetString(PyExc_ValueError, "kernel: the parts must end one after the other, the last with the operations");
        return 0;
    }
    plan->ends = ends;
    plan->thread_count = n == 1 ? 1 : (int)(n / 2);
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
    plan->disturbed = buffers[DISTURBED].buf;
    plan->largest = 1;
    if (!check_parts(plan, buffers, count) || !check_places(plan, buffers, count)) {
        return 0;
    }
    plan->calls = calloc(count + 1, sizeof *plan->calls);
    plan->groups = calloc(count + 1, sizeof *plan->groups);
    if (plan->calls == NULL || plan->groups == NULL) {
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
    }
    for (size_t n = part + 1; n <= length(buffers, PARTS); n++) {
        plan->bounds[n] = plan->group_count;
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
