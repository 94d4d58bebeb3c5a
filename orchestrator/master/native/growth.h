/* What growth.c keeps of a signal, as Python has it too, and offers to kernel.c. */

#ifndef GROWTH_H
#define GROWTH_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    double peak; /* the largest magnitude */
    double last; /* value */
    double from; /* the last extreme, or the first value */
    double size; /* of the last swing that came to its end */
    int64_t way; /* the values go: 1, -1, or 0 at first */
    int64_t rises; /* how many of the last swings were larger than the one before; the first is larger than nothing */
    int64_t is_begun;
} Swing;

#ifdef __GNUC__
#pragma GCC visibility push(hidden)
#endif

/* Take the next values of a signal in; those that are not finite are left out. */
void see_values(Swing *swing, const double *values, size_t count);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
