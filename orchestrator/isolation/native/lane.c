/* How one side of a lane waits for the other. */

#define _GNU_SOURCE
#include "lane.h"

#if HAS_LANES

#include <linux/futex.h>
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

static int has_come(atomic_uint *count, unsigned old)
{
    return atomic_load_explicit(count, memory_order_acquire) != old;
}

int lane_wait(atomic_uint *count, unsigned old, atomic_uint *sleeps, Spin *spin, int64_t most)
{
    int64_t begin = now(), passed = 0;
    while (passed < spin->now && passed < most) {
        for (int k = 0; k < LOOKS; k++) {
            if (has_come(count, old)) {
                return 1;
            }
            RELAX();
        }
        passed = now() - begin;
    }
    atomic_store(sleeps, 1); /* before it looks again: the other looks here after it has counted */
    while (atomic_load(count) == old && passed < most) {
        struct timespec rest = {.tv_sec = (most - passed) / 1000000000, .tv_nsec = (most - passed) % 1000000000};
        syscall(SYS_futex, count, FUTEX_WAIT, old, &rest, NULL, 0);
        passed = now() - begin;
    }
    atomic_store(sleeps, 0);
    spin->now = passed < spin->most ? spin->most : spin->most / SHORTEST;
    return has_come(count, old);
}

void lane_count(atomic_uint *count, unsigned value, atomic_uint *sleeps)
{
    atomic_store(count, value);
    if (atomic_load(sleeps)) {
        syscall(SYS_futex, count, FUTEX_WAKE, 1, NULL, NULL, 0);
    }
}

#endif
