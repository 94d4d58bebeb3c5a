/* What is noted of the calls of FMUs that are under way, and how to come back from one that does not return. */

#ifndef GUARD_H
#define GUARD_H

#include <stdint.h>

/* One thread's call. All of them stand in memory that another process may share: see notes.py. */
typedef struct {
    uint64_t instance; /* the address that the FMU gave, or a number that stands for one that it has not given yet; 0 */
    uint64_t function; /* its address */
    double time;       /* communication point of the last step that was begun, s */
    uint64_t rows;     /* that the block of steps under way has written */
    uint64_t spare[4]; /* no two threads write into one line of the cache */
} Note;

/* For the compiled step loop, which finds it by its address. */
typedef struct {
    /* That of this thread: a thread of a team has one by its number, from 1. */
    Note *(*note)(int number);
    /* Do some work in which FMUs are called. Where one of them leaves instead of returning, what was to be done after that
       is not done: how it left, as in `Way`, and the exit code that it gave; else 0. */
    int (*safely)(void (*work)(void *), void *context, int *code);
} Guard;

#endif
