/* The lane between the master and the process of isolated instances: calls of FMUs through shared memory.

   The master posts entries into a ring, the host does them in their order and counts what is done. Whoever has nothing to
   do watches the other's count for a while, and then sleeps until it is woken by it: on idle cores a hand-over takes a
   fraction of a microsecond, and a core that somebody else could use is not kept for long. Values stand in memory that both
   map, at places of their own. */

#ifndef LANE_H
#define LANE_H

#ifdef __linux__
#define HAS_LANES 1
#else
#define HAS_LANES 0
#endif

#if HAS_LANES

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

enum { RING = 256 };

/* What an entry says, beside the number of an operation. */
enum { READ = 0xfffffffe, LEAVE = 0xffffffff };

enum { SET_REALS, SET_INTEGERS, STEP, GET_REALS, GET_INTEGERS, N_KINDS };

typedef struct {
    uint32_t instance; /* of the lane, */
    uint32_t what;     /* one of its operations; or READ all that it gives, or LEAVE the lane */
    double time;       /* of a step, s */
    double length;
} Entry;

/* In the shared memory: each side writes into a line of the cache of its own. */
typedef struct {
    atomic_uint posted; /* entries so far, by the master */
    atomic_uint master_sleeps;
    char apart[64 - 2 * sizeof(atomic_uint)];
    atomic_uint done; /* and those that the host has come to the end of */
    atomic_uint host_sleeps;
    char apart_too[64 - 2 * sizeof(atomic_uint)];
    Entry entries[RING];
} Lane;

/* Words of 64 bits at the head of an instance's memory: see messages.py. */
enum { NOTE_CALL = 0, NOTE_FAILED = 4, NOTE_STATUS = 5 };

/* How long somebody watches before it sleeps: as long as it may where the last wait was a short one, else hardly. */
typedef struct {
    int64_t most; /* ns */
    int64_t now;
} Spin;

#pragma GCC visibility push(hidden)

/* Wait until a count of the other side's is another than `old`; 0 if it still is after so many ns. */
int lane_wait(atomic_uint *count, unsigned old, atomic_uint *sleeps, Spin *spin, int64_t most);

/* Raise a count, and wake the other if it sleeps. */
void lane_count(atomic_uint *count, unsigned value, atomic_uint *sleeps);

#pragma GCC visibility pop

#endif
#endif
