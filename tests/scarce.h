/* Put before a C file by the compiler (-include), so that tests can let its allocations fail, and the threads it starts:
   `scarce_left` is how many of them are granted before one is refused; negative: all. */

#ifndef SCARCE_H
#define SCARCE_H

#include <errno.h>
#include <stdlib.h>
#include <pthread.h>

__attribute__((weak, visibility("default"))) int scarce_left = -1;

static inline int scarce_refuses(void)
{
    return scarce_left >= 0 && scarce_left-- == 0;
}

static inline void *scarce_malloc(size_t size)
{
    return scarce_refuses() ? NULL : malloc(size);
}

static inline void *scarce_calloc(size_t count, size_t size)
{
    return scarce_refuses() ? NULL : calloc(count, size);
}

static inline int scarce_thread(pthread_t *thread, const pthread_attr_t *how, void *(*work)(void *), void *argument)
{
    return scarce_refuses() ? EAGAIN : pthread_create(thread, how, work, argument);
}

#define malloc scarce_malloc
#define calloc scarce_calloc
#define pthread_create scarce_thread

#endif
