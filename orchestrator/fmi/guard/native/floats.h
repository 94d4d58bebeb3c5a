/* How a thread computes with floating-point numbers, which an FMU may change and must not leave changed. */

#ifndef FLOATS_H
#define FLOATS_H

#include <fenv.h>
#include <stdint.h>
#if defined(__SSE2__) || defined(_M_X64)
#include <xmmintrin.h>
#endif

/* How this thread rounds, how precisely, what it traps, and whether it takes subnormal numbers for zero: in registers that
   cost nothing to read. */
static inline unsigned float_control(void)
{
#if defined(__SSE2__) && defined(__GNUC__)
    unsigned short x87;
    __asm__ volatile("fnstcw %0" : "=m"(x87));
    return (unsigned)x87 << 16 | (_mm_getcsr() & ~0x3fU); /* without the flags of what has happened */
#elif defined(__SSE2__) || defined(_M_X64)
    return _mm_getcsr() & ~0x3fU;
#elif defined(__aarch64__) && defined(__GNUC__)
    uint64_t control;
    __asm__ volatile("mrs %0, fpcr" : "=r"(control));
    return (unsigned)control;
#else
    return (unsigned)fegetround();
#endif
}

#endif
