/* Blocks of steps by several threads, where all instances step at once (`jacobi`).

   Of n threads each has a part of the instances: it sets and steps them (part t of the plan), and when all have done that
   it reads them (part n + t). The first one also keeps the books. They meet several times in a step, so they wait
   actively. */

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
    int count;
    int goes_on;
    Advance *steps; /* one for each thread */
    atomic_int gate; /* 0: wait to begin, 1: begin, -1: not all could be started */
    atomic_int waiting;
    atomic_int meeting;
} Team;

typedef struct {
    Team *team;
    Hand hand;
    int number;
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

/* Whether all got through; if not, the outcome is that of the operation that comes first. */
static int all_succeeded(Team *team)
{
    const Advance *worst = NULL;
    for (int n = 0; n < team->count; n++) {
        const Advance *it = &team->steps[n];
        team->outcome.disturber = it->disturber < 0 ? team->outcome.disturber : it->disturber;
        if (it->failed >= 0 && (worst == NULL || it->rank < worst->rank)) {
            worst = it;
        }
    }
    if (worst != NULL) {
        team->outcome.failed = worst->failed;
        team->outcome.status = worst->status;
    }
    return worst == NULL;
}

static void *work(void *argument)
{
    Member *me = argument;
    Team *team = me->team;
    Advance *mine = &team->steps[me->number];
    int gate;
    while ((gate = atomic_load_explicit(&team->gate, memory_order_acquire)) == 0) {
        sched_yield();
    }
    while (gate > 0) {
        if (me->number == 0) {
            Advance next = {0};
            team->goes_on = team->outcome.failed < 0 && has_next(team->block, &team->outcome, &next);
            for (int n = 0; team->goes_on && n < team->count; n++) {
                team->steps[n] = next;
            }
        }
        meet(team);
        if (!team->goes_on) {
            return NULL;
        }
        take_part(&me->hand, me->number, 0, mine);
        meet(team);
        int failed = 0; /* of those who set and step; nobody is read after that */
        for (int n = 0; n < team->count; n++) {
            failed |= team->steps[n].failed >= 0;
        }
        meet(team);
        if (!failed) {
            take_part(&me->hand, team->count + me->number, 0, mine);
        }
        meet(team);
        if (me->number == 0 && all_succeeded(team)) {
            finish_step(team->plan, team->block, mine, &team->outcome);
        }
    }
    return NULL;
}

int take_block_together(Plan *plan, const Hand *hands, const Block *block, Outcome *outcome)
{
    int count = plan->thread_count, started = 1;
    Team team = {.plan = plan, .block = block, .outcome = outcome_of(block), .count = count};
    Member *members = calloc((size_t)count, sizeof *members);
    team.steps = calloc((size_t)count, sizeof *team.steps);
    int is_fine = members != NULL && team.steps != NULL;
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
    free(team.steps);
    return is_fine;
}

#else

typedef int no_threads; /* a file must not be empty */

#endif
