/* The two sides of the lane as Python has them. */

#ifndef RIDING_H
#define RIDING_H

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include "lane.h"

#if HAS_LANES

/* Hidden, so that nothing of a name like one of theirs elsewhere in the process can stand in their place. */
#pragma GCC visibility push(hidden)

/* What a call returns that is not waited for any more, of which Python knows why: a status that the standard has not. */
enum { SILENT = 1000 };
enum { CAME, CAME_NOT, CLOSED };

typedef struct LaneObject {
    PyObject_HEAD
    Py_buffer memory;
    Lane *lane; /* NULL once it is closed */
    int line;   /* the socket, whose end tells of that of the process */
    int64_t moment; /* ns that a call is waited for before Python is asked */
    int (*goes_on)(struct LaneObject *road, uint32_t number); /* whether Python has waited for what an instance was asked */
    PyObject *waits;   /* what does that; NULL once it is closed */
    PyObject *failure; /* what that raised, or NULL */
    Spin spin;
} LaneObject;

typedef struct {
    PyObject_HEAD
    LaneObject *road;
    Py_ssize_t head; /* of its part of the memory */
    uint32_t number;
    uint32_t operations;
    uint32_t wanted; /* how many entries must be done for what is read to be there */
    int is_read;     /* whether they read it: nothing was set since */
    int gives;       /* whether there is anything to read */
    double time;     /* of the last step, s; or when it boarded, with no length */
    double length;
    uint32_t stepped; /* how many entries must be done for that to be */
    int is_back;      /* whether a state was restored since */
    double left;     /* where it was when a state was last saved, restored or given back, s */
    struct Seat *seats;
    struct Seat *slopes; /* of the operation that takes derivatives of inputs */
} RiderObject;

/* An operation, in the place of an FMU's instance; of those that save a state, restore it and give it back, the first. */
typedef struct Seat {
    RiderObject *rider;
    uint32_t number;
    uint32_t posted;   /* how many entries must be done for the last of this to be done */
    Py_ssize_t offset; /* of its values in the memory, */
    Py_ssize_t count;  /* how many there are, or how many derivatives there is room for, */
    Py_ssize_t width;  /* and how many bytes each of them has */
    struct Seat *next;
} Seat;

/* Functions in the place of those of an FMU, by kind of operation; and one that waits until a state is restored. */
enum { RESTORE_NOW = N_KINDS, N_FUNCTIONS };
extern void *const lane_functions[N_FUNCTIONS];

/* Whether so many entries are done, and how many are. */
int is_done(const Lane *lane, uint32_t ticket, uint32_t *seen);

/* Wait for so many entries to be done, for so many ns at most. */
int await(LaneObject *road, uint32_t ticket, int64_t most);

/* Post an entry; 0 if there is no room for it within a moment. */
int post(LaneObject *road, Entry entry, int wakes, uint32_t *ticket);

/* Where a lane stands in memory; NULL with an exception if it does not fit there. */
Lane *lane_in(const Py_buffer *memory, Py_ssize_t offset);

/* The types of the master's side, and its functions for the compiled step loop, are put into the module; 0 if not. */
int add_riding(PyObject *module);

/* serve(memory, offset, instances, spin): the host's side. */
PyObject *serve(PyObject *module, PyObject *arguments);

#pragma GCC visibility pop

#endif
#endif
