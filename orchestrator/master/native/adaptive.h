/* What adaptive.c and Python share: steps as long as a tolerance lets them be (adaptive.py). */

#ifndef ADAPTIVE_H
#define ADAPTIVE_H

#include "kernel.h"

/* Parts of the plan, in the order in which `Adaptive.sections` has them. */
enum {
    SWEEP,   /* a step with the inputs of its begin, which are noted, */
    SETTLE,  /* and what is brought up to date at its end; */
    ENDED,   /* a step with the present values as those of its end */
    SHOWN,   /* a step of those whose inputs are noted, with these, */
    READ,    /* and their outputs; */
    GIVEN,   /* the present values as those of the end, */
    GO,      /* and a step with them */
    KEEP, BACK, FORGET_BEGIN,       /* the states at the begin of a step, */
    KEEP_END, BACK_END, FORGET_END, /* and at its end */
    PROGRAMS
};

/* What steps are wanted, and how they went. */
typedef struct {
    double start, step, last, late; /* of the run: its begin, the longest step, its end, how late an event may be */
    double end, due;                /* of this block, and the next event */
    double every;                   /* a row is due after so many of the longest steps; 0: each time */
    double shortest;                /* step */
    double exponent, of_halves, of_same, of_end; /* of the error, by the order of the coupling */
    int64_t value_count, point_count; /* of values and points to come back to; behind them are those noted */
    int64_t plain_count, shown_count; /* places of the values whose error counts are the first of those passed */
    int64_t work;                     /* where the tolerances of these begin, and then room */
    double time;   /* that has been reached, */
    double length; /* and what the next step should be; 0: as long as may be */
    double least, most;               /* of the steps that were taken */
    int64_t accepted, rejected, in_a_row;
    int64_t jump;                     /* the place of the value that made one in the last step, or -1 */
    double called_at, called_for;     /* begin and length of the last steps that FMUs were asked for */
} Control;

#ifdef __GNUC__
#pragma GCC visibility push(hidden)
#endif

/* How many numbers that needs in the work space. */
size_t work_of_control(const Plan *plan, const Control *control);

/* Take steps up to the block's end, an event, a jump, or the last row that there is room for. What fails is left as it is:
   Python comes back to the begin of that step, and takes it. */
Outcome take_adaptive(Plan *plan, Hand *hand, const Block *block, Control *control);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
