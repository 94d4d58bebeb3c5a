/* What plan.c offers to kernel.c: a plan out of Python's arrays. */

#ifndef PLAN_H
#define PLAN_H

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include "kernel.h"

/* Buffers in the sequence of the arguments; `values` and what follows is written. */
enum {
    OPERATIONS, PARTS, CHANNELS, INSTANCES, ENTRIES, REFERENCES, FORMS, CHANGES, KEPT, VALUES, HISTORY, TABLE, PLACES,
    DISTURBED,
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

/* The sizes of what the buffers hold in one number, by which Python knows a kernel that other sources were compiled to. */
uint32_t layout(void);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
