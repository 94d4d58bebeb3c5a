/* Part of the plan, as Python writes it: what solves algebraic loops. */

#ifndef SOLVER_H
#define SOLVER_H

#include <stdint.h>

/* What solves algebraic loops at a communication point. The operations behind its own are done when it wants them: first
   those that bring up to date what leads into the loops; from `evaluating` on those that give the parties' inputs the values
   that are tried, and read what that leads to; from `deriving` on those that stand for calls of `Party.function`.

   Its numbers stand in the work space: a head that solver.py reads, and room. */
typedef struct {
    int64_t work;  /* where its numbers begin */
    int64_t begin; /* first of the places of the unknown values: so many real numbers, */
    int64_t real_count;
    int64_t other_count; /* and others, */
    int64_t attempts; /* which may change so often */
    int64_t party; /* the first, */
    int64_t party_count;
    int64_t evaluating, deriving, end; /* operations */
} Solver;

enum { SOLVER_HEAD = 3 };

/* An instance that gives or takes unknown values. Its terms stand one after the other: inputs, unknown values that it
   gives, and what its function is asked for, which may be whole arrays of these. */
typedef struct {
    uint64_t function; /* address of fmi2GetDirectionalDerivative, or of fmi3GetDirectionalDerivative; 0: there is none */
    uint64_t component;
    int64_t counts_values; /* as FMI 3.0 does */
    int64_t writing, written; /* operations that set its inputs, from one to before the other, */
    int64_t reading, read;    /* and that read its outputs */
    int64_t ask;
    int64_t term; /* the first */
    int64_t known_count, row_count, whole_count;
} Party;

typedef struct {
    int64_t of; /* of an input its entry, of an unknown value which of them it is */
    int64_t reference; /* value reference */
    int64_t count; /* elements of the array that it belongs to; 1 */
    int64_t element; /* which of them it is; of an unknown value, of all that are asked for */
} Term;

#endif
