/* The host's side of a lane, and the module. */

#include "../../fmi/binding/native/step3.h"
#include "../../fmi/guard/native/floats.h"
#include "riding.h"

#if HAS_LANES

#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>

typedef int (*DoStep)(void *component, double time, double step, int no_set_state);
typedef int (*Set)(void *component, const unsigned *references, size_t count, const void *values);
typedef int (*Set3)(void *component, const unsigned *references, size_t count, const void *values, size_t value_count);
typedef int (*Get)(void *component, const unsigned *references, size_t count, void *values);
typedef int (*Get3)(void *component, const unsigned *references, size_t count, void *values, size_t value_count);
typedef int (*SetSlopes)(void *component, const unsigned *references, size_t count, const int *orders,
                         const double *values);
typedef int (*Ask)(void *component, const unsigned *unknowns, size_t count, const unsigned *knowns, size_t known_count,
                   const double *seeds, double *slopes);
typedef int (*Ask3)(void *component, const unsigned *unknowns, size_t count, const unsigned *knowns, size_t known_count,
                    const double *seeds, size_t seed_count, double *slopes, size_t slope_count);
typedef int (*Save)(void *component, void **handle);
typedef int (*Restore)(void *component, void *handle);

/* An operation, as Python writes it. */
typedef struct {
    int64_t kind;
    uint64_t function;
    uint64_t component;
    uint64_t references; /* of a state: where its handle stands; of a step of FMI 3.0: what it tells */
    uint64_t count;      /* of the references, or how many derivatives there is room for; */
    uint64_t value_count; /* of the values, */
    uint64_t offset;      /* and where these stand in the memory */
    int64_t note;
} Operation;

typedef struct {
    char *memory;
    int64_t *notes; /* in it */
    Py_buffer operations;
} Guest;

typedef struct {
    Py_buffer memory;
    Lane *lane;
    Guest *guests;
    Py_ssize_t count;
    Spin spin;
    unsigned control; /* how numbers are rounded when it begins, as `float_control` has it, */
    fenv_t floats;    /* and all that belongs to it */
} Service;

enum { DISCARD = 2, ERROR = 3 };

static int is_failure(int status)
{
    return status < 0 || status > 1;
}

static int is_a_copy; /* this process is one that an FMU has forked */

static void note_copy(void) /* uncovered: in a process that an FMU has forked */
{
    is_a_copy = 1; /* uncovered: in a process that an FMU has forked */
}

static void put(int64_t *note, int64_t value)
{
    __atomic_store_n(note, value, __ATOMIC_RELAXED);
}

static size_t length(const Guest *guest)
{
    return (size_t)guest->operations.len / sizeof(Operation);
}

static size_t at_most(int64_t count, size_t room)
{
    return (uint64_t)count < room ? (size_t)count : room;
}

static int set_slopes(SetSlopes set, void *component, void *memory, size_t room)
{
    Slopes given = slopes_in(memory, room);
    return set(component, given.references, at_most(*given.count, room), given.orders, given.values);
}

static int ask(uintptr_t function, int counts_values, void *component, void *memory, size_t room)
{
    Question of = question_in(memory, room);
    size_t counts[N_COUNTS];
    for (int k = 0; k < N_COUNTS; k++) {
        counts[k] = at_most(of.counts[k], room);
    }
    int status = counts_values ? ((Ask3)function)(component, of.unknowns, counts[0], of.knowns, counts[1], of.seeds,
                                                  counts[2], of.slopes, counts[3])
                               : ((Ask)function)(component, of.unknowns, counts[0], of.knowns, counts[1], of.seeds,
                                                 of.slopes);
    *of.status = status;
    return status == DISCARD || status == ERROR ? 0 : status; /* it goes without */
}

static int save(Save get, void *component, void **handle)
{
    *handle = NULL;
    int status = get(component, handle);
    if (is_failure(status)) {
        *handle = NULL;
    }
    return status;
}

static int forget(Save give_back, void *component, void **handle)
{
    void *old = *handle;
    *handle = NULL; /* whatever comes of it */
    return give_back(component, &old);
}

static int step_3(DoStep3 do_step, void *component, Told *told, const Entry *entry)
{
    int status;
    int is_over = take_step_3(do_step, component, told, entry->time, entry->length, (int)entry->is_final, &status);
    return is_over || is_failure(status) ? status : CUT_SHORT + status;
}

static int do_one(const Guest *guest, const Operation *it, const Entry *entry)
{
    void *component = (void *)(uintptr_t)it->component;
    void *values = guest->memory + it->offset;
    void *beside = (void *)(uintptr_t)it->references;
    uintptr_t function = (uintptr_t)it->function;
    put(guest->notes + NOTE_CALL, it->note);
    switch (it->kind) {
    case SET: return ((Set)function)(component, beside, it->count, values);
    case SET_3: return ((Set3)function)(component, beside, it->count, values, it->value_count);
    case STEP: return ((DoStep)function)(component, entry->time, entry->length, (int)entry->is_final);
    case STEP_3: return step_3((DoStep3)function, component, beside, entry);
    case GET: return ((Get)function)(component, beside, it->count, values);
    case GET_3: return ((Get3)function)(component, beside, it->count, values, it->value_count);
    case SET_SLOPES: return set_slopes((SetSlopes)function, component, values, it->count);
    case ASK: case ASK_3: return ask(function, it->kind == ASK_3, component, values, it->count);
    case SAVE: return save((Save)function, component, beside);
    case RESTORE: return ((Restore)function)(component, *(void **)beside);
    default: return forget((Save)function, component, beside);
    }
}

/* An operation; 0 if it fails, which is noted. */
static int take(const Service *service, const Guest *guest, size_t number, const Entry *entry)
{
    const Operation *it = (const Operation *)guest->operations.buf + number;
    int status = do_one(guest, it, entry);
    if (is_a_copy) { /* uncovered: in a process that an FMU has forked, and that came back from the call */
        _exit(0);
    }
    if (float_control() != service->control) { /* an FMU must not change the numbers of its next calls */
        fesetenv(&service->floats);
    }
    if (is_failure(status)) {
        put(guest->notes + NOTE_STATUS, status);
        put(guest->notes + NOTE_FAILED, is_get(it->kind) ? (int64_t)number + 1 : -1 - (int64_t)number);
    }
    return !is_failure(status);
}

/* All that an instance gives. */
static int take_all_that_is_given(const Service *service, const Guest *guest, const Entry *entry)
{
    const Operation *operations = guest->operations.buf;
    for (size_t n = 0; n < length(guest); n++) {
        if (is_get(operations[n].kind) && !take(service, guest, n, entry)) {
            return 0;
        }
    }
    return 1;
}

static void take_entry(const Service *service, const Entry *entry)
{
    if ((Py_ssize_t)entry->instance >= service->count) {
        return;
    }
    const Guest *guest = service->guests + entry->instance;
    if (__atomic_load_n(guest->notes + NOTE_FAILED, __ATOMIC_RELAXED) == 0) { /* after a failure nothing is called */
        if (entry->what == READ) {
            take_all_that_is_given(service, guest, entry);
        } else if (entry->what < length(guest) && take(service, guest, entry->what, entry) &&
                   is_step(((const Operation *)guest->operations.buf)[entry->what].kind)) {
            take_all_that_is_given(service, guest, entry);
        }
    }
    put(guest->notes + NOTE_CALL, 0);
}

static void ride(Service *service)
{
    Lane *lane = service->lane;
    unsigned done = atomic_load(&lane->host.count);
    is_a_copy = 0; /* the guard's, if any */
    service->control = float_control();
    fegetenv(&service->floats);
    for (int is_over = 0; !is_over; done++) {
        while (!lane_wait(&lane->host, &lane->master, done, &service->spin, INT64_MAX)) {
        }
        Entry entry = lane->entries[done % RING];
        is_over = entry.what == LEAVE;
        if (!is_over) {
            take_entry(service, &entry);
        }
        lane_count(&lane->host, &lane->master, done + 1);
    }
}

/* Whether its values fit into so many words of the memory. */
static int has_room(const Operation *it, uint64_t rest)
{
    return it->kind == SET_SLOPES ? it->count < (rest + 1) / 2
           : is_ask(it->kind)     ? it->count <= rest && QUESTION_HEAD + 3 * it->count <= rest
                                  : it->count <= it->value_count && it->value_count <= rest;
}

/* Whether what Python says of an instance can be. */
static int is_sound(const Service *service, const Guest *guest, Py_ssize_t head)
{
    const Operation *operations = guest->operations.buf;
    uint64_t size = (uint64_t)service->memory.len;
    int is_fine = head >= 0 && head % 8 == 0 && head <= service->memory.len - 64 &&
                  guest->operations.len % (Py_ssize_t)sizeof *operations == 0;
    for (size_t n = 0; is_fine && n < length(guest); n++) {
        const Operation *it = operations + n;
        uint64_t rest = it->offset <= size ? (size - it->offset) / sizeof(double) : 0;
        is_fine = it->kind >= 0 && it->kind < N_KINDS && it->function != 0 && it->offset <= size &&
                  has_room(it, rest) && ((it->kind < SAVE && it->kind != STEP_3) || it->references != 0);
    }
    return is_fine;
}

static int take_guests(Service *service, PyObject *instances)
{
    Py_ssize_t count = PyList_Size(instances), head;
    service->guests = calloc((size_t)count + 1, sizeof *service->guests);
    if (service->guests == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    while (service->count < count) {
        Guest *guest = service->guests + service->count;
        if (!PyArg_ParseTuple(PyList_GetItem(instances, service->count), "ny*", &head, &guest->operations)) {
            return 0;
        }
        service->count++;
        if (!is_sound(service, guest, head)) {
            PyErr_SetString(PyExc_ValueError, "lane: the operations of an instance do not fit its memory");
            return 0;
        }
        guest->memory = service->memory.buf;
        guest->notes = (int64_t *)(guest->memory + head);
    }
    return 1;
}

PyObject *serve(PyObject *module, PyObject *arguments)
{
    Service service = {.lane = NULL};
    Py_ssize_t offset;
    PyObject *instances;
    double spin;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "w*nO!d:serve", &service.memory, &offset, &PyList_Type, &instances, &spin)) {
        return NULL;
    }
    service.lane = lane_in(&service.memory, offset);
    service.spin.most = service.spin.now = (int64_t)(spin * 1e9);
    int is_fine = service.lane != NULL && take_guests(&service, instances);
    if (is_fine) {
        Py_BEGIN_ALLOW_THREADS
        ride(&service);
        Py_END_ALLOW_THREADS
    }
    for (Py_ssize_t n = 0; n < service.count; n++) {
        PyBuffer_Release(&service.guests[n].operations);
    }
    free(service.guests);
    PyBuffer_Release(&service.memory);
    if (!is_fine) {
        return NULL;
    }
    Py_RETURN_NONE;
}
#endif

static PyMethodDef methods[] = {
#if HAS_LANES
    {"serve", serve, METH_VARARGS,
     "serve(memory, offset, instances, spin): do what is posted until told to leave. An instance is where its\n"
     "part of the memory begins, and its operations; the spin is in s."},
#endif
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {
    PyModuleDef_HEAD_INIT, "lane", "Calls of isolated FMUs through shared memory.", -1, methods, NULL, NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit_lane(void)
{
    PyObject *made = PyModule_Create(&module);
#if HAS_LANES
    pthread_atfork(NULL, NULL, note_copy);
    if (made != NULL && !add_riding(made)) { /* uncovered: memory */
        Py_CLEAR(made);
    }
#endif
    return made;
}
