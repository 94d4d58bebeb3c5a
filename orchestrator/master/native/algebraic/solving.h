/* What solving.c offers: algebraic loops are solved. */

#ifndef SOLVING_H
#define SOLVING_H

#include "../kernel.h"

#ifdef __GNUC__
#pragma GCC visibility push(hidden)
#endif

/* NULL, or the call that failed; the solver's own where there is no solution. */
const Call *solve(Hand *hand, const Group *group, const Advance *it, int *status);

/* How many numbers a solver needs in the work space. */
size_t work_of_solver(const Plan *plan, const Solver *of);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
