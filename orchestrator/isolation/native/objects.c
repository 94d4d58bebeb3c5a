/* The master's side of a lane as objects of Python's. */

#include "riding.h"

#if HAS_LANES

#include <stdlib.h>

Lane *lane_in(const Py_buffer *memory, Py_ssize_t offset)
{
    if (offset < 0 || offset % 64 != 0 || memory->len < offset + (Py_ssize_t)sizeof(Lane)) {
        PyErr_SetString(PyExc_ValueError, "lane: it does not fit into the memory");
        return NULL;
    }
    return (Lane *)((char *)memory->buf + offset);
}

static PyTypeObject *lane_type, *rider_type;

static int goes_on(LaneObject *road, uint32_t number)
{
    PyGILState_STATE state = PyGILState_Ensure();
    PyObject *waits = road->waits, *traceback, *type;
    Py_INCREF(waits); /* who closes the lane meanwhile gives it up */
    PyObject *found = PyObject_CallFunction(waits, "I", (unsigned)number);
    int is_fine = found != NULL;
    if (!is_fine) {
        PyErr_Fetch(&type, &road->failure, &traceback);
        PyErr_NormalizeException(&type, &road->failure, &traceback);
        Py_XDECREF(type);
        Py_XDECREF(traceback);
    }
    Py_XDECREF(found);
    Py_DECREF(waits);
    PyGILState_Release(state);
    return is_fine;
}

static PyObject *allocated(PyTypeObject *type)
{
    return ((allocfunc)PyType_GetSlot(type, Py_tp_alloc))(type, 0);
}

static void freed(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

static PyObject *make_lane(PyTypeObject *type, PyObject *arguments, PyObject *names)
{
    Py_buffer memory;
    Py_ssize_t offset;
    int line;
    double moment, spin;
    PyObject *waits;
    (void)names;
    if (!PyArg_ParseTuple(arguments, "w*niddO:Lane", &memory, &offset, &line, &moment, &spin, &waits)) {
        return NULL;
    }
    Lane *lane = lane_in(&memory, offset);
    LaneObject *road = lane == NULL ? NULL : (LaneObject *)allocated(type);
    if (road == NULL) {
        PyBuffer_Release(&memory);
        return NULL;
    }
    road->memory = memory;
    road->lane = lane;
    road->line = line;
    road->moment = (int64_t)(moment * 1e9);
    road->goes_on = goes_on;
    Py_INCREF(waits);
    road->waits = waits;
    road->spin.most = road->spin.now = (int64_t)(spin * 1e9);
    return (PyObject *)road;
}

static PyObject *done(PyObject *self, PyObject *nothing)
{
    LaneObject *road = (LaneObject *)self;
    (void)nothing;
    return PyLong_FromUnsignedLong(road->lane == NULL ? 0 : atomic_load(&road->lane->host.count));
}

static PyObject *close_lane(PyObject *self, PyObject *nothing)
{
    LaneObject *road = (LaneObject *)self;
    (void)nothing;
    if (road->lane != NULL) {
        road->lane = NULL;
        PyBuffer_Release(&road->memory);
        Py_CLEAR(road->waits);
    }
    Py_RETURN_NONE;
}

static PyObject *failure(PyObject *self, PyObject *nothing)
{
    LaneObject *road = (LaneObject *)self;
    PyObject *found = road->failure;
    (void)nothing;
    road->failure = NULL;
    if (found == NULL) {
        Py_RETURN_NONE;
    }
    return found;
}

static void free_lane(PyObject *self)
{
    Py_XDECREF(close_lane(self, NULL));
    Py_XDECREF(failure(self, NULL));
    freed(self);
}

static PyObject *wait_for_all(PyObject *self, PyObject *arguments)
{
    LaneObject *road = (LaneObject *)self;
    double most;
    int how = CLOSED;
    if (!PyArg_ParseTuple(arguments, "d:wait", &most)) {
        return NULL;
    }
    if (road->lane != NULL) {
        Py_BEGIN_ALLOW_THREADS
        how = await(road, atomic_load(&road->lane->master.count), (int64_t)(most * 1e9));
        Py_END_ALLOW_THREADS
    }
    return PyLong_FromLong(how);
}

static PyObject *leave(PyObject *self, PyObject *nothing)
{
    LaneObject *road = (LaneObject *)self;
    uint32_t ticket;
    (void)nothing;
    return PyBool_FromLong(road->lane != NULL && post(road, (Entry){.what = LEAVE}, 1, &ticket));
}

/* Whether so many values of 64 bits stand in the memory, from an offset on; else an exception. */
static int has_room(const LaneObject *road, Py_ssize_t offset, Py_ssize_t count)
{
    const Py_ssize_t size = sizeof(double);
    int is_there = road->lane != NULL && offset >= 0 && offset % size == 0 && offset <= road->memory.len && count >= 0 &&
                   count <= (road->memory.len - offset) / size;
    if (!is_there) {
        PyErr_SetString(PyExc_ValueError, "lane: what is wanted does not stand in the memory");
    }
    return is_there;
}

static PyObject *make_rider(PyTypeObject *type, PyObject *arguments, PyObject *names)
{
    LaneObject *road;
    Py_ssize_t head;
    unsigned number;
    (void)names;
    if (!PyArg_ParseTuple(arguments, "O!nI:Rider", lane_type, &road, &head, &number)) {
        return NULL;
    }
    if (!has_room(road, head, 8)) {
        return NULL;
    }
    RiderObject *rider = (RiderObject *)allocated(type);
    if (rider != NULL) {
        Py_INCREF((PyObject *)road);
        rider->road = road;
        rider->head = head;
        rider->number = number;
    }
    return (PyObject *)rider;
}

static void free_rider(PyObject *self)
{
    RiderObject *rider = (RiderObject *)self;
    for (Seat *seat = rider->seats, *next; seat != NULL; seat = next) {
        next = seat->next;
        free(seat);
    }
    Py_XDECREF((PyObject *)rider->road);
    freed(self);
}

static PyObject *add(PyObject *self, PyObject *arguments)
{
    RiderObject *rider = (RiderObject *)self;
    int kind;
    Py_ssize_t offset, count, width;
    if (!PyArg_ParseTuple(arguments, "innn:add", &kind, &offset, &count, &width)) {
        return NULL;
    }
    if (!has_room(rider->road, offset, width >= 0 && width <= (Py_ssize_t)sizeof(double) ? count : -1) ||
        (kind == SET_SLOPES && !has_room(rider->road, offset, 2 * count + 1)) ||
        (is_ask(kind) && !has_room(rider->road, offset, 3 * count + QUESTION_HEAD))) {
        return NULL;
    }
    Seat *seat = calloc(1, sizeof *seat);
    if (seat == NULL) {
        return PyErr_NoMemory();
    }
    *seat = (Seat){.rider = rider, .number = rider->operations++, .posted = atomic_load(&rider->road->lane->master.count),
                   .offset = offset, .count = count, .width = width, .next = rider->seats};
    rider->seats = seat;
    rider->slopes = kind == SET_SLOPES ? seat : rider->slopes;
    rider->gives |= is_get(kind);
    return PyLong_FromVoidPtr(seat);
}

static PyObject *begin(PyObject *self, PyObject *arguments)
{
    RiderObject *rider = (RiderObject *)self;
    if (!PyArg_ParseTuple(arguments, "d:begin", &rider->time)) {
        return NULL;
    }
    rider->length = 0.0;
    rider->is_read = 0;
    Py_RETURN_NONE;
}

static PyObject *last_step(PyObject *self, PyObject *nothing)
{
    RiderObject *rider = (RiderObject *)self;
    uint32_t seen;
    int is_past = !rider->is_back && rider->road->lane != NULL && is_done(rider->road->lane, rider->stepped, &seen);
    (void)nothing;
    return Py_BuildValue("(dddd)", rider->time, rider->length, rider->left, rider->time + is_past * rider->length);
}

static PyMethodDef lane_methods[] = {
    {"wait", wait_for_all, METH_VARARGS, "wait(most) -> CAME, CAME_NOT or CLOSED, for all that is posted; at most so many s."},
    {"done", done, METH_NOARGS, "done() -> how many entries the host has come to the end of; 0 once it is closed."},
    {"leave", leave, METH_NOARGS, "leave() -> whether the host could be told to leave the lane."},
    {"failure", failure, METH_NOARGS, "failure() -> what was raised when the last call was waited for, once; else None."},
    {"close", close_lane, METH_NOARGS, "close(): nothing comes this way any more."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot lane_slots[] = {
    {Py_tp_new, make_lane}, {Py_tp_dealloc, free_lane}, {Py_tp_methods, lane_methods},
    {Py_tp_doc, "Lane(memory, offset, line, moment, spin, waits): the master's side. What does not come within a moment is\n"
     "waited for by what is called with the number of the instance, and raises if it will not come; times in s."}, {0, NULL},
};
static PyType_Spec lane_spec = {"railcosim.orchestrator.isolation.lane.Lane", sizeof(LaneObject), 0, Py_TPFLAGS_DEFAULT,
                                lane_slots};

static PyMethodDef rider_methods[] = {
    {"add", add, METH_VARARGS,
     "add(kind, offset, count, width) -> what stands for the instance in calls of an operation, with so many values\n"
     "of so many bytes. Those on a state are added in their order, and the first stands for all."},
    {"begin", begin, METH_VARARGS, "begin(time): it is at a time in s, and what was read before is old."},
    {"last_step", last_step, METH_NOARGS,
     "last_step() -> time and length of the last step, where states were last treated, and where it has got to, in s."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot rider_slots[] = {
    {Py_tp_new, make_rider}, {Py_tp_dealloc, free_rider}, {Py_tp_methods, rider_methods},
    {Py_tp_doc, "Rider(lane, head, number): an instance of the host's, with its part of the memory."}, {0, NULL},
};
static PyType_Spec rider_spec = {"railcosim.orchestrator.isolation.lane.Rider", sizeof(RiderObject), 0,
                                 Py_TPFLAGS_DEFAULT, rider_slots};

int add_riding(PyObject *module)
{
    PyObject *addresses = PyTuple_New(N_FUNCTIONS);
    for (int kind = 0; addresses != NULL && kind < N_FUNCTIONS; kind++) {
        PyTuple_SetItem(addresses, kind, PyLong_FromVoidPtr(lane_functions[kind]));
    }
    lane_type = (PyTypeObject *)PyType_FromSpec(&lane_spec);
    rider_type = (PyTypeObject *)PyType_FromSpec(&rider_spec);
    int is_fine = addresses != NULL && lane_type != NULL && rider_type != NULL &&
                  PyModule_AddObjectRef(module, "FUNCTIONS", addresses) == 0 &&
                  PyModule_AddObjectRef(module, "Lane", (PyObject *)lane_type) == 0 &&
                  PyModule_AddObjectRef(module, "Rider", (PyObject *)rider_type) == 0 &&
                  PyModule_AddIntConstant(module, "CUT_SHORT", CUT_SHORT) == 0 &&
                  PyModule_AddIntConstant(module, "SIZE", (long)sizeof(Lane)) == 0 &&
                  PyModule_AddIntConstant(module, "CAME", CAME) == 0 &&
                  PyModule_AddIntConstant(module, "CLOSED", CLOSED) == 0;
    Py_XDECREF(addresses);
    return is_fine;
}

#endif
