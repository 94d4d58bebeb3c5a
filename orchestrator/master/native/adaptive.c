/* Steps as long as a tolerance lets them be, as `Adaptive` has them (adaptive.py), with every operation in the same
   sequence; `pow` is what Python calls as well.

   Each step is taken whole and in two halves; the halves are kept if the two agree, and agree with steps under the inputs
   of the end. Whatever does not go well is Python's: an FMU that fails, a tolerance that cannot be kept. */

#include "adaptive.h"

#include <math.h>
#include <string.h>

/* `_SAFETY`, `_SMALLEST`, `_LARGEST`, `_MOST_IN_A_ROW`, `_ROUNDING` and `_APART` in adaptive.py, `_LAST` in repetition.py. */
static const double safety = 0.9, smallest = 0.2, largest = 5.0, rounding = 1e-9, apart = 8.0, last_part = 1.0 / 16.0;
static const int64_t most_in_a_row = 8;

/* A point to come back to, beside the states of FMUs. */
typedef struct {
    double *values, *stamps;
    Points *points;
    double head[SOLVER_HEAD]; /* what is counted of algebraic loops */
} Memory;

typedef struct {
    Plan *plan;
    Hand *hand;
    const Block *block;
    Control *control;
    Outcome outcome;
    const double *relative, *absolute; /* tolerances */
    double *whole, *halves, *reached;  /* all values, by another way */
    Memory begin, end;
    int is_kept_back; /* a state is not given back: that ends the run */
} Doubling;

/* An error in units of the tolerance, and the place of the value that has it. */
typedef struct {
    double error;
    int64_t place;
} Worst;

static size_t doubles_of(size_t bytes)
{
    return (bytes + sizeof(double) - 1) / sizeof(double);
}

static size_t size_of_points(const Control *control)
{
    return doubles_of((size_t)control->point_count * sizeof(Points));
}

size_t work_of_control(const Plan *plan, const Control *control)
{
    size_t watched = (size_t)(control->plain_count + control->shown_count);
    return 2 * watched + 7 * plan->value_count + 2 * size_of_points(control);
}

static void find_room(Doubling *it)
{
    size_t watched = (size_t)(it->control->plain_count + it->control->shown_count), width = it->plan->value_count;
    double *at = it->plan->work + it->control->work;
    it->relative = at;
    it->absolute = at + watched;
    at += 2 * watched;
    double **of[] = {&it->whole, &it->halves, &it->reached, &it->begin.values, &it->begin.stamps, &it->end.values, &it->end.stamps};
    for (size_t n = 0; n < sizeof of / sizeof *of; n++) {
        *of[n] = at;
        at += width;
    }
    it->begin.points = (Points *)at;
    it->end.points = (Points *)(at + size_of_points(it->control));
}

/* ------------------------------------------------------------------------------------------------- one step, one way */

static int has_failed(const Doubling *it)
{
    return it->block->places->failed >= 0;
}

/* After a failure nothing is done any more, and whatever comes of that is thrown away. */
static void go(Doubling *it, int program, double time, double length)
{
    if (has_failed(it)) {
        return;
    }
    Advance advance = {.start = time, .time = time, .step = length};
    it->control->called_at = time;
    it->control->called_for = length;
    it->block->places->begin = 0;
    take_part(it->hand, program, &advance, it->block->places);
}

static void copy(const Doubling *it, double *to, const double *from)
{
    memcpy(to, from, (size_t)it->control->value_count * sizeof(double));
}

static void sweep(Doubling *it, int program, double time, double length)
{
    go(it, program, time, length);
    copy(it, it->reached, it->plan->values);
    go(it, SETTLE, time, length);
}

static void keep_memory(const Doubling *it, Memory *memory)
{
    if (it->plan->head != NULL) {
        memcpy(memory->head, it->plan->head, sizeof memory->head);
    }
    copy(it, memory->values, it->plan->values);
    if (it->plan->stamps != NULL) {
        copy(it, memory->stamps, it->plan->stamps);
    }
    memcpy(memory->points, it->plan->points, (size_t)it->control->point_count * sizeof(Points));
}

/* All but the values. */
static void recall(const Doubling *it, const Memory *memory)
{
    if (it->plan->stamps != NULL) {
        copy(it, it->plan->stamps, memory->stamps);
    }
    memcpy(it->plan->points, memory->points, (size_t)it->control->point_count * sizeof(Points));
}

/* The same, and the FMUs' states. */
static void come_back(Doubling *it, int program, const Memory *memory, double time)
{
    recall(it, memory);
    go(it, program, time, 0.0);
}

static Worst compare(const Doubling *it, int64_t first, int64_t count, const double *other, const double *kept, double times)
{
    Worst worst = {0.0, -1};
    for (int64_t k = first; k < first + count; k++) {
        int64_t place = it->plan->passed[k];
        double coarse = other[place], fine = kept[place];
        double size = fabs(coarse) > fabs(fine) ? fabs(coarse) : fabs(fine);
        double bound = it->absolute[k] + it->relative[k] * size + 1e-300;
        double error = fabs(fine - coarse) / times / bound;
        if (!(error <= worst.error)) {
            worst.error = isfinite(error) ? error : INFINITY;
            worst.place = place;
        }
    }
    return worst;
}

static Worst worse(Worst a, Worst b)
{
    return b.error > a.error ? b : a;
}

/* The step of those that may show their inputs, once with the inputs of the second half, once with those of the end, which
   act until shortly before it. */
static Worst repeat(Doubling *it, double time, double end, Worst found)
{
    const Control *now = it->control;
    double length = end - time, rest = last_part * length, most = length - rest;
    come_back(it, BACK, &it->begin, end);
    go(it, SHOWN, time, length);
    go(it, READ, time, length);
    found = worse(found, compare(it, now->plain_count, now->shown_count, it->plan->values, it->reached, now->of_same));
    come_back(it, BACK, &it->begin, end);
    copy(it, it->plan->values, it->halves);
    go(it, GIVEN, time, length);
    go(it, GO, time, most);
    go(it, SHOWN, time + most, rest);
    go(it, READ, time, length);
    found = worse(found, compare(it, now->plain_count, now->shown_count, it->plan->values, it->reached, now->of_end));
    copy(it, it->plan->values, it->halves);
    return found;
}

/* Take a step in two halves, and by other ways; whether its end has been kept is left in `is_kept`. */
static Worst take(Doubling *it, double time, double end, int *is_kept)
{
    const Control *now = it->control;
    double length = end - time, middle = 0.5 * (time + end);
    sweep(it, SWEEP, time, length);
    copy(it, it->whole, it->plan->values);
    come_back(it, BACK, &it->begin, end);
    copy(it, it->plan->values, it->begin.values);
    sweep(it, SWEEP, time, middle - time);
    sweep(it, SWEEP, middle, end - middle);
    copy(it, it->halves, it->plan->values);
    Worst found = compare(it, 0, now->plain_count, it->whole, it->halves, now->of_halves);
    *is_kept = found.error <= 1.0;
    if (!*is_kept) {
        return found;
    }
    go(it, KEEP_END, end, 0.0);
    keep_memory(it, &it->end);
    if (now->shown_count > 0) {
        found = repeat(it, time, end, found);
    }
    come_back(it, BACK, &it->begin, end);
    sweep(it, ENDED, time, length);
    found = worse(found, compare(it, 0, now->plain_count, it->plan->values, it->halves, now->of_end));
    copy(it, it->plan->values, it->halves);
    come_back(it, BACK_END, &it->end, end);
    return found;
}

/* ------------------------------------------------------------------------------------------------ one step, and how long */

static double larger(double a, double b)
{
    return b > a ? b : a;
}

static double smaller(double a, double b)
{
    return b < a ? b : a;
}

/* End and length of a step, as `_fit` has it. */
static double fit(double time, double wanted, double until, double *length)
{
    double left = until - time;
    if (left <= wanted * (1.0 + rounding)) {
        *length = left;
        return until;
    }
    if (left < 2.0 * wanted) {
        wanted = 0.5 * left;
    }
    *length = time + wanted - time;
    return time + wanted;
}

static void forget(Doubling *it, int program, int is_kept, double time)
{
    if (is_kept) {
        go(it, program, time, 0.0);
        it->is_kept_back |= has_failed(it);
    }
}

/* After a jump nothing is known of before. */
static void jump(Doubling *it, int64_t place)
{
    it->control->jump = place;
    for (int64_t k = 0; k < it->control->point_count; k++) {
        it->plan->points[k].count = 0;
    }
}

/* One step, at whose begin all is kept; 0 where it is for Python. */
static int choose(Doubling *it, double until)
{
    Control *now = it->control;
    double time = now->time, longest = now->step, size = larger(fabs(time), fabs(until));
    double shortest = larger(now->shortest, apart * (nextafter(size, INFINITY) - size));
    double wanted = smaller(now->length != 0.0 ? now->length : longest, longest);
    int64_t rejected = 0, in_a_row = now->in_a_row;
    for (;;) {
        double length, end = fit(time, wanted, until, &length);
        int is_shortest = smaller(length, wanted) <= shortest * (1.0 + rounding), is_kept;
        Worst found = take(it, time, end, &is_kept);
        if (has_failed(it)) {
            return 0;
        }
        double error = found.error, ideal = error > 0.0 ? safety * pow(error, now->exponent) : largest;
        double factor = smaller(largest, larger(smallest, ideal));
        int is_good = error <= 1.0;
        if (is_good || (is_shortest && ++in_a_row <= most_in_a_row)) {
            if (!is_good) {
                factor = largest;
                jump(it, found.place);
            } else if (length > largest * shortest) {
                in_a_row = 0;
            }
            forget(it, FORGET_BEGIN, 1, end);
            forget(it, FORGET_END, is_kept, end);
            if (has_failed(it)) {
                return 0;
            }
            now->length = smaller(longest, larger(length * factor, factor >= 1.0 ? wanted : shortest));
            now->accepted++;
            now->rejected += rejected;
            now->in_a_row = in_a_row;
            now->least = smaller(now->least, length);
            now->most = larger(now->most, length);
            now->time = end;
            return 1;
        }
        if (is_shortest) {
            return 0;
        }
        rejected++;
        forget(it, FORGET_END, is_kept, end);
        come_back(it, BACK, &it->begin, end);
        copy(it, it->plan->values, it->begin.values);
        wanted = larger(shortest, length * smaller(factor, safety));
    }
}

/* All but the FMUs is again as it was at the begin of the step; what Python solves anew is not counted twice. */
static void undo(Doubling *it)
{
    if (it->plan->head != NULL && !it->is_kept_back) {
        memcpy(it->plan->head, it->begin.head, sizeof it->begin.head);
    }
    recall(it, &it->begin);
    copy(it, it->plan->values, it->begin.values);
}

/* One step, unless it is for Python; what to undo is kept before the first call, which may be left. */
static int advance(Doubling *it, double until)
{
    keep_memory(it, &it->begin);
    go(it, KEEP, it->control->time, 0.0);
    if (choose(it, until)) {
        return 1;
    }
    undo(it);
    return 0;
}

/* The next point at which a row is due, as `next_row` in varying.py has it. */
static double next_row(const Control *now)
{
    double stride = now->every * now->step;
    if (!(stride > 0.0)) {
        return now->last;
    }
    double done = floor((now->time - now->start) / stride + now->late / stride);
    double row = now->start + (done + 1.0) * now->every * now->step;
    return row < now->last - now->late ? row : now->last;
}

static void take_all(void *context)
{
    Doubling *it = context;
    Control *now = it->control;
    while (now->time < now->end && it->outcome.written < it->block->capacity && now->jump < 0) {
        double row = next_row(now);
        if (!advance(it, now->due < row - now->late ? now->due : row)) {
            return;
        }
        it->outcome.done++;
        write_row(it->plan, it->block, now->time, &it->outcome);
        if (now->due <= now->time + now->late) {
            return;
        }
    }
}

Outcome take_adaptive(Plan *plan, Hand *hand, const Block *block, Control *control)
{
    Doubling it = {.plan = plan, .hand = hand, .block = block, .control = control};
    int code = 0;
    find_room(&it);
    int way = guard.safely(take_all, &it, &code);
    if (way != 0) {
        note_failure(hand, block->places, way, code);
        undo(&it);
    }
    return it.outcome;
}
