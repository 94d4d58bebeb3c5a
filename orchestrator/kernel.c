/* The step loop, compiled: whole blocks of communication steps from a flat plan, without the interpreter.

   A plan is a list of operations on channels and instances, exactly those of the loop in master.py, in the same order and
   with the same arithmetic, so that the two give the same bits. A channel is some variables of one type of one instance:
   where their value references stand, and where their values come from or go to. All values are real numbers here;
   integers and truth values are exact in them. Python builds the plan, and takes over between blocks for progress,
   flushing and interruption.

   Every block begins by turning the plan into calls, where all of it is checked, and runs of like calls into groups: what
   is the same for a whole group stands in registers, and what is left of a call is the instance and a place.

   An extension is best one file, so this one is long: first the loop, then the way from Python's arrays to it. */

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef int (*DoStep)(void *component, double time, double step, int no_set_state);
typedef int (*SetReal)(void *component, const unsigned int *references, size_t count, const double *values);
typedef int (*GetReal)(void *component, const unsigned int *references, size_t count, double *values);
typedef int (*SetInteger)(void *component, const unsigned int *references, size_t count, const int *values);
typedef int (*GetInteger)(void *component, const unsigned int *references, size_t count, int *values);

enum { OPERATION_SET = 0, OPERATION_STEP = 1, OPERATION_GET = 2, OPERATION_CHANGE = 3 };
enum { WARNING = 1 }; /* the last status of the standard that is no failure */

/* ------------------------------------------------------------------------------------- the plan, as Python writes it */

typedef struct {
    uint64_t function;  /* address of fmi2SetReal, fmi2GetInteger, ... */
    uint64_t component; /* address of the instance */
    int64_t begin;      /* first of its entries */
    int64_t count;      /* number of its entries */
    int64_t is_real;
} Channel;

typedef struct {
    uint64_t function; /* address of fmi2DoStep */
    uint64_t component;
} Instance;

typedef struct {
    int64_t place; /* among the values; the outputs of a channel stand side by side */
    int64_t age;   /* how many recorded points back to read; -1: the live value */
    int64_t change; /* what events may do to it on the way; -1: nothing */
    double scale;
    double offset;
} Entry;

/* What an event makes of a value, while it is active; `place` is that of an output. */
typedef struct {
    int64_t active;
    int64_t place;
    int64_t is_real;
    double scale;
    double offset;
    double slope;
    double since;
} Change;

typedef struct {
    int32_t kind;
    int32_t index;  /* of the channel, instance or change */
    int32_t period; /* it is due in every so manyth step, */
    int32_t phase;  /* in those with this rest */
} Operation;

/* ------------------------------------------------------------------------------------------------ the plan, as it runs */

typedef enum { STEP, SET_REALS_IN_PLACE, SET_REALS, SET_INTEGERS, GET_REALS, GET_INTEGERS, CHANGE } Kind;

/* One operation. */
typedef struct {
    void *component;
    double *values;       /* where they are read or written in place */
    const Entry *entries; /* where they are gathered from */
    const Change *change;
} Call;

/* Calls of one kind, one after the other, of one function with the same value references. */
typedef struct {
    Kind kind;
    uintptr_t function;
    const unsigned int *references;
    size_t count; /* of the references */
    int32_t period;
    int32_t phase;
    Call *begin;
    Call *end;
} Group;

typedef struct {
    Call *calls;
    Group *groups;
    size_t group_count;
    double *reals; /* scratch for the largest channel */
    int *integers;
    double *values;
    size_t value_count;
    double *history; /* the last `depth` recorded points, a ring */
    size_t depth;
    size_t newest; /* the ring's newest row */
    const Change *changes;
} Plan;

/* ---------------------------------------------------------------------------------------------------------- stepping */

static int is_failure(int status)
{
    return status < 0 || status > WARNING;
}

static double changed(const Change *change, double value, double time)
{
    if (!change->active) {
        return value;
    }
    value = change->scale * value + change->offset + change->slope * (time - change->since);
    return change->is_real ? value : trunc(value);
}

static double read_entry(const Plan *plan, const Entry *entry, double time)
{
    const double *row = plan->values;
    if (entry->age >= 0) {
        size_t age = (size_t)entry->age;
        row = plan->history + (plan->newest + (plan->newest < age ? plan->depth : 0) - age) * plan->value_count;
    }
    double value = row[entry->place];
    if (entry->scale != 1.0 || entry->offset != 0.0) {
        value = entry->scale * value + entry->offset;
    }
    return entry->change < 0 ? value : changed(&plan->changes[entry->change], value, time);
}

/* Each of these takes a group's calls; it returns the one that failed, or the end. A failure with a status that is none is
   a value that is not finite. */

static const Call *take_steps(const Group *group, double time, double step, int *status)
{
    DoStep do_step = (DoStep)group->function;
    const Call *end = group->end;
    for (const Call *call = group->begin; call < end; call++) {
        int found = do_step(call->component, time, step, 1);
        if (is_failure(found)) {
            *status = found;
            return call;
        }
    }
    return end;
}

static const Call *set_reals_in_place(const Group *group, int *status)
{
    SetReal set = (SetReal)group->function;
    const unsigned int *references = group->references;
    size_t count = group->count;
    const Call *end = group->end;
    for (const Call *call = group->begin; call < end; call++) {
        int found = set(call->component, references, count, call->values);
        if (is_failure(found)) {
            *status = found;
            return call;
        }
    }
    return end;
}

static const Call *set_reals(const Plan *plan, const Group *group, double time, int *status)
{
    SetReal set = (SetReal)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        for (size_t k = 0; k < group->count; k++) {
            plan->reals[k] = read_entry(plan, &call->entries[k], time);
        }
        *status = set(call->component, group->references, group->count, plan->reals);
        if (is_failure(*status)) {
            return call;
        }
    }
    return group->end;
}

static const Call *set_integers(const Plan *plan, const Group *group, double time, int *status)
{
    SetInteger set = (SetInteger)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        for (size_t k = 0; k < group->count; k++) {
            plan->integers[k] = (int)read_entry(plan, &call->entries[k], time);
        }
        *status = set(call->component, group->references, group->count, plan->integers);
        if (is_failure(*status)) {
            return call;
        }
    }
    return group->end;
}

static const Call *get_reals(const Group *group, int *status)
{
    GetReal get = (GetReal)group->function;
    const unsigned int *references = group->references;
    size_t count = group->count;
    const Call *end = group->end;
    for (const Call *call = group->begin; call < end; call++) {
        int found = get(call->component, references, count, call->values);
        int finite = 1;
        for (size_t k = 0; k < count; k++) {
            finite &= isfinite(call->values[k]) != 0;
        }
        if (is_failure(found) || !finite) {
            *status = found;
            return call;
        }
    }
    return end;
}

static const Call *get_integers(const Plan *plan, const Group *group, int *status)
{
    GetInteger get = (GetInteger)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        *status = get(call->component, group->references, group->count, plan->integers);
        if (is_failure(*status)) {
            return call;
        }
        for (size_t k = 0; k < group->count; k++) {
            call->values[k] = (double)plan->integers[k];
        }
    }
    return group->end;
}

static const Call *change_values(const Group *group, double time)
{
    for (const Call *call = group->begin; call < group->end; call++) {
        *call->values = changed(call->change, *call->values, time);
    }
    return group->end;
}

static const Call *take_group(const Plan *plan, const Group *group, double time, double step, int *status)
{
    switch (group->kind) {
    case STEP: return take_steps(group, time, (double)group->period * step, status);
    case SET_REALS_IN_PLACE: return set_reals_in_place(group, status);
    case SET_REALS: return set_reals(plan, group, time, status);
    case SET_INTEGERS: return set_integers(plan, group, time, status);
    case GET_REALS: return get_reals(group, status);
    case GET_INTEGERS: return get_integers(plan, group, status);
    default: return change_values(group, time + step);
    }
}

/* Communication step number `k`, from operation number `from` on; the operation that failed, or -1. */
static int64_t advance(const Plan *plan, long long k, double time, double step, size_t from, int *status)
{
    const Group *end = plan->groups + plan->group_count;
    for (const Group *group = plan->groups; group < end; group++) {
        if (group->period > 1 && k % group->period != group->phase) {
            continue;
        }
        const Call *call;
        if (from > 0 && group->begin < plan->calls + from) { /* taken up again in the middle */
            Group rest = *group;
            rest.begin = plan->calls + from < group->end ? plan->calls + from : group->end;
            call = take_group(plan, &rest, time, step, status);
        } else {
            call = take_group(plan, group, time, step, status);
        }
        if (call < group->end) {
            return call - plan->calls;
        }
    }
    return -1;
}

static void remember(Plan *plan)
{
    if (plan->depth > 0) {
        plan->newest = plan->newest + 1 < plan->depth ? plan->newest + 1 : 0;
        memcpy(plan->history + plan->newest * plan->value_count, plan->values, plan->value_count * sizeof(double));
    }
}

/* Which steps to take, and where their rows go. */
typedef struct {
    double start;
    double step;
    long long first; /* number of the first step */
    long long count;
    long long every;
    long long last; /* number of the step that is recorded whatever `every` says */
    size_t from;    /* operation with which the first step is taken up */
    double *rows;
    size_t capacity;
} Block;

typedef struct {
    long long done;
    size_t written;
    int64_t failed;
    int status;
} Outcome;

static Outcome take_block(Plan *plan, const Block *block)
{
    Outcome outcome = {0, 0, -1, 0};
    size_t width = plan->value_count + 1;
    long long k = block->first, wait = block->every - k % block->every;
    for (; outcome.done < block->count; outcome.done++) {
        int is_due = wait == 1 || k + 1 == block->last;
        if (is_due && outcome.written == block->capacity) {
            break;
        }
        size_t from = outcome.done == 0 ? block->from : 0;
        outcome.failed = advance(plan, k, block->start + (double)k * block->step, block->step, from, &outcome.status);
        if (outcome.failed >= 0) {
            break;
        }
        k++;
        wait = wait > 1 ? wait - 1 : block->every;
        remember(plan);
        if (is_due) {
            double *row = block->rows + outcome.written * width;
            row[0] = block->start + (double)k * block->step;
            memcpy(row + 1, plan->values, plan->value_count * sizeof(double));
            outcome.written++;
        }
    }
    return outcome;
}

/* --------------------------------------------------------------------------------------------- from arrays to a plan */

/* Buffers in the sequence of the arguments, and the size of what they hold; `values` and what follows is written. */
enum { OPERATIONS, CHANNELS, INSTANCES, ENTRIES, REFERENCES, CHANGES, VALUES, HISTORY, ROWS, N_BUFFERS };
static const char *const buffer_names[N_BUFFERS] = {
    "operations", "channels", "instances", "entries", "references", "changes", "values", "history", "rows",
};
static const size_t buffer_sizes[N_BUFFERS] = {
    sizeof(Operation), sizeof(Channel), sizeof(Instance), sizeof(Entry),  sizeof(unsigned),
    sizeof(Change),    sizeof(double),  sizeof(double),   sizeof(double),
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
    size_t value_count = length(buffers, VALUES);
    if (value_count > 0 && length(buffers, HISTORY) % value_count != 0) {
        PyErr_SetString(PyExc_ValueError, "kernel: the history must be whole rows of values");
        return 0;
    }
    return 1;
}

static int is_within(int64_t begin, int64_t count, size_t length)
{
    return begin >= 0 && count >= 0 && (uint64_t)begin <= length && (uint64_t)count <= length - (uint64_t)begin;
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
    return count > 0;
}

/* One operation as a group of a single call; 0 if it points outside the plan. */
static int resolve(const Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    *group = (Group){.begin = call, .end = call + 1, .period = operation->period, .phase = operation->phase};
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
    if (!is_within(channel->begin, channel->count, length(buffers, ENTRIES))) {
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
    call->values = plan->values + (channel->count > 0 && (in_place || is_get) ? entries[0].place : 0);
    call->entries = entries;
    return group->function != 0;
}

static int are_alike(const Group *a, const Group *b)
{
    return a->kind == b->kind && a->function == b->function && a->count == b->count && a->period == b->period &&
           a->phase == b->phase && (a->count == 0 || memcmp(a->references, b->references, a->count * sizeof *a->references) == 0);
}

static void free_plan(Plan *plan)
{
    free(plan->calls);
    free(plan->groups);
    free(plan->reals);
    free(plan->integers);
}

/* 0 with an exception if the plan is not sound. */
static int make_plan(Plan *plan, const Py_buffer *buffers, Py_ssize_t newest)
{
    const Operation *operations = buffers[OPERATIONS].buf;
    size_t count = length(buffers, OPERATIONS), largest = 1;
    plan->values = buffers[VALUES].buf;
    plan->value_count = length(buffers, VALUES);
    plan->history = buffers[HISTORY].buf;
    plan->depth = plan->value_count ? length(buffers, HISTORY) / plan->value_count : 0;
    plan->newest = (size_t)newest;
    plan->changes = buffers[CHANGES].buf;
    plan->calls = calloc(count + 1, sizeof *plan->calls);
    plan->groups = calloc(count + 1, sizeof *plan->groups);
    if (plan->calls == NULL || plan->groups == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    for (size_t n = 0; n < count; n++) {
        Group *group = &plan->groups[plan->group_count];
        if (!resolve(plan, buffers, &operations[n], group, &plan->calls[n])) {
            PyErr_Format(PyExc_ValueError, "kernel: operation %zu does not fit the plan", n);
            return 0;
        }
        largest = group->count > largest ? group->count : largest;
        if (n > 0 && are_alike(group - 1, group)) {
            group[-1].end++;
        } else {
            plan->group_count++;
        }
    }
    plan->reals = malloc(largest * sizeof *plan->reals);
    plan->integers = malloc(largest * sizeof *plan->integers);
    if (plan->reals == NULL || plan->integers == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    return 1;
}

PyDoc_STRVAR(run_doc,
    "run(operations, channels, instances, entries, references, changes, values, history, newest, rows, every,\n"
    "    start, step, first, count, last, begin) -> (done, written, failed, status, newest)\n\n"
    "Take up to `count` communication steps from number `first`, and from operation `begin` of that step, which one\n"
    "that failed may have left undone. Rows (time, values) are written for every `every`-th\n"
    "step and for step number `last`; the block ends before a row for which there is no room. `failed` is the operation\n"
    "that ended the block, -1 if none did, and `status` its FMI status; of ok or warning, a value is not finite.");

static PyObject *run(PyObject *module, PyObject *arguments)
{
    Py_buffer b[N_BUFFERS];
    Block block;
    Py_ssize_t newest;
    PyObject *result = NULL;
    (void)module;
    Py_ssize_t from;
    if (!PyArg_ParseTuple(arguments, "y*y*y*y*y*y*w*w*nw*LddLLLn:run", &b[OPERATIONS], &b[CHANNELS], &b[INSTANCES],
                          &b[ENTRIES], &b[REFERENCES], &b[CHANGES], &b[VALUES], &b[HISTORY], &newest, &b[ROWS],
                          &block.every, &block.start, &block.step, &block.first, &block.count, &block.last, &from)) {
        return NULL;
    }
    Plan plan = {0};
    if (check_buffers(b) && make_plan(&plan, b, newest)) {
        if (block.every < 1 || block.first < 0 || block.count < 0 || block.count > INT64_MAX - block.first ||
            newest < 0 || from < 0 || (plan.depth > 0 && plan.newest >= plan.depth)) {
            PyErr_SetString(PyExc_ValueError, "kernel: every, first, count, newest and begin must fit the plan");
        } else {
            Outcome outcome;
            block.from = (size_t)from;
            block.rows = b[ROWS].buf;
            block.capacity = length(b, ROWS) / (plan.value_count + 1);
            Py_BEGIN_ALLOW_THREADS
            outcome = take_block(&plan, &block);
            Py_END_ALLOW_THREADS
            result = Py_BuildValue("(LnLin)", outcome.done, (Py_ssize_t)outcome.written, (long long)outcome.failed,
                                   outcome.status, (Py_ssize_t)plan.newest);
        }
    }
    free_plan(&plan);
    for (int n = 0; n < N_BUFFERS; n++) {
        PyBuffer_Release(&b[n]);
    }
    return result;
}

static PyMethodDef methods[] = {{"run", run, METH_VARARGS, run_doc}, {NULL, NULL, 0, NULL}};

static struct PyModuleDef module = {
    PyModuleDef_HEAD_INIT, "kernel", "The compiled step loop of the master.", 0, methods, NULL, NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit_kernel(void)
{
    return PyModule_Create(&module);
}
