/* Blocks of steps by several threads, where all instances step at once (`jacobi`).

   Of n threads each has a part of the instances: it sets and steps them (part t of the plan), and when all have done that
   it reads them (part n + t). The first one also keeps the books. They meet three times in a step, so they wait actively.

   Where one fails the others go on to the end of what they set and step: which of several failures is told is decided
   by who knows their order. */

#include "kernel.h"

#if HAS_THREADS

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>

typedef struct {
    Plan *plan;
    const Block *block;
    Outcome outcome;
    Advance step;
    int count;
    int is_begun;
    int goes_on;
    atomic_int is_left; /* whether a thread has not set and stepped all that it has to */
    atomic_int gate; /* 0: wait to begin, 1: begin, -1: not all could be started */
    atomic_int waiting;
    atomic_int meeting;
} Team;

typedef struct {
    Team *team;
    Hand hand;
    int number;
    int part; /* of the step that it takes */
    pthread_t thread;
} Member;

enum { SPINS = 4000 };

static void meet(Team *team)
{
    int meeting = atomic_load_explicit(&team->meeting, memory_order_relaxed);
    if (atomic_fetch_add_explicit(&team->waiting, 1, memory_order_acq_rel) == team->count - 1) {
        atomic_store_explicit(&team->waiting, 0, memory_order_relaxed);
        atomic_store_explicit(&team->meeting, meeting + 1, memory_order_release);
        return;
    }
    for (int n = 0; atomic_load_explicit(&team->meeting, memory_order_acquire) == meeting; n++) {
        if (n > SPINS) {
            sched_yield();
        }
    }
}

/* The first thread's, while the others wait: end the step that was under way, and begin the next; 0 if there is none. */
static int turn_over(Team *team)
{
    for (int n = 0; team->is_begun && n < team->count; n++) {
        if (team->block->places[n].failed >= 0) {
            return 0;
        }
    }
    if (team->is_begun) {
        finish_step(team->plan, team->block, &team->step, &team->outcome);
    }
    team->is_begun = 1;
    return has_next(team->block, &team->outcome, &team->step);
}

static void take_guarded(void *context)
{
    Member *me = context;
    take_part(&me->hand, me->part, &me->team->step, &me->team->block->places[me->number]);
}

/* A part of the step; one that an FMU leaves has failed. */
static void take_safely(Member *me, int part)
{
    me->part = part;
    int code = 0, way = guard.safely(take_guarded, me, &code);
    if (way != 0) {
        note_failure(&me->hand, &me->team->block->places[me->number], way, code);
    }
}

static void *work(void *argument)
{
    Member *me = argument;
    Team *team = me->team;
    Place *mine = &team->block->places[me->number];
    me->hand.note = guard.note(me->number);
    while (atomic_load_explicit(&team->gate, memory_order_acquire) == 0) {
        sched_yield();
    }
    while (atomic_load_explicit(&team->gate, memory_order_relaxed) > 0) {
        if (me->number == 0) {
            team->goes_on = turn_over(team);
        }
        meet(team);
        if (!team->goes_on) {
            return NULL;
        }
        if (mine->failed < 0) {
            take_safely(me, me->number);
        }
        if (mine->failed >= 0) { /* nobody is read before this has been helped */
            atomic_store_explicit(&team->is_left, 1, memory_order_relaxed);
        }
        meet(team);
        if (!atomic_load_explicit(&team->is_left, memory_order_relaxed)) {
            take_safely(me, team->count + me->number);
        }
        meet(team);
    }
    return NULL;
}

int take_block_together(Plan *plan, const Hand *hands, const Block *block, Outcome *outcome)
{
    int count = plan->thread_count, started = 1;
    Team team = {.plan = plan, .block = block, .outcome = outcome_of(block), .count = count};
    Member *members = calloc((size_t)count, sizeof *members);
    int is_fine = members != NULL;
    for (int n = 0; is_fine && n < count; n++) {
        members[n] = (Member){.team = &team, .hand = hands[n], .number = n};
    }
    while (is_fine && started < count) {
        is_fine = pthread_create(&members[started].thread, NULL, work, &members[started]) == 0;
        started += is_fine;
    }
    atomic_store_explicit(&team.gate, is_fine ? 1 : -1, memory_order_release);
    if (is_fine) {
        work(&members[0]);
        *outcome = team.outcome;
    }
    for (int n = 1; members != NULL && n < started; n++) {
        pthread_join(members[n].thread, NULL);
    }
    free(members);
    return is_fine;
}

#else

typedef int no_threads; /* a file must not be empty */

#endif
