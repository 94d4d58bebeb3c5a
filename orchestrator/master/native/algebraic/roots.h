/* What roots.c offers: roots of systems of equations. */

#ifndef ROOTS_H
#define ROOTS_H

#include <stddef.h>

/* A system of equations. Each function returns 0 where it failed. */
typedef struct {
    void *context;
    size_t count;
    int (*evaluate)(void *context, const double *values, double *mismatch);
    int (*derive)(void *context, const double *values, double *slopes); /* where it was evaluated last; row by row */
    double *room;
} Equations;

#ifdef __GNUC__
#pragma GCC visibility push(hidden)
#endif

extern const double settled, solved;

/* How many numbers of room a system of so many unknowns needs. */
size_t room_of_root(size_t count);

/* The largest difference, relative to its value's size above 1; infinite where one is no number. */
double relative(const double *difference, const double *values, size_t count);

/* From values, and the mismatch there, to those where nothing is left of it; how much is left, and whether they are those
   at which it was evaluated last, with nothing derived since. 0 where a function failed. */
int find_root(const Equations *of, double *here, double *mismatch, double *left, int *is_shown);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
