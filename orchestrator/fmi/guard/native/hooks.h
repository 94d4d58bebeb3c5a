/* What the two files of the guard share. */

#ifndef HOOKS_H
#define HOOKS_H

#include "guard.h"

#include <math.h>
#include <stddef.h>

#ifdef __GNUC__
#pragma GCC visibility push(hidden)
#endif

/* How an FMU leaves; `WAYS` in notes.py has the words. */
typedef enum { RETURNED, BY_EXIT, BY_EXIT_AT_ONCE, BY_QUICK_EXIT, BY_ABORT, BY_THREAD_EXIT } Way;

Note *guard_note(int number);
int guard_safely(void (*work)(void *), void *context, int *code);

/* Whether this thread is in a run. */
int guard_is_in_run(void);

/* Leave the call that is under way; comes back where it was not begun by `safely`. */
void guard_leave(Way way, int code);

/* Let Python have its say before the process ends; 0 where it is not there any more. */
int guard_say(Way way, int code);

/* Some place in the library, or program, that Python is. */
void *guard_place_in_python(void);

/* Watch over the end of the process. */
void hooks_begin(void);

/* It is this process that is watched over. */
void hooks_belong_here(void);

/* Watch over the libraries that were loaded after the first `count`; how many there are. */
int hooks_watch(int count);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
