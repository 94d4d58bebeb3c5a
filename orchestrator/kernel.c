/* The step loop, compiled: whole blocks of communication steps from a flat plan, without the interpreter.

   A plan is a list of operations on channels and instances, exactly those of the loop in master.py, in the same order and
   with the same arithmetic, so that the two give the same bits. A channel is some variables of one type of one instance:
   where their value references stand, and where their values come from or go to. All values are real numbers here;
   integers and truth values are exact in them. Python builds the plan, and takes over between blocks for progress,
   flushing and interruption. */

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef int (*DoStep)(void *component, double time, double step, int no_set_state);
typedef int (*ExchangeReal)(void *component, const unsigned int *references, size_t count, double *values);
typedef int (*ExchangeInteger)(void *component, const unsigned int *references, size_t count, int *values);

enum { OPERATION_SET = 0, OPERATION_STEP = 1, OPERATION_GET = 2 };
enum { NOT_FINITE = -1 };

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
    int64_t place; /* among the values */
    int64_t age;   /* how many recorded points back to read; -1: the live value */
    double scale;
    double offset;
} Entry;

typedef struct {
    int32_t kind;
    int32_t index; /* of the channel or instance */
} Operation;

typedef struct {
    const Operation *operations;
    size_t operation_count;
    const Channel *channels;
    const Instance *instances;
    const Entry *entries;
    const unsigned int *references;
    double *values;
    size_t value_count;
    double *history; /* the last `depth` recorded points, a ring */
    size_t depth;
    size_t newest; /* the ring's newest row */
    double *reals; /* scratch for one channel */
    int *integers;
} Plan;

static double read_entry(const Plan *plan, const Entry *entry)
{
    double value;
    if (entry->age < 0) {
        value = plan->values[entry->place];
    } else {
        size_t row = (plan->newest + plan->depth - (size_t)entry->age) % plan->depth;
        value = plan->history[row * plan->value_count + (size_t)entry->place];
    }
    return entry->scale == 1.0 && entry->offset == 0.0 ? value : entry->scale * value + entry->offset;
}

static int set_channel(const Plan *plan, const Channel *channel)
{
    const Entry *entries = plan->entries + channel->begin;
    const unsigned int *references = plan->references + channel->begin;
    void *component = (void *)(uintptr_t)channel->component;
    size_t count = (size_t)channel->count;
    if (channel->is_real) {
        for (size_t k = 0; k < count; k++) {
            plan->reals[k] = read_entry(plan, &entries[k]);
        }
        return ((ExchangeReal)(uintptr_t)channel->function)(component, references, count, plan->reals);
    }
    for (size_t k = 0; k < count; k++) {
        plan->integers[k] = (int)read_entry(plan, &entries[k]);
    }
    return ((ExchangeInteger)(uintptr_t)channel->function)(component, references, count, plan->integers);
}

/* Outputs of a channel stand side by side among the values. */
static int get_channel(const Plan *plan, const Channel *channel)
{
    double *target = plan->values + plan->entries[channel->begin].place;
    const unsigned int *references = plan->references + channel->begin;
    void *component = (void *)(uintptr_t)channel->component;
    size_t count = (size_t)channel->count;
    int status;
    if (channel->is_real) {
        status = ((ExchangeReal)(uintptr_t)channel->function)(component, references, count, target);
        for (size_t k = 0; k < count && status <= 1; k++) {
            if (!isfinite(target[k])) {
                return NOT_FINITE;
            }
        }
        return status;
    }
    status = ((ExchangeInteger)(uintptr_t)channel->function)(component, references, count, plan->integers);
    for (size_t k = 0; k < count; k++) {
        target[k] = (double)plan->integers[k];
    }
    return status;
}

/* One communication step; the index of the operation that failed, or -1. */
static int64_t advance(const Plan *plan, double time, double step, int *status)
{
    for (size_t n = 0; n < plan->operation_count; n++) {
        const Operation *operation = &plan->operations[n];
        if (operation->kind == OPERATION_STEP) {
            const Instance *instance = &plan->instances[operation->index];
            *status = ((DoStep)(uintptr_t)instance->function)((void *)(uintptr_t)instance->component, time, step, 1);
        } else if (operation->kind == OPERATION_SET) {
            *status = set_channel(plan, &plan->channels[operation->index]);
        } else {
            *status = get_channel(plan, &plan->channels[operation->index]);
        }
        if (*status > 1 || *status == NOT_FINITE) {
            return (int64_t)n;
        }
    }
    return -1;
}

static int has_size(const Py_buffer *buffer, size_t count, size_t size, const char *name)
{
    if (buffer->len == (Py_ssize_t)(count * size)) {
        return 1;
    }
    PyErr_Format(PyExc_ValueError, "kernel: %s has %zd bytes, expected %zu", name, buffer->len, count * size);
    return 0;
}

PyDoc_STRVAR(run_doc,
    "run(operations, channels, instances, entries, references, values, history, newest, rows, every,\n"
    "    start, step, first, count, last) -> (done, written, failed, status, newest)\n\n"
    "Take up to `count` communication steps from number `first`. Rows (time, values) are written for every `every`-th\n"
    "step and for step number `last`. `failed` is the operation that ended the block, -1 if none did; its status is the\n"
    "FMI status, or -1 for a value that is not finite.");

static PyObject *run(PyObject *module, PyObject *arguments)
{
    enum { OPERATIONS, CHANNELS, INSTANCES, ENTRIES, REFERENCES, VALUES, HISTORY, ROWS, N_BUFFERS };
    Py_buffer b[N_BUFFERS];
    Py_ssize_t newest;
    long long every, first, count, last;
    double start, step;
    PyObject *result = NULL;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "y*y*y*y*y*w*w*nw*LddLLL:run", &b[OPERATIONS], &b[CHANNELS], &b[INSTANCES],
                          &b[ENTRIES], &b[REFERENCES], &b[VALUES], &b[HISTORY], &newest, &b[ROWS], &every, &start, &step,
                          &first, &count, &last)) {
        return NULL;
    }
    size_t value_count = (size_t)b[VALUES].len / sizeof(double);
    size_t entry_count = (size_t)b[ENTRIES].len / sizeof(Entry);
    size_t width = value_count + 1;
    size_t capacity = (size_t)b[ROWS].len / (width * sizeof(double));
    Plan plan = {
        .operations = b[OPERATIONS].buf,
        .operation_count = (size_t)b[OPERATIONS].len / sizeof(Operation),
        .channels = b[CHANNELS].buf,
        .instances = b[INSTANCES].buf,
        .entries = b[ENTRIES].buf,
        .references = b[REFERENCES].buf,
        .values = b[VALUES].buf,
        .value_count = value_count,
        .history = b[HISTORY].buf,
        .depth = value_count ? (size_t)b[HISTORY].len / (value_count * sizeof(double)) : 0,
        .newest = (size_t)newest,
        .reals = malloc((entry_count + 1) * sizeof(double)),
        .integers = malloc((entry_count + 1) * sizeof(int)),
    };
    if (plan.reals == NULL || plan.integers == NULL) {
        PyErr_NoMemory();
    } else if (every < 1 || (plan.depth > 0 && plan.newest >= plan.depth)) {
        PyErr_SetString(PyExc_ValueError, "kernel: every and newest must fit the plan");
    } else if (has_size(&b[REFERENCES], entry_count, sizeof(unsigned int), "references")) {
        double *rows = b[ROWS].buf;
        size_t written = 0;
        long long done = 0;
        int64_t failed = -1;
        int status = 0;
        Py_BEGIN_ALLOW_THREADS
        while (done < count && written < capacity) {
            long long k = first + done;
            failed = advance(&plan, start + (double)k * step, step, &status);
            if (failed >= 0) {
                break;
            }
            done++;
            k++;
            if (plan.depth > 0) {
                plan.newest = (plan.newest + 1) % plan.depth;
                memcpy(plan.history + plan.newest * value_count, plan.values, value_count * sizeof(double));
            }
            if (k % every == 0 || k == last) {
                rows[written * width] = start + (double)k * step;
                memcpy(rows + written * width + 1, plan.values, value_count * sizeof(double));
                written++;
            }
        }
        Py_END_ALLOW_THREADS
        result = Py_BuildValue("(LnLin)", done, (Py_ssize_t)written, (long long)failed, status, (Py_ssize_t)plan.newest);
    }
    free(plan.reals);
    free(plan.integers);
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
