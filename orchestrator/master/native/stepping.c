/* The step loop itself: calls of the FMUs' functions, group by group, and the rows they leave.

   With the same arithmetic, in the same order, as `Exchange` and `Master` have it in Python, so that the two give the same
   bits. */

#include "algebraic/solving.h"

#include <limits.h>
#include <math.h>
#include <string.h>

typedef int (*DoStep)(void *component, double time, double step, int no_set_state);
typedef int (*SetReal)(void *component, const unsigned int *references, size_t count, const double *values);
typedef int (*GetReal)(void *component, const unsigned int *references, size_t count, double *values);
typedef int (*SetInteger)(void *component, const unsigned int *references, size_t count, const int *values);
typedef int (*GetInteger)(void *component, const unsigned int *references, size_t count, int *values);

static Note note_of_all;

static Note *find_note(int number) /* uncovered: there is a guard */
{
    (void)number;
    return &note_of_all; /* uncovered: there is a guard */
}

static int do_unguarded(void (*work)(void *), void *context, int *code) /* uncovered: there is a guard */
{
    (void)code;
    work(context); /* uncovered: there is a guard */
    return 0;      /* uncovered: there is a guard */
}

Guard guard = {find_note, do_unguarded};

static double changed(const Change *change, double value, double time)
{
    if (!change->active) {
        return value;
    }
    value = change->scale * value + change->offset + change->slope * (time - change->since);
    return change->is_real ? value : trunc(value);
}

double read_entry(const Plan *plan, const Entry *entry, double time)
{
    double value = *value_of(plan, entry);
    if (entry->form != NUMBER) {
        value = number_of(value, entry->form);
    }
    if (entry->scale != 1.0 || entry->offset != 0.0) {
        value = entry->scale * value + entry->offset;
    }
    if (entry->whole == TRUE_ABOVE) {
        value = value > entry->threshold;
    } else if (entry->whole == ROUNDED_UP) {
        value = isnan(value) ? 0.0 : isinf(value) ? copysign(0x1p64, value) : ceil(value - entry->threshold);
    }
    return entry->change < 0 ? value : changed(&plan->changes[entry->change], value, time);
}

static const Call *take_steps(const Hand *hand, const Group *group, double time, double step, int *status)
{
    DoStep do_step = (DoStep)group->function;
    const Call *end = group->end;
    for (const Call *call = group->begin; call < end; call++) {
        note_call(hand, call);
        int found = do_step(call->component, time, step, !group->is_late);
        if (is_failure(found)) {
            *status = found;
            return call;
        }
    }
    return end;
}

static const Call *set_reals_in_place(const Hand *hand, const Group *group, int *status)
{
    SetReal set = (SetReal)group->function;
    const unsigned int *references = group->references;
    size_t count = group->count;
    const Call *end = group->end;
    for (const Call *call = group->begin; call < end; call++) {
        note_call(hand, call);
        int found = set(call->component, references, count, call->values);
        if (is_failure(found)) {
            *status = found;
            return call;
        }
    }
    return end;
}

static const Call *set_reals(const Hand *hand, const Group *group, double time, int *status)
{
    SetReal set = (SetReal)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        for (size_t k = 0; k < group->count; k++) {
            hand->reals[k] = read_entry(hand->plan, &call->entries[k], time);
        }
        note_call(hand, call);
        *status = set(call->component, group->references, group->count, hand->reals);
        if (is_failure(*status)) {
            return call;
        }
    }
    return group->end;
}

static const Call *set_integers(const Hand *hand, const Group *group, double time, int *status)
{
    SetInteger set = (SetInteger)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        for (size_t k = 0; k < group->count; k++) {
            double value = read_entry(hand->plan, &call->entries[k], time);
            if (!(value >= INT_MIN && value <= INT_MAX)) {
                *status = 0;
                return call;
            }
            hand->integers[k] = (int)value;
        }
        note_call(hand, call);
        *status = set(call->component, group->references, group->count, hand->integers);
        if (is_failure(*status)) {
            return call;
        }
    }
    return group->end;
}

static const Call *get_reals(const Hand *hand, const Group *group, int *status)
{
    GetReal get = (GetReal)group->function;
    const unsigned int *references = group->references;
    size_t count = group->count;
    const Call *end = group->end;
    for (const Call *call = group->begin; call < end; call++) {
        note_call(hand, call);
        int found = get(call->component, references, count, call->values);
        int finite = 1;
        for (size_t k = 0; k < count; k++) {
            finite &= isfinite(call->values[k]) != 0;
        }
        finite |= group->is_unseen;
        if (is_failure(found) || !finite) {
            *status = found;
            return call;
        }
    }
    return end;
}

static const Call *get_integers(const Hand *hand, const Group *group, int *status)
{
    GetInteger get = (GetInteger)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        note_call(hand, call);
        *status = get(call->component, group->references, group->count, hand->integers);
        if (is_failure(*status)) {
            return call;
        }
        for (size_t k = 0; k < group->count; k++) {
            int value = hand->integers[k];
            call->values[k] = (double)(call->entries[k].whole == TRUE_ABOVE ? value != 0 : value);
        }
    }
    return group->end;
}

static const Call *change_values(const Group *group, double time)
{
    for (const Call *call = group->begin; call < group->end; call++) {
        *call->values = changed(call->change, *call->values, time);
    }
    return group->end;
}

static const Call *take_group(const Hand *hand, const Group *group, const Advance *it, int *status)
{
    double time = it->time, step = it->step, when = group->is_late ? time + step : time;
    switch (group->kind) { /* uncovered: who solves makes the call of ASK */
    case STEP: return take_steps(hand, group, time, (double)group->period * step, status);
    case SET_REALS_IN_PLACE: return set_reals_in_place(hand, group, status);
    case SET_REALS: return set_reals(hand, group, when, status);
    case SET_INTEGERS: return set_integers(hand, group, when, status);
    case GET_REALS: return get_reals(hand, group, status);
    case GET_INTEGERS: return get_integers(hand, group, status);
    case STEP_3: return take_steps_3(hand, group, time, (double)group->period * step, status);
    case SET_3: return set_3(hand, group, when, status);
    case GET_3: return get_3(hand, group, status);
    case SET_TEXTS: return set_texts(hand, group, when, status);
    case GET_TEXTS: return get_texts(hand, group, status);
    case LOOK: return look_at(hand->plan, group, status);
    case STAMP: stamp(hand->plan, group, it); return group->end;
    case EXTEND: return extend(hand, group, it, status);
    case SLOPES: return set_slopes(hand, group, status);
    case SAVE: case RESTORE: case FORGET: return treat_states(hand, group, status);
    case NOTE: note_inputs(hand->plan, group, time); return group->end;
    case ASK: return group->end; /* uncovered: it is called by who solves */
    default: return change_values(group, time + step);
    }
}

/* Where a loop leads from here: a group to go on before, or NULL where it was lost. */
static const Group *lead(const Plan *plan, const Group *group)
{
    const Loop *loop = group->begin->loop;
    const size_t *groups = &plan->loop_groups[2 * (loop - plan->loops)];
    if (group->kind == BEGIN) {
        begin_loop(plan, loop);
        return plan->groups + groups[1] - 2; /* they are counted from 1; the one before MARK */
    }
    if (group->kind == MARK) {
        begin_round(plan, loop);
        return group;
    }
    Way_on way = end_round(plan, loop);
    return way == AGAIN ? plan->groups + groups[0] - 1 : way == ON ? group : NULL;
}

void look_at_floats(const Hand *hand, const Advance *it)
{
    const Plan *plan = hand->plan;
    const Group *group = hand->group;
    if (group->is_watched && float_control() != plan->control) { /* an FMU must not change the numbers of others */
        fesetenv(&plan->floats);
        int64_t *mark = &plan->disturbed[group->begin - plan->calls]; /* a group of its own */
        *mark = *mark == 0 ? it->number + 1 : *mark;
    }
}

/* Of a group's calls those from one to before another; the one that failed, or NULL. */
static const Call *take_some(Hand *hand, const Group *group, Call *from, Call *to, const Advance *it, int *status)
{
    Group some;
    const Group *taken = group;
    if (group->begin < from || to < group->end) { /* uncovered: no group goes on behind the calls that are taken */
        some = *group;
        some.begin = from < group->begin ? group->begin : from;
        some.end = to < group->end ? to : group->end;
        taken = &some;
    }
    hand->group = group;
    hand->note->function = group->function;
    const Call *call = take_group(hand, taken, it, status);
    look_at_floats(hand, it);
    return call < taken->end ? call : NULL;
}

const Call *take_calls(Hand *hand, int64_t from, int64_t to, const Advance *it, int *status)
{
    const Plan *plan = hand->plan;
    const Call *call = NULL;
    for (size_t n = plan->group_of[from]; call == NULL && from < to && n <= plan->group_of[to - 1]; n++) {
        call = take_some(hand, &plan->groups[n], plan->calls + from, plan->calls + to, it, status);
    }
    return call;
}

/* Where what a group does ends: behind that of who solves are operations that it does itself. */
static Call *end_of(const Plan *plan, const Group *group)
{
    return group->kind == SOLVE ? plan->calls + group->begin->solver->end : group->end;
}

void take_part(Hand *hand, int part, const Advance *it, Place *place)
{
    const Plan *plan = hand->plan;
    const Group *end = plan->groups + plan->bounds[part + 1];
    Call *from = plan->calls + place->begin;
    hand->note->time = it->time;
    for (const Group *group = plan->groups + plan->bounds[part]; group < end; group++) {
        if ((group->end <= from && end_of(plan, group) <= from) || /* uncovered: what fails in a solution ends the run */
            (group->period > 1 && it->number % group->period != group->phase)) {
            continue;
        }
        const Call *call = NULL;
        int status = 0;
        if (group->kind == SOLVE) {
            call = solve(hand, group, it, &status);
            from = end_of(plan, group);
        } else if (group->kind >= BEGIN) {
            const Group *next = lead(plan, group);
            call = next == NULL ? group->begin : NULL;
            from = next != NULL && next < group ? plan->calls : from; /* what was done before is to be done again */
            group = next == NULL ? group : next;
        } else {
            call = take_some(hand, group, from, group->end, it, &status);
        }
        if (call != NULL) {
            place->failed = call - plan->calls;
            place->status = status;
            break;
        }
    }
    hand->note->instance = 0;
    if (place->failed >= 0) {
        return;
    }
    place->begin = place->begin < plan->ends[part] ? plan->ends[part] : place->begin;
}

static void remember(Plan *plan)
{
    if (plan->depth > 0) {
        plan->newest = plan->newest + 1 < plan->depth ? plan->newest + 1 : 0;
        memcpy(plan->history + plan->newest * plan->value_count, plan->values, plan->value_count * sizeof(double));
    }
}

Outcome outcome_of(const Block *block)
{
    return (Outcome){.wait = block->every - block->first % block->every};
}

int has_next(const Block *block, const Outcome *outcome, Advance *it)
{
    long long k = block->first + outcome->done;
    int is_due = outcome->wait == 1 || k + 1 == block->last;
    if (outcome->done == block->count || (is_due && outcome->written == block->capacity)) {
        return 0;
    }
    it->number = k;
    it->start = block->start;
    it->time = block->start + (double)k * block->step;
    it->step = block->step;
    it->is_due = is_due;
    return 1;
}

void write_row(const Plan *plan, const Block *block, double time, Outcome *outcome)
{
    double *to = block->rows + outcome->written;
    *to = time;
    for (size_t k = 0; k < block->kept_count; k++) {
        to += block->stride;
        double value = plan->values[block->kept[k]];
        *to = plan->forms == NULL ? value : number_of(value, plan->forms[block->kept[k]]);
    }
    plan->note->rows = ++outcome->written;
}

void finish_step(Plan *plan, const Block *block, const Advance *it, Outcome *outcome)
{
    outcome->done++;
    outcome->wait = outcome->wait > 1 ? outcome->wait - 1 : block->every;
    for (int n = 0; n < plan->thread_count; n++) {
        block->places[n].begin = 0;
    }
    remember(plan);
    if (it->is_due) {
        write_row(plan, block, block->start + (double)(it->number + 1) * block->step, outcome);
    }
}

void note_failure(Hand *hand, Place *place, int way, int code)
{
    const Call *call = hand->group->begin;
    uint64_t left = hand->note->instance;
    /* Only FMUs of our own stand in groups of several, and none of them leaves. */
    while ((uint64_t)(uintptr_t)call->component != left && call + 1 < hand->group->end) { /* uncovered: see above */
        call++;                                                                           /* uncovered: see above */
    }
    hand->note->instance = 0;
    place->failed = call - hand->plan->calls;
    place->status = LEFT(way, code);
}

typedef struct {
    Plan *plan;
    Hand *hand;
    const Block *block;
    Outcome outcome;
    Advance step;
} Run;

static void take_all(void *context)
{
    Run *run = context;
    const Block *block = run->block;
    while (block->places->failed < 0 && has_next(block, &run->outcome, &run->step)) {
        take_part(run->hand, 0, &run->step, block->places);
        if (block->places->failed < 0) {
            finish_step(run->plan, block, &run->step, &run->outcome);
        }
    }
}

Outcome take_block(Plan *plan, Hand *hand, const Block *block)
{
    Run run = {.plan = plan, .hand = hand, .block = block, .outcome = outcome_of(block)};
    int code = 0, way = guard.safely(take_all, &run, &code);
    if (way != 0) {
        note_failure(hand, block->places, way, code);
    }
    return run.outcome;
}
