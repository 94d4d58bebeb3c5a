/* Algebraic loops at a communication point: `LoopSolver` in C, with every operation in the same sequence. */

#include "solving.h"
#include "roots.h"

#include <math.h>
#include <string.h>

typedef int (*Ask)(void *component, const unsigned *unknowns, size_t count, const unsigned *knowns, size_t known_count,
                   const double *seeds, double *slopes);
typedef int (*Ask3)(void *component, const unsigned *unknowns, size_t count, const unsigned *knowns, size_t known_count,
                    const double *seeds, size_t seed_count, double *slopes, size_t slope_count);

static const double difference = 1e-7; /* `_DIFFERENCE` in solver.py, and what follows there */
static const int begins = 4;
enum { DISCARD = 2, ERROR = 3 };
enum { SOLUTIONS, WORST, LEFT };

/* A solution that is under way. */
typedef struct {
    Hand *hand;
    const Solver *of;
    const Advance *it;
    const Call *failed;
    int status;
    double *head, *here, *mismatch, *reached; /* `reached` is what the values lead to that were tried last */
    double *fixed, *kept; /* what is no real number; all values */
    Equations equations;
} Solving;

size_t work_of_solver(const Plan *plan, const Solver *of)
{
    size_t n = (size_t)of->real_count;
    return SOLVER_HEAD + 3 * n + room_of_root(n) + (size_t)of->other_count + plan->value_count;
}

static const int64_t *places_of(const Solving *s)
{
    return s->hand->plan->passed + s->of->begin;
}

/* Operations from one to another; 0 where one failed. */
static int take(Solving *s, int64_t from, int64_t to)
{
    s->failed = take_calls(s->hand, from, to, s->it, &s->status);
    return s->failed == NULL;
}

static void place(const Solving *s, const double *candidate)
{
    double *values = s->hand->plan->values;
    const int64_t *places = places_of(s);
    for (int64_t k = 0; k < s->of->real_count; k++) {
        values[places[k]] = candidate[k];
    }
    for (int64_t k = 0; k < s->of->other_count; k++) {
        values[places[s->of->real_count + k]] = s->fixed[k];
    }
}

static int evaluate(void *context, const double *candidate, double *mismatch)
{
    Solving *s = context;
    place(s, candidate);
    if (!take(s, s->of->evaluating, s->of->deriving)) {
        return 0;
    }
    for (int64_t k = 0; k < s->of->real_count; k++) {
        s->reached[k] = s->hand->plan->values[places_of(s)[k]];
        mismatch[k] = s->reached[k] - candidate[k];
    }
    return 1;
}

/* By how much an input moves with the value at a place; whether it is given that. */
static int is_moved(const Plan *plan, const Term *known, int64_t place, double *by)
{
    const Entry *entry = &plan->entries[known->of];
    const Change *change = entry->change < 0 ? NULL : &plan->changes[entry->change];
    *by = entry->scale * (change != NULL && change->active ? change->scale : 1.0);
    return entry->place == place && entry->age < 0;
}

static int moves(const Plan *plan, const Party *party, int64_t place)
{
    double by;
    for (int64_t k = 0; k < party->known_count; k++) {
        if (is_moved(plan, &plan->terms[party->term + k], place, &by)) {
            return 1;
        }
    }
    return 0;
}

/* What an FMU says of its own slopes in the direction of an unknown; 0 where it says nothing, -1 where it failed. */
static int ask(Solving *s, const Party *party, size_t column, double *slopes)
{
    const Plan *plan = s->hand->plan;
    const Term *knowns = plan->terms + party->term, *rows = knowns + party->known_count, *whole = rows + party->row_count;
    unsigned *unknowns = (unsigned *)s->hand->integers, *inputs = unknowns + party->whole_count;
    int *offsets = s->hand->integers + party->whole_count + party->known_count;
    double *answers = s->hand->reals, by;
    size_t answer_count = 0, input_count = 0, seed_count = 0;
    if (party->function == 0) {
        return 0;
    }
    for (int64_t k = 0; k < party->whole_count; k++) {
        unknowns[k] = (unsigned)whole[k].reference;
        answer_count += (size_t)whole[k].count;
    }
    double *seeds = answers + answer_count;
    for (int64_t k = 0; k < party->known_count; k++) {
        const Term *known = &knowns[k];
        if (!is_moved(plan, known, places_of(s)[column], &by)) {
            continue;
        }
        size_t i = 0; /* others of its array may be there */
        while (i < input_count && (known->count == 1 || inputs[i] != (unsigned)known->reference)) {
            i++;
        }
        if (i == input_count) {
            inputs[input_count] = (unsigned)known->reference;
            offsets[input_count++] = (int)seed_count;
            memset(seeds + seed_count, 0, (size_t)known->count * sizeof(double));
            seed_count += (size_t)known->count;
        }
        seeds[offsets[i] + known->element] = by;
    }
    const Call *call = plan->calls + party->ask;
    s->status = 0;
    s->hand->group = &plan->groups[plan->group_of[party->ask]];
    s->hand->note->function = (uintptr_t)party->function;
    note_call(s->hand, call);
    size_t count = (size_t)party->whole_count;
    s->status = party->counts_values
                    ? ((Ask3)(uintptr_t)party->function)(call->component, unknowns, count, inputs, input_count, seeds, seed_count, answers, answer_count)
                    : ((Ask)(uintptr_t)party->function)(call->component, unknowns, count, inputs, input_count, seeds, answers);
    look_at_floats(s->hand, s->it);
    if (s->status == DISCARD || s->status == ERROR) { /* it promised too much; differences do as well */
        return 0;
    }
    if (is_failure(s->status)) {
        s->failed = call;
        return -1;
    }
    for (int64_t k = 0; k < party->row_count; k++) {
        slopes[(size_t)rows[k].of * s->equations.count + column] += answers[rows[k].element];
    }
    return 1;
}

/* The same by values a little apart; 0 where it failed. */
static int differ(Solving *s, const Party *party, size_t column, double *slopes)
{
    const Plan *plan = s->hand->plan;
    const Term *rows = plan->terms + party->term + party->known_count;
    double *value = &plan->values[places_of(s)[column]];
    memcpy(s->kept, plan->values, plan->value_count * sizeof(double));
    double before = *value, size = fabs(before), moved = before + difference * (size > 1.0 ? size : 1.0);
    *value = moved;
    if (!take(s, party->writing, party->written) || !take(s, party->reading, party->read)) {
        return 0;
    }
    for (int64_t k = 0; k < party->row_count; k++) {
        double change = plan->values[places_of(s)[rows[k].of]] - s->reached[rows[k].of];
        slopes[(size_t)rows[k].of * s->equations.count + column] += change / (moved - before);
    }
    memcpy(plan->values, s->kept, plan->value_count * sizeof(double));
    return take(s, party->writing, party->written);
}

static int derive(void *context, const double *candidate, double *slopes)
{
    Solving *s = context;
    const Plan *plan = s->hand->plan;
    size_t n = s->equations.count;
    place(s, candidate);
    for (size_t k = 0; k < n * n; k++) {
        slopes[k] = k % (n + 1) == 0 ? -1.0 : -0.0;
    }
    for (int64_t m = 0; m < s->of->party_count; m++) {
        const Party *party = &plan->parties[s->of->party + m];
        for (size_t column = 0; party->row_count > 0 && column < n; column++) {
            if (!moves(plan, party, places_of(s)[column])) {
                continue;
            }
            int found = ask(s, party, column, slopes);
            if (found < 0 || (found == 0 && !differ(s, party, column, slopes))) {
                return 0;
            }
        }
    }
    return 1;
}

/* What is left of the mismatch of the real numbers, with the others as they are fixed; 0 where something failed. */
static int solve_reals(Solving *s, double *left)
{
    size_t n = s->equations.count;
    int is_shown = 1;
    for (size_t k = 0; k < n; k++) {
        double value = s->hand->plan->values[places_of(s)[k]];
        s->here[k] = isfinite(value) ? value : 0.0; /* uncovered: a value that is none has ended the run before */
    }
    if (!evaluate(s, s->here, s->mismatch)) {
        return 0;
    }
    *left = relative(s->mismatch, s->reached, n);
    if (*left <= settled) {
        return 1;
    }
    s->head[SOLUTIONS] += 1.0;
    for (int attempt = 0; attempt < begins && (attempt == 0 || *left > solved); attempt++) {
        if (attempt > 0) {
            memcpy(s->here, s->reached, n * sizeof(double));
            for (size_t k = 0; k < n; k++) {
                if (!isfinite(s->here[k])) {
                    return 1;
                }
            }
            if (!evaluate(s, s->here, s->mismatch)) {
                return 0;
            }
        }
        if (!find_root(&s->equations, s->here, s->mismatch, left, &is_shown) ||
            (!is_shown && !evaluate(s, s->here, s->mismatch))) { /* uncovered: an FMU refuses what it has taken before */
            return 0;
        }
    }
    return 1;
}

const Call *solve(Hand *hand, const Group *group, const Advance *it, int *status)
{
    const Solver *of = group->begin->solver;
    const Plan *plan = hand->plan;
    double *at = plan->work + of->work, *own = at + SOLVER_HEAD, left = INFINITY;
    size_t n = (size_t)of->real_count;
    Solving s = {.hand = hand, .of = of, .it = it, .head = at, .here = own, .mismatch = own + n, .reached = own + 2 * n};
    s.fixed = own + 3 * n + room_of_root(n);
    s.kept = s.fixed + of->other_count;
    s.equations = (Equations){&s, n, evaluate, derive, own + 3 * n};
    int is_fine = take(&s, group->begin - plan->calls + 1, of->evaluating), is_fixed = 0;
    const int64_t *others = places_of(&s) + of->real_count;
    for (int64_t attempt = 0; is_fine && !is_fixed && attempt < of->attempts; attempt++) {
        for (int64_t k = 0; k < of->other_count; k++) {
            s.fixed[k] = plan->values[others[k]];
        }
        is_fine = solve_reals(&s, &left);
        is_fixed = 1;
        for (int64_t k = 0; k < of->other_count; k++) {
            is_fixed &= is_same(plan, others[k], s.fixed[k], plan->values[others[k]]);
        }
    }
    if (!is_fine) {
        *status = s.status;
        return s.failed;
    }
    left = is_fixed ? left : INFINITY;
    at[WORST] = left > at[WORST] ? left : at[WORST];
    at[LEFT] = left;
    *status = 0;
    return left <= solved ? NULL : group->begin;
}
