/* How one side of a lane waits for the other. */

#define _GNU_SOURCE
#include "lane.h"

#if HAS_LANES

#include <linux/futex.h>
#include <sched.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#if defined(__x86_64__) || defined(__i386__)
#define RELAX() __builtin_ia32_pause()
#elif defined(__aarch64__)
#define RELAX() __asm__ volatile("yield")
#else
#define RELAX() ((void)0)
#endif

enum { LOOKS = 32, SHORTEST = 32 };

static int64_t now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static int has_come(Side *other, unsigned old)
{
    return atomic_load_explicit(&other->count, memory_order_acquire) != old;
}

/* Where this side runs; 0 if that is where the other does, which watching for it would keep from running. */
static int has_core_of_its_own(Side *mine, Side *other)
{
    int core = sched_getcpu();
    atomic_store_explicit(&mine->core, core, memory_order_relaxed);
    return core != atomic_load_explicit(&other->core, memory_order_relaxed);
}

int lane_wait(Side *mine, Side *other, unsigned old, Spin *spin, int64_t most)
{
    int64_t begin = now(), passed = 0;
    while (passed < spin->now && passed < most && has_core_of_its_own(mine, other)) {
        for (int k = 0; k < LOOKS; k++) {
            if (has_come(other, old)) {
                return 1;
            }
            RELAX();
        }
        passed = now() - begin;
    }
    atomic_store(&mine->sleeps, 1); /* before it looks again: the other looks here after it has counted */
    while (atomic_load(&other->count) == old && passed < most) {
        struct timespec rest = {.tv_sec = (most - passed) / 1000000000, .tv_nsec = (most - passed) % 1000000000};
        syscall(SYS_futex, &other->count, FUTEX_WAIT, old, &rest, NULL, 0);
        passed = now() - begin;
    }
    atomic_store(&mine->sleeps, 0);
    spin->now = passed < spin->most ? spin->most : spin->most / SHORTEST;
    has_core_of_its_own(mine, other);
    return has_come(other, old);
}

void lane_count(Side *mine, const Side *other, unsigned count)
{
    atomic_store(&mine->count, count);
    if (atomic_load(&other->sleeps)) {
        syscall(SYS_futex, &mine->count, FUTEX_WAKE, 1, NULL, NULL, 0);
    }
}

#endif
