/* Inputs that go on during a step, as `Extrapolator` has them; what time values belong to, and whether they are finite. */

#include "kernel.h"

#include <math.h>

typedef int (*SetReal)(void *component, const unsigned int *references, size_t count, const double *values);
typedef int (*SetSlopes)(void *component, const unsigned int *references, size_t count, const int *orders,
                         const double *values);

/* Part of a step within which two times are one (`_ROUNDING` in extrapolation.py). */
static const double rounding = 1e-6;

const Call *look_at(const Plan *plan, const Group *group, int *status)
{
    for (const Call *call = group->begin; call < group->end; call++) {
        for (size_t k = 0; k < group->count; k++) {
            if (!isfinite(plan->values[call->entries[k].place])) {
                *status = 0;
                return call;
            }
        }
    }
    return group->end;
}

void stamp(const Plan *plan, const Group *group, const Advance *it)
{
    double begin = it->start + (double)(it->number - group->phase) * it->step;
    double reached = begin + (double)group->period * it->step;
    for (const Call *call = group->begin; call < group->end; call++) {
        for (size_t k = 0; k < group->count; k++) {
            plan->stamps[call->entries[k].place] = reached;
        }
    }
}

/* Take a value in that belongs to a time; those kept are older than that. */
static void keep(Points *points, double time, double value, double length, int64_t depth)
{
    int64_t count = 0;
    for (int64_t k = 0; k < points->count; k++) {
        if (points->times[k] < time - rounding * length) {
            points->times[count] = points->times[k];
            points->values[count++] = points->values[k];
        }
    }
    int64_t surplus = count > depth ? count - depth : 0;
    for (int64_t k = surplus; k < count; k++) {
        points->times[k - surplus] = points->times[k];
        points->values[k - surplus] = points->values[k];
    }
    points->count = count - surplus + 1;
    points->times[points->count - 1] = time;
    points->values[points->count - 1] = value;
}

/* The value at a time of the polynomial through the last points, in Newton's form; its slopes are left in them. */
static double polynomial(Points *points, double time, int64_t order)
{
    int64_t first = points->count > order + 1 ? points->count - order - 1 : 0;
    const double *t = points->times + first, *v = points->values + first;
    points->slopes[0] = points->slopes[1] = 0.0;
    if (points->count - first == 1) {
        return v[0];
    }
    double slope = (v[1] - v[0]) / (t[1] - t[0]);
    points->slopes[0] = slope;
    if (points->count - first == 2) {
        return v[0] + slope * (time - t[0]);
    }
    double bend = ((v[2] - v[1]) / (t[2] - t[1]) - slope) / (t[2] - t[0]);
    points->slopes[0] = slope + bend * ((time - t[0]) + (time - t[1]));
    points->slopes[1] = 2.0 * bend;
    return v[0] + slope * (time - t[0]) + bend * (time - t[0]) * (time - t[1]);
}

const Call *extend(const Hand *hand, const Group *group, const Advance *it, int *status)
{
    SetReal set = (SetReal)group->function;
    const Plan *plan = hand->plan;
    double length = (double)group->period * it->step;
    for (const Call *call = group->begin; call < group->end; call++) {
        const Course *course = call->course;
        for (size_t k = 0; k < group->count; k++) {
            hand->reals[k] = read_entry(plan, &call->entries[k], it->time);
        }
        for (int64_t n = course->begin; n < course->begin + course->count; n++) {
            Points *points = &plan->points[n];
            const Entry *entry = &call->entries[points->place];
            if (course->at != AS_NOTED) {
                double when = course->at == AT_END ? it->time + length : plan->stamps[entry->place];
                keep(points, when, hand->reals[points->place], length, course->depth);
            }
            if (course->order > 0) {
                hand->reals[points->place] = polynomial(points, it->time, course->order);
            }
        }
        note_call(hand, call);
        *status = set(call->component, group->references, group->count, hand->reals);
        if (is_failure(*status)) {
            return call;
        }
    }
    return group->end;
}

void note_inputs(const Plan *plan, const Group *group, double time)
{
    for (const Call *call = group->begin; call < group->end; call++) {
        const Noting *noting = call->noting;
        const Entry *to = plan->entries + plan->channels[noting->to].begin;
        for (size_t k = 0; k < group->count; k++) {
            const Entry *entry = &call->entries[k];
            plan->values[to[k].place] = is_plain(entry) ? *value_of(plan, entry) : read_entry(plan, entry, time);
        }
        if (noting->course >= 0) {
            const Course *course = &plan->courses[noting->course], *shown = &plan->courses[noting->shown];
            for (int64_t n = 0; n < course->count; n++) {
                Points *points = &plan->points[shown->begin + n];
                *points = plan->points[course->begin + n];
            }
        }
    }
}

const Call *set_slopes(const Hand *hand, const Group *group, int *status)
{
    SetSlopes set = (SetSlopes)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        const Course *course = call->course;
        size_t count = (size_t)(course->count * course->order);
        unsigned *references = (unsigned *)hand->integers + count;
        for (size_t k = 0; k < count; k++) {
            const Points *points = &hand->plan->points[course->begin + (int64_t)k / course->order];
            hand->integers[k] = (int)((int64_t)k % course->order) + 1;
            references[k] = (unsigned)points->reference;
            hand->reals[k] = points->slopes[(int64_t)k % course->order];
        }
        if (count == 0) {
            continue;
        }
        note_call(hand, call);
        *status = set(call->component, references, count, hand->integers, hand->reals);
        if (is_failure(*status)) {
            return call;
        }
    }
    return group->end;
}
