/* The master's side of a lane: functions that the compiled step loop calls like those of an FMU.

   What stands for the FMU's instance is an operation of ours. What is set or stepped is posted and not waited for; what is
   read was read by the host after the step, in one go. So a step of an instance is one hand-over, and instances in several
   processes step at the same time where nothing is read between. A call that failed is told by one that comes after.
   Waited for are only derivatives, which an FMU may refuse, what an FMU is asked that gives nothing, and what comes last in a
   step that was repeated: a state that is restored for good, and those that are given back. What does not come within a moment Python waits for, who
   knows how long a call may take, and whether the run is to stop. */

#include "riding.h"

#if HAS_LANES

#include <poll.h>
#include <string.h>

enum { SLICE = 10 * 1000 * 1000 }; /* ns between two looks at the line to the process */

int is_done(const Lane *lane, uint32_t ticket, uint32_t *seen)
{
    *seen = atomic_load_explicit(&((Lane *)lane)->host.count, memory_order_acquire);
    return (int32_t)(*seen - ticket) >= 0;
}

int await(LaneObject *road, uint32_t ticket, int64_t most)
{
    uint32_t seen;
    if (!is_done(road->lane, ticket, &seen)) { /* it may have been posted without waking the host */
        lane_count(&road->lane->master, &road->lane->host, atomic_load(&road->lane->master.count));
    }
    while (!is_done(road->lane, ticket, &seen)) {
        int64_t slice = most < SLICE ? most : SLICE;
        if (lane_wait(&road->lane->master, &road->lane->host, seen, &road->spin, slice)) {
            continue;
        }
        struct pollfd line = {.fd = road->line};
        if (poll(&line, 1, 0) > 0 && !is_done(road->lane, ticket, &seen)) {
            return CLOSED;
        }
        most -= slice;
        if (most <= 0) {
            return CAME_NOT;
        }
    }
    return CAME;
}

int post(LaneObject *road, Entry entry, int wakes, uint32_t *ticket)
{
    Lane *lane = road->lane;
    uint32_t count = atomic_load_explicit(&lane->master.count, memory_order_relaxed);
    if (await(road, count - (RING - 1), road->moment) != CAME) {
        return 0;
    }
    lane->entries[count % RING] = entry;
    *ticket = count + 1;
    if (wakes) {
        lane_count(&lane->master, &lane->host, count + 1);
    } else {
        atomic_store_explicit(&lane->master.count, count + 1, memory_order_release);
    }
    return 1;
}

static int64_t note_of(const RiderObject *rider, int which)
{
    const int64_t *notes = (const int64_t *)((char *)rider->road->memory.buf + rider->head);
    return __atomic_load_n(notes + which, __ATOMIC_RELAXED);
}

static char *values_of(const Seat *seat)
{
    return (char *)seat->rider->road->memory.buf + seat->offset;
}

/* The status of what is done: that of what failed, unless that was only read after this. */
static int status_of(const Seat *seat)
{
    int64_t failed = note_of(seat->rider, NOTE_FAILED);
    return failed == 0 || failed > (int64_t)seat->number + 1 ? 0 : (int)note_of(seat->rider, NOTE_STATUS);
}

/* Whether so many entries are done; 0 where they are not waited for any more, and the lane may be closed. */
static int wait_for(const RiderObject *rider, uint32_t ticket)
{
    LaneObject *road = rider->road;
    while (await(road, ticket, road->moment) != CAME) {
        if (!road->goes_on(road, rider->number)) {
            return 0;
        }
    }
    return 1;
}

/* Post an operation as soon as there is room; 0 as above. */
static int ask_for(Seat *seat, Entry entry, int wakes)
{
    LaneObject *road = seat->rider->road;
    while (!post(road, entry, wakes, &seat->posted)) {
        if (!road->goes_on(road, seat->rider->number)) {
            return 0;
        }
    }
    return 1;
}

static size_t size_of(const Seat *seat)
{
    return (size_t)(seat->count * seat->width);
}

static int carry_out(Seat *seat, Entry entry)
{
    return ask_for(seat, entry, 1) && wait_for(seat->rider, seat->posted) ? status_of(seat) : SILENT;
}

static int set(void *component, const unsigned *references, size_t count, const void *values)
{
    Seat *seat = component;
    RiderObject *rider = seat->rider;
    Entry entry = {.instance = rider->number, .what = seat->number};
    (void)references;
    (void)count;
    if (!wait_for(rider, seat->posted)) { /* the host may still be reading there */
        return SILENT;
    }
    memcpy(values_of(seat), values, size_of(seat));
    rider->is_read = 0;
    return !rider->gives ? carry_out(seat, entry) : ask_for(seat, entry, 0) ? 0 : SILENT;
}

static int set_3(void *component, const unsigned *references, size_t count, const void *values, size_t value_count)
{
    (void)value_count;
    return set(component, references, count, values);
}

/* Of every version: what a step of FMI 3.0 tells beside its status stays with the host, but that it was cut short. */
static int step(void *component, double time, double length, int is_final)
{
    Seat *seat = component;
    RiderObject *rider = seat->rider;
    Entry entry = {rider->number, seat->number, time, length, (uint64_t)is_final};
    if (!ask_for(seat, entry, 1)) {
        return SILENT;
    }
    rider->time = time;
    rider->length = length;
    rider->wanted = rider->stepped = seat->posted;
    rider->is_back = 0;
    rider->is_read = 1;
    return rider->gives ? 0 : wait_for(rider, seat->posted) ? status_of(seat) : SILENT;
}

static int set_slopes(void *component, const unsigned *references, size_t count, const int *orders,
                      const double *values)
{
    RiderObject *rider = ((Seat *)component)->rider; /* what stands for the instance is what sets these inputs */
    Seat *seat = rider->slopes;
    Slopes to = slopes_in(values_of(seat), (size_t)seat->count);
    *to.count = (int64_t)count;
    memcpy(to.values, values, count * sizeof *values);
    memcpy(to.references, references, count * sizeof *references);
    memcpy(to.orders, orders, count * sizeof *orders);
    rider->is_read = 0;
    return carry_out(seat, (Entry){.instance = rider->number, .what = seat->number});
}

/* One that is refused has failed of nothing: the slopes are found in another way. */
static int ask_3(void *component, const unsigned *unknowns, size_t count, const unsigned *knowns, size_t known_count,
                 const double *seeds, size_t seed_count, double *slopes, size_t slope_count)
{
    Seat *seat = component;
    Question of = question_in(values_of(seat), (size_t)seat->count);
    const size_t counts[] = {count, known_count, seed_count, slope_count};
    for (int k = 0; k < N_COUNTS; k++) {
        of.counts[k] = (int64_t)counts[k];
    }
    memcpy(of.unknowns, unknowns, count * sizeof *unknowns);
    memcpy(of.knowns, knowns, known_count * sizeof *knowns);
    memcpy(of.seeds, seeds, seed_count * sizeof *seeds);
    int status = carry_out(seat, (Entry){.instance = seat->rider->number, .what = seat->number});
    if (status != 0) {
        return status;
    }
    memcpy(slopes, of.slopes, slope_count * sizeof *slopes);
    return (int)*of.status;
}

static int ask(void *component, const unsigned *unknowns, size_t count, const unsigned *knowns, size_t known_count,
               const double *seeds, double *slopes)
{
    return ask_3(component, unknowns, count, knowns, known_count, seeds, known_count, slopes, count);
}

/* Post one of the operations on a state, by how many numbers it stands behind that which saves it. */
static Entry of_state(const Seat *seat, uint32_t which)
{
    seat->rider->left = seat->rider->time + seat->rider->length;
    return (Entry){.instance = seat->rider->number, .what = seat->number + which};
}

static int save(void *component, void **handle)
{
    Seat *seat = component;
    if (!ask_for(seat, of_state(seat, 0), 0)) {
        return SILENT;
    }
    *handle = (void *)(uintptr_t)(seat->number + 1);
    return 0;
}

static int restore(void *component, void *handle)
{
    Seat *seat = component;
    (void)handle;
    if (!ask_for(seat, of_state(seat, 1), 0)) {
        return SILENT;
    }
    seat->rider->is_back = 1;
    seat->rider->is_read = 0;
    return 0;
}

static int restore_now(void *component, void *handle)
{
    Seat *seat = component;
    (void)handle;
    seat->rider->is_back = 1;
    seat->rider->is_read = 0;
    return carry_out(seat, of_state(seat, 1));
}

static int forget(void *component, void **handle)
{
    *handle = NULL;
    return carry_out(component, of_state(component, 2));
}

static int get(void *component, const unsigned *references, size_t count, void *values)
{
    Seat *seat = component;
    RiderObject *rider = seat->rider;
    (void)references;
    (void)count;
    if (!rider->is_read) {
        if (!ask_for(seat, (Entry){.instance = rider->number, .what = READ}, 1)) {
            return SILENT;
        }
        rider->wanted = seat->posted;
        rider->is_read = 1;
    }
    if (!wait_for(rider, rider->wanted)) {
        return SILENT;
    }
    int status = status_of(seat);
    if (status == 0) {
        memcpy(values, values_of(seat), size_of(seat));
    }
    return status;
}

static int get_3(void *component, const unsigned *references, size_t count, void *values, size_t value_count)
{
    (void)value_count;
    return get(component, references, count, values);
}

void *const lane_functions[N_FUNCTIONS] = {
    [SET] = (void *)set, [SET_3] = (void *)set_3, [STEP] = (void *)step, [STEP_3] = (void *)step,
    [GET] = (void *)get, [GET_3] = (void *)get_3, [SET_SLOPES] = (void *)set_slopes, [ASK] = (void *)ask,
    [ASK_3] = (void *)ask_3, [SAVE] = (void *)save, [RESTORE] = (void *)restore, [FORGET] = (void *)forget,
    [RESTORE_NOW] = (void *)restore_now,
};

#endif
