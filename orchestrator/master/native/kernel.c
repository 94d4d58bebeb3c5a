/* The step loop, compiled: whole blocks of communication steps from a flat plan, without the interpreter.

   A plan is a list of operations on channels and instances, exactly those of the loop in master.py, in the same order. A
   channel is some variables of one type of one instance: where their value references stand, and where their values come
   from or go to. All values are real numbers here; integers and truth values are exact in them. Python builds the plan,
   and takes over between blocks for progress, flushing and interruption.

   Every block begins by turning the plan into calls, where all of it is checked, and runs of like calls into groups: what
   is the same for a whole group stands in registers, and what is left of a call is the instance and a place.

   This file is the way from Python's arrays to a plan; stepping.c takes the steps, team.c with several threads. */

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include "kernel.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Buffers in the sequence of the arguments, and the size of what they hold; `values` and what follows is written. */
enum { OPERATIONS, PARTS, CHANNELS, INSTANCES, ENTRIES, REFERENCES, CHANGES, VALUES, HISTORY, ROWS, PLACES, DISTURBED, N_BUFFERS };
static const char *const buffer_names[N_BUFFERS] = {
    "operations", "parts", "channels", "instances", "entries", "references", "changes", "values", "history", "rows",
    "places", "disturbed",
};
static const size_t buffer_sizes[N_BUFFERS] = {
    sizeof(Operation), sizeof(int64_t), sizeof(Channel), sizeof(Instance), sizeof(Entry),
    sizeof(unsigned),  sizeof(Change),  sizeof(double),  sizeof(double),   sizeof(double),
    sizeof(Place),     sizeof(int64_t),
};

static size_t length(const Py_buffer *buffers, int which)
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

/* Whether a channel's entries can be read (or, written, stand side by side among the values). */
static int entries_fit(const Plan *plan, const Entry *entries, int64_t count, size_t change_count, int is_written)
{
    for (int64_t k = 0; k < count; k++) {
        const Entry *entry = &entries[k];
        if (!is_within(entry->place, 1, plan->value_count) || entry->age < -1 || entry->change < -1 ||
            (entry->change >= 0 && (uint64_t)entry->change >= change_count) ||
            (entry->age >= 0 && (uint64_t)entry->age >= plan->depth) ||
            (is_written && entry->place != entries[0].place + k)) {
            return 0;
        }
    }
    return 1;
}

/* Whether the values stand among the live ones as they are to be set. */
static int are_in_place(const Entry *entries, int64_t count)
{
    for (int64_t k = 0; k < count; k++) {
        if (entries[k].age >= 0 || entries[k].change >= 0 || entries[k].scale != 1.0 || entries[k].offset != 0.0 ||
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
        group->kind = STEP;
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
    if (channel->count < 1 || !is_within(channel->begin, channel->count, length(buffers, ENTRIES))) {
        return 0;
    }
    const Entry *entries = (const Entry *)buffers[ENTRIES].buf + channel->begin;
    if (!entries_fit(plan, entries, channel->count, length(buffers, CHANGES), is_get)) {
        return 0;
    }
    int in_place = channel->is_real && (is_get || are_in_place(entries, channel->count));
    group->kind = in_place ? (is_get ? GET_REALS : SET_REALS_IN_PLACE)
                           : (is_get ? GET_INTEGERS : channel->is_real ? SET_REALS : SET_INTEGERS);
    group->function = (uintptr_t)channel->function;
    group->references = (const unsigned int *)buffers[REFERENCES].buf + channel->begin;
    group->count = (size_t)channel->count;
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

static void free_plan(Plan *plan)
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

/* 0 with an exception if the plan is not sound. */
static int make_plan(Plan *plan, const Py_buffer *buffers, Py_ssize_t newest)
{
    const Operation *operations = buffers[OPERATIONS].buf;
    const int64_t *ends = buffers[PARTS].buf;
    size_t count = length(buffers, OPERATIONS), part = 0;
    plan->values = buffers[VALUES].buf;
    plan->value_count = length(buffers, VALUES);
    plan->history = buffers[HISTORY].buf;
    plan->depth = plan->value_count ? length(buffers, HISTORY) / plan->value_count : 0;
    plan->newest = (size_t)newest;
    plan->changes = buffers[CHANGES].buf;
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

/* Room for each thread; NULL with an exception if there is none. They are freed by freeing the first one's. */
static Hand *make_hands(const Plan *plan)
{
    size_t count = (size_t)plan->thread_count;
    Hand *hands = calloc(count, sizeof *hands);
    double *reals = calloc(count * plan->largest, sizeof *reals);
    int *integers = calloc(count * plan->largest, sizeof *integers);
    if (hands == NULL || reals == NULL || integers == NULL) {
        free(hands);
        free(reals);
        free(integers);
        PyErr_NoMemory();
        return NULL;
    }
    for (size_t n = 0; n < count; n++) {
        hands[n] = (Hand){plan, reals + n * plan->largest, integers + n * plan->largest, plan->note, NULL};
    }
    return hands;
}

static void free_hands(Hand *hands)
{
    free(hands[0].reals);
    free(hands[0].integers);
    free(hands);
}

/* A block without the interpreter; 0 with an exception if its threads cannot be had. */
static int take(Plan *plan, const Block *block, Outcome *outcome)
{
    plan->note = guard.note(0);
    plan->note->rows = 0;
    Hand *hands = make_hands(plan);
    int is_fine = 1;
    if (hands == NULL) {
        return 0;
    }
    plan->control = float_control();
    fegetenv(&plan->floats);
    Py_BEGIN_ALLOW_THREADS
#if HAS_THREADS
    if (plan->thread_count > 1) {
        is_fine = take_block_together(plan, hands, block, outcome);
    } else
#endif
        *outcome = take_block(plan, hands, block);
    Py_END_ALLOW_THREADS
    free_hands(hands);
    if (!is_fine) {
        PyErr_SetString(PyExc_RuntimeError, "kernel: no more threads can be started");
    }
    return is_fine;
}

PyDoc_STRVAR(run_doc,
    "run(operations, parts, channels, instances, entries, references, changes, values, history, newest, rows, places,\n"
    "    disturbed, every, start, step, first, count, last) -> (done, written, newest)\n\n"
    "Take up to `count` communication steps from number `first`. Rows (time, values) are written for every `every`-th\n"
    "step and for step number `last`; the block ends before a row for which there is no room, and where an operation\n"
    "fails. `places` say for each thread with which operation its part of the first step begins, and whether it waits\n"
    "because one has failed; then how far the step that was left has got. In `disturbed` an operation after which\n"
    "numbers were rounded in another way, which was put back, has the number of the first step that ended so.");

static PyObject *run(PyObject *module, PyObject *arguments)
{
    Py_buffer b[N_BUFFERS];
    Block block;
    Py_ssize_t newest;
    PyObject *result = NULL;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "y*y*y*y*y*y*y*w*w*nw*w*w*LddLLL:run", &b[OPERATIONS], &b[PARTS], &b[CHANNELS],
                          &b[INSTANCES], &b[ENTRIES], &b[REFERENCES], &b[CHANGES], &b[VALUES], &b[HISTORY], &newest,
                          &b[ROWS], &b[PLACES], &b[DISTURBED], &block.every, &block.start, &block.step, &block.first,
                          &block.count, &block.last)) {
        return NULL;
    }
    Plan plan = {0};
    if (check_buffers(b) && make_plan(&plan, b, newest)) {
        if (block.every < 1 || block.first < 0 || block.count < 0 || block.count > INT64_MAX - block.first ||
            newest < 0 || (plan.depth > 0 && plan.newest >= plan.depth)) {
            PyErr_SetString(PyExc_ValueError, "kernel: every, first, count and newest must fit the plan");
        } else {
            Outcome outcome;
            block.places = b[PLACES].buf;
            block.rows = b[ROWS].buf;
            block.capacity = length(b, ROWS) / (plan.value_count + 1);
            if (take(&plan, &block, &outcome)) {
                result = Py_BuildValue("(Lnn)", outcome.done, (Py_ssize_t)outcome.written, (Py_ssize_t)plan.newest);
            }
        }
    }
    free_plan(&plan);
    for (int n = 0; n < N_BUFFERS; n++) {
        PyBuffer_Release(&b[n]);
    }
    return result;
}

static PyObject *watch(PyObject *module, PyObject *arguments)
{
    unsigned long long address;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "K:watch", &address)) {
        return NULL;
    }
    guard = *(const Guard *)(uintptr_t)address;
    Py_RETURN_NONE;
}

static PyMethodDef methods[] = {
    {"run", run, METH_VARARGS, run_doc},
    {"watch", watch, METH_VARARGS, "watch(address): call FMUs with the guard that stands there."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {
    PyModuleDef_HEAD_INIT, "kernel", "The compiled step loop of the master.", 0, methods, NULL, NULL, NULL, NULL,
};

/* The sizes of what the buffers hold in one number, by which Python knows a kernel that other sources were compiled to. */
static uint32_t layout(void)
{
    uint32_t sum = sizeof(Note);
    for (int n = 0; n < N_BUFFERS; n++) {
        sum = (31 * sum + (uint32_t)buffer_sizes[n]) & 0x7fffffffU;
    }
    return sum;
}

PyMODINIT_FUNC PyInit_kernel(void)
{
    PyObject *made = PyModule_Create(&module);
    if (made != NULL && (PyModule_AddIntConstant(made, "HAS_THREADS", HAS_THREADS) < 0 || /* uncovered: memory */
                         PyModule_AddIntConstant(made, "LAYOUT", (long)layout()) < 0)) {  /* uncovered: memory */
        Py_DECREF(made);
        return NULL;
    }
    return made;
}
