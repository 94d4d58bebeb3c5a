/* What is noted of the calls of FMUs that are under way, and how to come back from one that does not return. */

#ifndef GUARD_H
#define GUARD_H

#include <stdint.h>

/* One thread's call. All of them stand in memory that another process may share: see notes.py. */
typedef struct {
    uint64_t instance; /* the address that the FMU gave, or a number that stands for one that it has not given yet; 0 */
    uint64_t function; /* its address */
    double time;       /* communication point of the last step that was begun, s */
    int64_t way;       /* how the FMU left instead of returning, as in `Way`, */
    int64_t code;      /* and the exit code that it gave */
    uint64_t rows;     /* that the block of steps under way has written */
    uint64_t spare[2]; /* no two threads write into one line of the cache */
} Note;

/* For the compiled step loop, which finds it by its address. */
typedef struct {
    Note *(*note)(void);
    /* Do some work in which FMUs are called. False where one of them left instead of returning: what was to be done
       after that is not done, and `way` and `code` of this thread's note say how. */
    int (*safely)(void (*work)(void *), void *context);
} Guard;

#endif
