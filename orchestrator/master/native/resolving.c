/* Operations of the plan that point to others of Python's arrays: whether they may, and what they are then. */

#include "plan.h"

int is_entry(const Plan *plan, const Entry *entry, size_t change_count)
{
    return is_within(entry->place, 1, plan->value_count) && entry->age >= -1 && entry->change >= -1 &&
           (entry->change < 0 || (uint64_t)entry->change < change_count) &&
           (entry->age < 0 || (uint64_t)entry->age < plan->depth);
}

/* Whether a channel's entries can be read (or stand side by side among the values, where they must). */
static int entries_fit(const Plan *plan, const Entry *entries, int64_t count, size_t change_count, int is_row)
{
    for (int64_t k = 0; k < count; k++) {
        const Entry *entry = &entries[k];
        if (!is_entry(plan, entry, change_count) || (is_row && entry->place != entries[0].place + k)) {
            return 0;
        }
    }
    return 1;
}

/* Whether the values stand among the live ones as they are to be set. */
static int are_in_place(const Entry *entries, int64_t count)
{
    for (int64_t k = 0; k < count; k++) {
        if (entries[k].form != NUMBER || entries[k].age >= 0 || entries[k].change >= 0 || entries[k].scale != 1.0 || entries[k].offset != 0.0 ||
            entries[k].place != entries[0].place + k) {
            return 0;
        }
    }
    return 1;
}

/* That of values: of a channel, which is set or read, or of which the values are looked at or stamped. */
int resolve_channel(const Plan *plan, const Py_buffer *buffers, const Operation *operation, int64_t index, Group *group,
                    Call *call)
{
    int is_get = operation->kind != OPERATION_SET && operation->kind < OPERATION_EXTEND; /* or looked at */
    if (!is_within(index, 1, length(buffers, CHANNELS))) {
        return 0;
    }
    const Channel *channel = (const Channel *)buffers[CHANNELS].buf + index;
    if (channel->count < 1 || !is_within(channel->begin, channel->count, length(buffers, ENTRIES)) ||
        channel->type < 0 || channel->type > TYPE_TEXT_3 || (channel->type >= TYPE_TEXT && plan->texts == NULL) || channel->reference_count < 1 ||
        channel->reference_count > channel->count) {
        return 0;
    }
    const Entry *entries = (const Entry *)buffers[ENTRIES].buf + channel->begin;
    if (!entries_fit(plan, entries, channel->count, length(buffers, CHANGES), is_get && channel->type == 0)) {
        return 0;
    }
    int in_place = channel->type == 0 && channel->is_real && (is_get || are_in_place(entries, channel->count));
    group->kind = channel->type >= TYPE_TEXT ? (is_get ? GET_TEXTS : SET_TEXTS)
                  : channel->type            ? (is_get ? GET_3 : SET_3)
                  : in_place ? (is_get ? GET_REALS : SET_REALS_IN_PLACE)
                           : (is_get ? GET_INTEGERS : channel->is_real ? SET_REALS : SET_INTEGERS);
    group->is_unseen = operation->kind == OPERATION_READ;
    group->function = (uintptr_t)channel->function;
    group->references = (const unsigned int *)buffers[REFERENCES].buf + channel->begin;
    group->count = (size_t)channel->count;
    group->reference_count = (size_t)channel->reference_count;
    group->type = (int)channel->type;
    call->component = (void *)(uintptr_t)channel->component;
    call->values = plan->values + (in_place || is_get ? entries[0].place : 0);
    call->entries = entries;
    if (operation->kind == OPERATION_LOOK || operation->kind == OPERATION_STAMP) {
        group->kind = operation->kind == OPERATION_LOOK ? LOOK : STAMP;
        return group->kind == LOOK || plan->stamps != NULL;
    }
    return group->function != 0;
}

/* Whether there are the inputs of a channel that points belong to, and no more points than there is room for. */
static int points_fit(const Plan *plan, const Course *course, int64_t width)
{
    for (int64_t n = course->begin; n < course->begin + course->count; n++) {
        const Points *points = &plan->points[n];
        if (!is_within(points->place, 1, (size_t)width) || points->count < 0 || points->count > 3) {
            return 0;
        }
    }
    return 1;
}

int resolve_course(Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    if (!is_within(operation->index, 1, length(buffers, COURSES))) {
        return 0;
    }
    const Course *course = (const Course *)buffers[COURSES].buf + operation->index;
    if (!resolve_channel(plan, buffers, operation, course->channel, group, call) || group->type != 0 || course->function == 0 ||
        course->count < 1 || !is_within(course->begin, course->count, length(buffers, POINTS)) || course->depth < 0 ||
        course->depth > 2 || course->order < 0 || course->order > course->depth ||
        course->at < AT_STAMP || course->at > AS_NOTED || (course->at == AT_STAMP && plan->stamps == NULL)) {
        return 0;
    }
    if (!points_fit(plan, course, (int64_t)group->count)) {
        return 0;
    }
    size_t room = 4 * (size_t)course->count; /* for two orders and as many references, as integers */
    plan->largest = room > plan->largest ? room : plan->largest;
    call->course = course;
    group->kind = EXTEND;
    if (operation->kind == OPERATION_SLOPES) {
        group->kind = SLOPES;
        group->function = (uintptr_t)course->function;
    }
    return 1;
}

/* Whether a course's points can take those of another: they are used as they are there. */
static int courses_fit(const Plan *plan, const Py_buffer *buffers, const Noting *noting)
{
    size_t count = length(buffers, COURSES), room = length(buffers, POINTS);
    if (!is_within(noting->course, 1, count) || !is_within(noting->shown, 1, count)) {
        return 0;
    }
    const Course *from = &plan->courses[noting->course], *to = &plan->courses[noting->shown];
    return from->channel == noting->from && to->channel == noting->to && from->count >= 0 && from->count == to->count &&
           is_within(from->begin, from->count, room) && is_within(to->begin, to->count, room) &&
           points_fit(plan, from, plan->channels[noting->to].count);
}

int resolve_note(const Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    if (!is_within(operation->index, 1, length(buffers, NOTES))) {
        return 0;
    }
    const Noting *noting = (const Noting *)buffers[NOTES].buf + operation->index;
    if (!resolve_channel(plan, buffers, operation, noting->to, group, call) ||
        !resolve_channel(plan, buffers, operation, noting->from, group, call) ||
        plan->channels[noting->to].count != plan->channels[noting->from].count ||
        (noting->course >= 0 && !courses_fit(plan, buffers, noting))) {
        return 0;
    }
    group->kind = NOTE;
    call->noting = noting;
    return 1;
}

int resolve_state(const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    if (operation->kind < OPERATION_SAVE || operation->kind > OPERATION_FORGET ||
        !is_within(operation->index, 1, length(buffers, STATES))) {
        return 0;
    }
    State *state = (State *)buffers[STATES].buf + operation->index;
    const uint64_t functions[] = {state->save, state->restore, state->forget};
    const Kind kinds[] = {SAVE, RESTORE, FORGET};
    group->kind = kinds[operation->kind - OPERATION_SAVE];
    group->function = (uintptr_t)functions[operation->kind - OPERATION_SAVE];
    call->state = state;
    call->component = (void *)(uintptr_t)state->component;
    return group->function != 0;
}

/* Whether a loop's numbers are there, and the values that it compares. */
static int is_sound(const Plan *plan, const Py_buffer *buffers, const Loop *loop)
{
    size_t room = length(buffers, WORK), passed = length(buffers, PASSED);
    if ((loop->kind != CIRCLE && loop->kind != ITERATION) || loop->limit < 1 || (uint64_t)loop->limit > room ||
        loop->method < RELAXED || loop->method > ANDERSON || loop->real_count < 0 || loop->other_count < 0 ||
        loop->guess_count < 0 || loop->guess_count > loop->real_count || !is_within(loop->begin, loop->real_count, passed) ||
        !is_within(loop->begin + loop->real_count, loop->other_count, passed) ||
        !is_within(loop->work, (int64_t)work_of(plan, loop), room)) {
        return 0;
    }
    for (int64_t k = 0; k < loop->real_count + loop->other_count; k++) {
        if (!is_within(plan->passed[loop->begin + k], 1, plan->value_count)) {
            return 0;
        }
    }
    const double *head = plan->work + loop->work;
    return head[COMPARED] >= 0.0 && head[COMPARED] < (double)loop->limit;
}

int resolve_loop(Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    if (plan->thread_count != 1 || !is_within(operation->index, 1, length(buffers, LOOPS))) {
        return 0;
    }
    Loop *loop = &plan->loops[operation->index];
    size_t *groups = &plan->loop_groups[2 * operation->index], next = plan->group_count + 1;
    call->loop = loop;
    group->kind = operation->kind == OPERATION_BEGIN ? BEGIN : operation->kind == OPERATION_MARK ? MARK : END;
    if (group->kind == BEGIN) {
        groups[0] = next;
    } else if (group->kind == MARK) {
        groups[1] = groups[0] > 0 ? next : 0;
    }
    return is_sound(plan, buffers, loop) && (group->kind != END || groups[1] > 0);
}

int are_loops_closed(const Plan *plan, const Py_buffer *buffers)
{
    for (size_t n = 0; n < length(buffers, LOOPS); n++) {
        if (plan->loop_groups[2 * n] > 0 && plan->loop_groups[2 * n + 1] <= plan->loop_groups[2 * n]) {
            return 0;
        }
    }
    return 1;
}
