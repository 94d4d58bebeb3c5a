/* Signals that may be growing, told from all others as they come: the others need no second look.

   What is kept of a signal is how large it has been, and how many of its last swings, from one turning point to the next,
   were each larger than the one before. */

#include "growth.h"

#include <math.h>

/* Take a value in that differs from the last one. */
static void turn(Swing *swing, double value)
{
    int64_t way = value > swing->last ? 1 : -1;
    if (way == -swing->way) { /* the last value was an extreme */
        double size = fabs(swing->last - swing->from);
        swing->rises = size > swing->size ? swing->rises + 1 : 0;
        swing->size = size;
        swing->from = swing->last;
    }
    swing->way = way;
    swing->last = value;
}

void see_values(Swing *swing, const double *values, size_t count)
{
    Swing now = *swing;
    for (size_t k = 0; k < count; k++) {
        double value = values[k], size = fabs(value);
        if (!isfinite(value)) {
            continue;
        }
        now.peak = size > now.peak ? size : now.peak;
        if (!now.is_begun) {
            now.is_begun = 1;
            now.from = now.last = value;
        } else if (value != now.last) {
            turn(&now, value);
        }
    }
    *swing = now;
}
