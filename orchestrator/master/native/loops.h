/* Part of the plan, as Python writes it: what is repeated. */

#ifndef LOOPS_H
#define LOOPS_H

#include <stdint.h>

/* What is repeated: BEGIN; what comes before each but the first round; MARK; a round; END.

   A circle goes round until no value changes; after so many rounds all are again as they were. An iteration goes round
   until what is passed on agrees with what was guessed; after so many rounds it is lost.

   Its numbers stand in the work space: a head, and of a circle all values as they were before it and before this round;
   of an iteration what iteration.py lays out there. */
typedef struct {
    int64_t kind;
    int64_t limit; /* rounds */
    int64_t work;  /* where its numbers begin */
    int64_t begin; /* first of the places of the values that are compared: so many real numbers, */
    int64_t real_count;
    int64_t guess_count; /* of which the first are guessed, */
    int64_t other_count; /* and others */
    int64_t method; /* by which the next guess is made */
    double relaxation;
} Loop;

enum { CIRCLE = 0, ITERATION = 1 };

enum { RELAXED = 0, AITKEN = 1, ANDERSON = 2 };

/* The head of a loop's numbers. */
enum { ROUND, COMPARED, ROUNDS, MOST_ROUNDS, RESIDUAL, HEAD = 8 };

#endif
