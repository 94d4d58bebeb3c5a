/* What is repeated: circles of feed-through, and iterations from saved states, as `Refresher` and `Iterative` have them. */

#include "kernel.h"

#include <math.h>
#include <string.h>

typedef int (*Save)(void *component, void **handle);
typedef int (*Restore)(void *component, void *handle);

/* How much farther apart than at first values are that nothing brings together (`_HOPELESS` in iteration.py). */
static const double hopeless = 1e12;

const Call *treat_states(const Hand *hand, const Group *group, int *status)
{
    for (const Call *call = group->begin; call < group->end; call++) {
        State *state = call->state;
        void *handle = group->kind == SAVE ? NULL : (void *)(uintptr_t)state->handle;
        state->handle = group->kind == FORGET ? 0 : state->handle; /* whatever comes of it */
        note_call(hand, call);
        if (group->kind == RESTORE) {
            *status = ((Restore)group->function)(call->component, handle);
        } else {
            *status = ((Save)group->function)(call->component, &handle); /* and so is a state given back */
        }
        if (is_failure(*status)) {
            return call;
        }
        state->handle = group->kind == SAVE ? (uint64_t)(uintptr_t)handle : state->handle;
    }
    return group->end;
}

/* Where the numbers of an iteration stand, as iteration.py lays them out. */
typedef struct {
    double *relative, *absolute; /* tolerances */
    double *guess, *reached, *scale, *error; /* of the real values; the scale is that of the first round */
    double *others, *differ;
    double *sizes; /* by round, how far apart values are at most, in units of that scale */
    double *rest;  /* for the method that makes guesses */
} Numbers;

static Numbers numbers_of(const Plan *plan, const Loop *loop)
{
    double *at = plan->work + loop->work + HEAD;
    int64_t n = loop->real_count, m = loop->other_count;
    return (Numbers){at,         at + n,     at + 2 * n,         at + 3 * n,         at + 4 * n,
                     at + 5 * n, at + 6 * n, at + 6 * n + m, at + 6 * n + 2 * m, at + 6 * n + 2 * m + loop->limit};
}

size_t work_of(const Plan *plan, const Loop *loop)
{
    if (loop->kind == CIRCLE) {
        return HEAD + 2 * plan->value_count;
    }
    size_t own = (size_t)(6 * loop->real_count + 2 * loop->other_count + loop->limit);
    return HEAD + own + work_of_acceleration(loop->method, (size_t)loop->guess_count);
}

void begin_loop(const Plan *plan, const Loop *loop)
{
    double *head = plan->work + loop->work;
    head[ROUND] = head[COMPARED] = 0.0;
    if (loop->kind == CIRCLE) {
        memcpy(head + HEAD, plan->values, plan->value_count * sizeof(double));
    }
}

void begin_round(const Plan *plan, const Loop *loop)
{
    double *head = plan->work + loop->work;
    head[ROUND] += 1.0;
    if (loop->kind == CIRCLE) {
        memcpy(head + HEAD + plan->value_count, plan->values, plan->value_count * sizeof(double));
        return;
    }
    Numbers of = numbers_of(plan, loop);
    const int64_t *places = plan->passed + loop->begin;
    for (int64_t k = 0; k < loop->real_count; k++) {
        of.guess[k] = plan->values[places[k]];
    }
    for (int64_t k = 0; k < loop->other_count; k++) {
        of.others[k] = plan->values[places[loop->real_count + k]];
    }
}

int is_same(const Plan *plan, int64_t place, double a, double b)
{
    int64_t form = plan->forms == NULL ? NUMBER : plan->forms[place];
    if (form == SIGNED_BITS || form == UNSIGNED_BITS) { /* which may look like no number, or like another 0 */
        return memcmp(&a, &b, sizeof a) == 0;
    }
    return a == b || (isnan(a) && isnan(b));
}

static Way_on end_circle(const Plan *plan, const Loop *loop)
{
    double *head = plan->work + loop->work, *before = head + HEAD, *last = before + plan->value_count;
    int has_changed = 0;
    for (size_t k = 0; k < plan->value_count; k++) {
        has_changed |= !is_same(plan, (int64_t)k, plan->values[k], last[k]);
    }
    if (!has_changed) {
        return ON;
    }
    if (head[ROUND] < (double)loop->limit) {
        return AGAIN;
    }
    memcpy(plan->values, before, plan->value_count * sizeof(double));
    return ON;
}

static double larger(double a, double b)
{
    return (a > b) | (isnan(a) != 0) ? a : b;
}

/* What the round led to beside what was guessed; the largest error in units of the tolerance, and whether all agree. */
static int compare(const Plan *plan, const Loop *loop, Numbers of, double *head, double *worst)
{
    const int64_t *places = plan->passed + loop->begin;
    double size = 0.0, error = 0.0;
    int agree = 1;
    for (int64_t k = 0; k < loop->real_count; k++) {
        double value = plan->values[places[k]], distance = fabs(value - of.guess[k]);
        double scale = of.absolute[k] + of.relative[k] * larger(fabs(of.guess[k]), fabs(value)) + 1e-300;
        of.reached[k] = value;
        of.scale[k] = head[ROUND] == 1.0 ? scale : of.scale[k];
        of.error[k] = distance / scale;
        error = larger(of.error[k], error);
        size = larger(distance / of.scale[k], size);
        agree &= !(of.error[k] > 1.0);
    }
    for (int64_t k = 0; k < loop->other_count; k++) {
        int64_t place = places[loop->real_count + k];
        of.differ[k] = !is_same(plan, place, of.others[k], plan->values[place]);
        agree &= of.differ[k] == 0.0;
    }
    of.sizes[(int64_t)head[COMPARED]] = size;
    head[COMPARED] += 1.0;
    *worst = error;
    return agree;
}

static Way_on end_iteration(const Plan *plan, const Loop *loop)
{
    double *head = plan->work + loop->work, worst = 0.0;
    Numbers of = numbers_of(plan, loop);
    const int64_t *places = plan->passed + loop->begin;
    size_t count = (size_t)loop->guess_count;
    if (compare(plan, loop, of, head, &worst)) {
        head[ROUNDS] += head[ROUND];
        head[MOST_ROUNDS] = larger(head[MOST_ROUNDS], head[ROUND]);
        head[RESIDUAL] = larger(head[RESIDUAL], worst);
        head[COMPARED] = 0.0;
        return ON;
    }
    double *guess = of.rest, *reached = of.rest + count;
    for (size_t k = 0; k < count; k++) {
        guess[k] = of.guess[k] / of.scale[k];
        reached[k] = of.reached[k] / of.scale[k];
    }
    int is_finite = accelerate(loop->method, loop->relaxation, count, head[ROUND] == 1.0, guess, reached, reached + count);
    double size = of.sizes[(int64_t)head[ROUND] - 1], first = of.sizes[0];
    for (size_t k = 0; k < count; k++) {
        guess[k] *= of.scale[k];
        is_finite &= isfinite(guess[k]) != 0;
    }
    if (!is_finite || size > hopeless * (first > 1.0 ? first : 1.0) || head[ROUND] >= (double)loop->limit) {
        return LOST;
    }
    for (size_t k = 0; k < count; k++) {
        plan->values[places[k]] = guess[k];
    }
    return AGAIN;
}

Way_on end_round(const Plan *plan, const Loop *loop)
{
    return loop->kind == CIRCLE ? end_circle(plan, loop) : end_iteration(plan, loop);
}
