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

/* What an operation is: FMI 3.0 has more arguments where values are set and read, for a step and for derivatives. */
enum { SET, SET_3, STEP, STEP_3, GET, GET_3, SET_SLOPES, ASK, ASK_3, SAVE, RESTORE, FORGET, N_KINDS };

/* In the place of the status of a step of FMI 3.0 that ended early, or with the simulation: this, and its status. */
enum { CUT_SHORT = 1001 };

typedef struct {
    uint32_t instance; /* of the lane, */
    uint32_t what;     /* one of its operations; or READ all that it gives, or LEAVE the lane */
    double time;       /* of a step, s */
    double length;
    uint64_t is_final; /* whether no state from before it will be restored */
} Entry;

/* What one side writes, into a line of the cache of its own. */
typedef struct {
    atomic_uint count; /* of the entries that the master has posted, or the host has come to the end of */
    atomic_uint sleeps;
    atomic_int core; /* on which it was seen to run last */
    char apart[64 - 3 * sizeof(atomic_uint)];
} Side;

/* In the shared memory. */
typedef struct {
    Side master;
    Side host;
    Entry entries[RING];
} Lane;

/* Words of 64 bits at the head of an instance's memory: see messages.py. */
enum { NOTE_CALL = 0, NOTE_FAILED = 4, NOTE_STATUS = 5 };

/* Derivatives of inputs in the memory: how many there are, then room for so many values, references and orders. */
typedef struct {
    int64_t *count;
    double *values;
    unsigned *references;
    int *orders;
} Slopes;

static inline int is_get(int64_t kind)
{
    return kind == GET || kind == GET_3;
}

static inline int is_ask(int64_t kind)
{
    return kind == ASK || kind == ASK_3;
}

static inline int is_step(int64_t kind)
{
    return kind == STEP || kind == STEP_3;
}

static inline Slopes slopes_in(void *memory, size_t room)
{
    double *values = (double *)memory + 1;
    unsigned *references = (unsigned *)(values + room);
    return (Slopes){memory, values, references, (int *)(references + room)};
}

/* What is asked for directional derivatives in the memory, and the answer: the status that it has, how many references
   of unknowns, of inputs, seeds and slopes there are, then room for so many seeds, slopes, and references of either. */
typedef struct {
    int64_t *status;
    int64_t *counts;
    double *seeds, *slopes;
    unsigned *unknowns, *knowns;
} Question;

enum { N_COUNTS = 4, QUESTION_HEAD = 1 + N_COUNTS };

static inline Question question_in(void *memory, size_t room)
{
    double *seeds = (double *)memory + QUESTION_HEAD;
    unsigned *unknowns = (unsigned *)(seeds + 2 * room);
    return (Question){memory, (int64_t *)memory + 1, seeds, seeds + room, unknowns, unknowns + room};
}

/* How long somebody watches before it sleeps: as long as it may where the last wait was a short one, else hardly; and not at
   all where the other needs the same core. */
typedef struct {
    int64_t most; /* ns */
    int64_t now;
} Spin;

#pragma GCC visibility push(hidden)

/* Wait until the count of the other side is another than `old`; 0 if it still is after so many ns. */
int lane_wait(Side *mine, Side *other, unsigned old, Spin *spin, int64_t most);

/* Change one's count, and wake the other if it sleeps. */
void lane_count(Side *mine, const Side *other, unsigned count);

#pragma GCC visibility pop

#endif
#endif
