/* Calls of FMUs' functions from Python, noted while they last; an FMU that ends the process instead of returning is an
   exception.

   What it calls for that (exit and its kin) leads to functions of ours, by its own table of addresses: see hooks.c. From
   there the call is left by a long jump, if it was begun by `safely`; otherwise the process ends here, never with code 0,
   after what Python has to say (`set_will`). */

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include "hooks.h"

#include <setjmp.h>
#include <stdatomic.h>
#include <string.h>

#if defined(__GNUC__)
#define THREAD_LOCAL __thread
#else
#define THREAD_LOCAL __declspec(thread)
#endif

typedef struct Landing {
    jmp_buf where;
    struct Landing *outer;
    Way way;
    int code;
} Landing;

static THREAD_LOCAL Landing *landing;
static THREAD_LOCAL Note *mine;
static THREAD_LOCAL int runs; /* that this thread is in */
static Note nowhere;
static Note *notes = &nowhere;
static size_t note_count = 1;
static atomic_size_t given;
static PyObject *will, *gone;

Note *guard_note(int number)
{
    if (mine == NULL) { /* the first half is for threads of their own, the second for those of teams */
        size_t half = note_count / 2;
        mine = half == 0    ? notes
               : number > 0 ? notes + half + (size_t)(number - 1) % half
                            : notes + atomic_fetch_add(&given, 1) % half;
    }
    return mine;
}

int guard_safely(void (*work)(void *), void *context, int *code)
{
    Landing here;
    here.outer = landing;
    if (setjmp(here.where) == 0) {
        landing = &here;
        work(context);
        landing = here.outer;
        return RETURNED;
    }
    int way = landing->way;
    *code = landing->code;
    landing = landing->outer;
    return way;
}

int guard_is_in_run(void)
{
    return runs > 0;
}

void guard_leave(Way way, int code)
{
    if (landing != NULL) {
        landing->way = way;
        landing->code = code;
        longjmp(landing->where, 1);
    }
}

void *guard_place_in_python(void)
{
    return (void *)&PyLong_Type; /* a static object: functions may be found elsewhere first */
}

int guard_say(Way way, int code)
{
    if (will == NULL || !Py_IsInitialized()) {
        return 0;
    }
    PyGILState_STATE state = PyGILState_Ensure();
    Note *note = guard_note(0);
    PyObject *said = PyObject_CallFunction(will, "KKdii", (unsigned long long)note->instance,
                                           (unsigned long long)note->function, note->time, (int)way, code);
    if (said == NULL) {
        PyErr_Print();
    }
    Py_XDECREF(said);
    PyGILState_Release(state);
    return 1;
}

/* ------------------------------------------------------------------------------------------------ calls from Python */

typedef struct {
    PyObject_HEAD
    PyObject *function; /* of ctypes, which lets others use the interpreter meanwhile */
    uint64_t address;
    int is_step;
} Call;

typedef struct {
    PyObject *function, *arguments, *result;
} Work;

static void do_work(void *context)
{
    Work *work = context;
    work->result = PyObject_CallObject(work->function, work->arguments);
}

static PyObject *raise_gone(const Note *note, int way, int code)
{
    PyObject *error = gone == NULL ? NULL
                                   : PyObject_CallFunction(gone, "KKii", (unsigned long long)note->instance,
                                                           (unsigned long long)note->function, way, code);
    if (error != NULL) {
        PyErr_SetObject((PyObject *)Py_TYPE(error), error);
        Py_DECREF(error);
    } else if (!PyErr_Occurred()) {
        PyErr_SetString(PyExc_RuntimeError, "a function of a library has ended the process");
    }
    return NULL;
}

static PyObject *call(PyObject *self, PyObject *arguments, PyObject *names)
{
    Call *it = (Call *)self;
    (void)names;
    Note *note = guard_note(0);
    uint64_t instance = note->instance, function = note->function;
    PyObject *first = PyTuple_Size(arguments) > 0 ? PyTuple_GetItem(arguments, 0) : NULL;
    if (first != NULL && PyLong_Check(first)) {
        note->instance = (uint64_t)(uintptr_t)PyLong_AsVoidPtr(first);
    }
    if (it->is_step) {
        note->time = PyFloat_AsDouble(PyTuple_GetItem(arguments, 1));
        PyErr_Clear();
    }
    note->function = it->address;
    Work work = {it->function, arguments, NULL};
    PyThreadState *state = PyThreadState_Get();
    int code = 0, way = guard_safely(do_work, &work, &code);
    if (way != RETURNED) {
        PyEval_RestoreThread(state);
        raise_gone(note, way, code);
    }
    note->instance = instance;
    note->function = function;
    return work.result;
}

static PyObject *make_call(PyTypeObject *type, PyObject *arguments, PyObject *names)
{
    PyObject *function;
    unsigned long long address;
    int is_step;
    (void)names;
    if (!PyArg_ParseTuple(arguments, "OKp:Call", &function, &address, &is_step)) {
        return NULL;
    }
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    Call *it = (Call *)allocate(type, 0);
    if (it != NULL) {
        Py_INCREF(function);
        it->function = function;
        it->address = address;
        it->is_step = is_step;
    }
    return (PyObject *)it;
}

static void free_call(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    Py_XDECREF(((Call *)self)->function);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

static PyType_Slot call_slots[] = {
    {Py_tp_new, make_call}, {Py_tp_dealloc, free_call}, {Py_tp_call, call},
    {Py_tp_doc, "Call(function, address, is_step): a function of an FMU's library, as ctypes has it, guarded."}, {0, NULL},
};
static PyType_Spec call_spec = {"railcosim.orchestrator.fmi.guard.calls.Call", sizeof(Call), 0, Py_TPFLAGS_DEFAULT, call_slots};

/* --------------------------------------------------------------------------------------------------- for the binding */

static PyObject *attach(PyObject *module, PyObject *arguments)
{
    static Py_buffer buffer; /* never given back: calls may be under way at any time */
    size_t head;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "w*nn:attach", &buffer, &head, &note_count)) {
        return NULL;
    }
    notes = (Note *)((char *)buffer.buf + head);
    mine = NULL;
    Py_RETURN_NONE;
}

static PyObject *set_will(PyObject *module, PyObject *arguments)
{
    (void)module;
    PyObject *first, *second;
    if (!PyArg_ParseTuple(arguments, "OO:set_will", &first, &second)) {
        return NULL;
    }
    Py_INCREF(first);
    Py_INCREF(second);
    gone = first;
    will = second;
    Py_RETURN_NONE;
}

static PyObject *begin(PyObject *module, PyObject *arguments)
{
    unsigned long long instance, function;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "KK:begin", &instance, &function)) {
        return NULL;
    }
    Note *note = guard_note(0);
    PyObject *before = Py_BuildValue("(KK)", (unsigned long long)note->instance, (unsigned long long)note->function);
    note->instance = instance;
    note->function = function;
    return before;
}

static PyObject *enter_run(PyObject *module, PyObject *nothing)
{
    (void)module;
    (void)nothing;
    runs++;
    guard_note(0)->time = -HUGE_VAL;
    Py_RETURN_NONE;
}

static PyObject *leave_run(PyObject *module, PyObject *nothing)
{
    (void)module;
    (void)nothing;
    runs--;
    Py_RETURN_NONE;
}

static PyObject *renew(PyObject *module, PyObject *nothing)
{
    (void)module;
    (void)nothing;
    runs = 0;
    landing = NULL;
    hooks_belong_here();
    Py_RETURN_NONE;
}

static PyObject *watch(PyObject *module, PyObject *arguments)
{
    Py_ssize_t count;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "n:watch", &count)) {
        return NULL;
    }
    return PyLong_FromSsize_t(hooks_watch((int)count));
}

static PyObject *own_note(PyObject *module, PyObject *nothing)
{
    (void)module;
    (void)nothing;
    return PyLong_FromSsize_t(guard_note(0) - notes);
}

static PyMethodDef methods[] = {
    {"attach", attach, METH_VARARGS, "attach(memory, head, count): where the notes stand."},
    {"set_will", set_will, METH_VARARGS, "set_will(gone, will): what makes the exception, and what speaks last."},
    {"begin", begin, METH_VARARGS, "begin(instance, function) -> what stood in this thread's note before."},
    {"enter_run", enter_run, METH_NOARGS, "This thread begins a run."},
    {"leave_run", leave_run, METH_NOARGS, "It has ended."},
    {"renew", renew, METH_NOARGS, "This process is a child that goes its own way."},
    {"watch", watch, METH_VARARGS, "watch(count) -> how many libraries there are; all but the first `count` are watched."},
    {"own_note", own_note, METH_NOARGS, "The number of this thread's note."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {
    PyModuleDef_HEAD_INIT, "calls", "Guarded calls of FMUs' functions.", -1, methods, NULL, NULL, NULL, NULL,
};

static const Guard guard = {guard_note, guard_safely};

PyMODINIT_FUNC PyInit_calls(void)
{
    PyObject *made = PyModule_Create(&module), *type = PyType_FromSpec(&call_spec);
    PyObject *address = PyLong_FromVoidPtr((void *)&guard);
    if (made == NULL || type == NULL || address == NULL || PyModule_AddObjectRef(made, "Call", type) < 0 ||
        PyModule_AddObjectRef(made, "GUARD", address) < 0) {
        Py_CLEAR(made);
    }
    Py_XDECREF(type);
    Py_XDECREF(address);
    hooks_begin();
    return made;
}
