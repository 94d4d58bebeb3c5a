/* What plan.c offers to kernel.c: a plan out of Python's arrays. */

#ifndef PLAN_H
#define PLAN_H

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include "adaptive.h"
#include "kernel.h"

/* Buffers in the sequence of the arguments; `points` and what follows is written, but for `changes` and `kept`. */
enum {
    OPERATIONS, PARTS, CHANNELS, INSTANCES, ENTRIES, REFERENCES, FORMS, COURSES, NOTES, LOOPS, SOLVERS, PARTIES, TERMS, PASSED, POINTS, STATES, WORK, STAMPS,
    CHANGES, KEPT, VALUES, HISTORY, TABLE, PLACES, DISTURBED, CONTROL,
    N_BUFFERS
};

#ifdef __GNUC__
#pragma GCC visibility push(hidden)
#endif

/* How many elements a buffer has. */
size_t length(const Py_buffer *buffers, int which);

/* 0 with an exception if the plan is not sound; `free_plan` is called all the same. */
int make_plan(Plan *plan, const Py_buffer *buffers, Py_ssize_t newest);

/* Where a block's rows go, of which `row` is the first; 0 with an exception if they cannot. */
int make_room(Block *block, const Plan *plan, const Py_buffer *buffers, Py_ssize_t row);

void free_plan(Plan *plan);

/* Whether so many elements, which are not less than none, stand from one on. */
static inline int is_within(int64_t begin, int64_t count, size_t length)
{
    return begin >= 0 && (uint64_t)begin <= length && (uint64_t)count <= length - (uint64_t)begin;
}

/* Whether an entry reads what is there. */
int is_entry(const Plan *plan, const Entry *entry, size_t change_count);

/* What an operation on a channel, a course, a state, a loop or a solver is (resolving.c, algebraic/checking.c); 0 if it points outside the plan. */
int resolve_channel(const Plan *plan, const Py_buffer *buffers, const Operation *operation, int64_t index, Group *group,
                    Call *call);
int resolve_course(Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call);
int resolve_note(const Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call);
int resolve_state(const Py_buffer *buffers, const Operation *operation, Group *group, Call *call);
int resolve_loop(Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call);

int resolve_solver(Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call);
int resolve_ask(const Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call);

/* Whether each loop's operations come one after the other. */
int are_loops_closed(const Plan *plan, const Py_buffer *buffers);

/* The texts that an object of Python's stands for, NULL for None; 0 with an exception if it is none. */
int find_texts(PyObject *object, Texts **texts);

/* Functions of the module about them: see the docstrings. */
PyObject *make_texts(PyObject *module, PyObject *nothing);
PyObject *number_of_text(PyObject *module, PyObject *arguments);
PyObject *text_of_number(PyObject *module, PyObject *arguments);
PyObject *count_texts(PyObject *module, PyObject *capsule);

/* The sizes of what the buffers hold in one number, by which Python knows a kernel that other sources were compiled to. */
uint32_t layout(void);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
