/* The step loop, compiled: whole blocks of communication steps from a flat plan, without the interpreter.

   A plan is a list of operations on channels and instances, exactly those of the loop in loop.py, in the same order. A
   channel is some variables of one type of one instance: where their value references stand, and where their values come
   from or go to. All values are real numbers here; integers and truth values are exact in them, and texts have numbers
   (types/texts.c). Python builds the plan,
   and takes over between blocks for progress, flushing and interruption.

   This file is what Python sees of it; plan.c makes a plan of Python's arrays, stepping.c takes the steps, team.c with
   several threads, adaptive.c chooses how long they are; loops.c repeats them, with acceleration.c, algebraic/ solves loops
   within an instant, and courses.c continues inputs. growth.c looks at what came of them. */

#include "growth.h"
#include "plan.h"

#include <stdint.h>
#include <stdlib.h>

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

/* A block without the interpreter, of steps that vary if there is a control; 0 with an exception if its threads cannot be
   had. */
static int take(Plan *plan, const Block *block, Control *control, Outcome *outcome)
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
    if (control != NULL) {
        *outcome = take_adaptive(plan, hands, block, control);
    } else
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
    "run(operations, parts, channels, instances, entries, references, forms, courses, notes, loops, solvers,\n"
    "    parties, terms, passed, points, states, work, stamps, changes, kept, values, history, newest, table, row, places, disturbed, control, texts, every, start,\n"
    "    step, first, count, last) -> (done, written, newest)\n\n"
    "Take up to `count` communication steps from number `first`. Of every `every`-th step and of step number `last` the\n"
    "time and the values that are `kept`, by place, become the next elements of the columns of `table`, one after the\n"
    "other, from element `row` on; the block ends before one for which there is no room, and where an operation\n"
    "fails. `places` say for each thread with which operation its part of the first step begins, and whether it waits\n"
    "because one has failed; then how far the step that was left has got. In `disturbed` an operation after which\n"
    "numbers were rounded in another way, which was put back, has the number of the first step that ended so. With a\n"
    "`control` steps vary: that says how long they may be, and each leads to a row. Values that are texts are numbers of\n"
    "`texts`, or None.");

static PyObject *run(PyObject *module, PyObject *arguments)
{
    Py_buffer b[N_BUFFERS];
    Block block;
    Py_ssize_t newest, row;
    PyObject *result = NULL, *texts;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "y*y*y*y*y*y*y*y*y*y*y*y*y*y*w*w*w*w*y*y*w*w*nw*nw*w*w*OLddLLL:run", &b[OPERATIONS], &b[PARTS], &b[CHANNELS],
                          &b[INSTANCES], &b[ENTRIES], &b[REFERENCES], &b[FORMS], &b[COURSES], &b[NOTES], &b[LOOPS], &b[SOLVERS], &b[PARTIES], &b[TERMS], &b[PASSED],
                          &b[POINTS], &b[STATES], &b[WORK], &b[STAMPS], &b[CHANGES], &b[KEPT], &b[VALUES], &b[HISTORY],
                          &newest, &b[TABLE], &row, &b[PLACES], &b[DISTURBED], &b[CONTROL], &texts, &block.every, &block.start, &block.step,
                          &block.first, &block.count, &block.last)) {
        return NULL;
    }
    Plan plan = {0};
    if (find_texts(texts, &plan.texts) && make_plan(&plan, b, newest) && make_room(&block, &plan, b, row)) {
        if (block.every < 1 || block.first < 0 || block.count < 0 || block.count > INT64_MAX - block.first ||
            newest < 0 || (plan.depth > 0 && plan.newest >= plan.depth)) {
            PyErr_SetString(PyExc_ValueError, "kernel: every, first, count and newest must fit the plan");
        } else {
            Outcome outcome;
            block.places = b[PLACES].buf;
            int is_taken = take(&plan, &block, length(b, CONTROL) > 0 ? b[CONTROL].buf : NULL, &outcome);
            if (is_taken && texts_are_full(plan.texts)) {
                PyErr_NoMemory();
            } else if (is_taken) {
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

PyDoc_STRVAR(look_doc,
    "look(swings, number, values): take the next values of a signal in, whose swings are those of this number.");

static PyObject *look(PyObject *module, PyObject *arguments)
{
    Py_buffer swings, values;
    Py_ssize_t number;
    PyObject *result = NULL;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "w*ny*:look", &swings, &number, &values)) {
        return NULL;
    }
    size_t count = (size_t)swings.len / sizeof(Swing);
    if (number < 0 || (size_t)number >= count || (uintptr_t)swings.buf % sizeof(double) != 0 ||
        (uintptr_t)values.buf % sizeof(double) != 0) {
        PyErr_SetString(PyExc_ValueError, "kernel: there are no such swings, or values that are not aligned");
    } else {
        see_values((Swing *)swings.buf + number, values.buf, (size_t)values.len / sizeof(double));
        Py_INCREF(Py_None);
        result = Py_None;
    }
    PyBuffer_Release(&swings);
    PyBuffer_Release(&values);
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
    {"look", look, METH_VARARGS, look_doc},
    {"texts", make_texts, METH_NOARGS, "texts(): none but the empty one, of the number 0."},
    {"number", number_of_text, METH_VARARGS, "number(texts, text): that of a text in UTF-8, which may be a new one."},
    {"text", text_of_number, METH_VARARGS, "text(texts, number): the text of a number."},
    {"count", count_texts, METH_O, "count(texts): how many there are."},
    {"watch", watch, METH_VARARGS, "watch(address): call FMUs with the guard that stands there."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {
    PyModuleDef_HEAD_INIT, "kernel", "The compiled step loop of the master.", 0, methods, NULL, NULL, NULL, NULL,
};

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
