/* Where an FMU that wants to end the process gets to instead: functions of ours, which take the places of exit and its kin
   in the tables through which its library calls others.

   Each loaded library has such a table of its own, so that nobody else is concerned. A process that the FMU has forked ends
   as it likes, and so does a thread that it has started, by pthread_exit. An end that no table shows (of err(), say, or
   what libraries call that were there before) is met by a function that C calls at the end of the process. */

#define _GNU_SOURCE
#include "hooks.h"

#if defined(__linux__) && defined(__GLIBC__) && (defined(__x86_64__) || defined(__aarch64__))

#include <link.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <threads.h>
#include <unistd.h>

#ifdef __x86_64__
enum { IS_CALLED = R_X86_64_JUMP_SLOT, IS_KNOWN = R_X86_64_GLOB_DAT, IS_KEPT = R_X86_64_64 };
#else
enum { IS_CALLED = R_AARCH64_JUMP_SLOT, IS_KNOWN = R_AARCH64_GLOB_DAT, IS_KEPT = R_AARCH64_ABS64 };
#endif

enum { FAILED = 3, PATIENCE = 20 };

static pid_t owner;

static int is_child(void)
{
    return getpid() != owner;
}

static void end_process(Way way, int code)
{
    static const char last_words[] = "error: an FMU has ended the process\n";
    static atomic_flag ends = ATOMIC_FLAG_INIT;
    while (atomic_flag_test_and_set(&ends)) { /* another thread is at it */
        pause();
    }
    signal(SIGALRM, SIG_DFL);
    alarm(PATIENCE);
    if (!guard_say(way, code)) {
        (void)!write(2, last_words, sizeof last_words - 1);
    }
    _exit(FAILED);
}

static void leave(Way way, int code)
{
    guard_leave(way, code);
    end_process(way, code);
}

static void hooked_exit(int code)
{
    if (is_child()) {
        exit(code);
    }
    leave(BY_EXIT, code);
}

static void hooked_exit_at_once(int code)
{
    if (is_child()) {
        _exit(code);
    }
    leave(BY_EXIT_AT_ONCE, code);
}

static void hooked_quick_exit(int code)
{
    if (is_child()) {
        quick_exit(code);
    }
    leave(BY_QUICK_EXIT, code);
}

static void hooked_abort(void)
{
    if (!is_child()) {
        guard_leave(BY_ABORT, 0);
    }
    abort();
}

static void hooked_pthread_exit(void *result)
{
    if (!is_child()) {
        guard_leave(BY_THREAD_EXIT, 0);
    }
    pthread_exit(result);
}

static void hooked_thrd_exit(int result)
{
    if (!is_child()) {
        guard_leave(BY_THREAD_EXIT, 0);
    }
    thrd_exit(result);
}

/* Python's own. */
static void hooked_exit_of_python(int code)
{
    if (!is_child() && guard_is_in_run()) {
        end_process(BY_EXIT_AT_ONCE, code);
    }
    _exit(code);
}

typedef struct {
    const char *name;
    void (*function)(void);
} Hook;

#define HOOK(name, function) {name, (void (*)(void))(function)}
static const Hook hooks_of_fmus[] = {
    HOOK("exit", hooked_exit), HOOK("_exit", hooked_exit_at_once), HOOK("_Exit", hooked_exit_at_once),
    HOOK("quick_exit", hooked_quick_exit), HOOK("abort", hooked_abort), HOOK("pthread_exit", hooked_pthread_exit),
    HOOK("thrd_exit", hooked_thrd_exit), {NULL, NULL},
};
static const Hook hooks_of_python[] = {HOOK("_exit", hooked_exit_of_python), {NULL, NULL}};

/* ---------------------------------------------------------------------------------------------- a library's own table */

typedef struct {
    const ElfW(Sym) *symbols;
    const char *names;
    const ElfW(Rela) *calls, *others;
    size_t call_count, other_count;
    uintptr_t sealed, sealed_end; /* what is made read-only once it is filled in */
} Tables;

static Tables tables_of(const struct dl_phdr_info *it)
{
    Tables found = {0};
    for (int k = 0; k < it->dlpi_phnum; k++) {
        const ElfW(Phdr) *part = &it->dlpi_phdr[k];
        uintptr_t begin = it->dlpi_addr + part->p_vaddr;
        if (part->p_type == PT_GNU_RELRO) {
            found.sealed = begin;
            found.sealed_end = begin + part->p_memsz;
        }
        if (part->p_type != PT_DYNAMIC) {
            continue;
        }
        for (const ElfW(Dyn) *entry = (const ElfW(Dyn) *)begin; entry->d_tag != DT_NULL; entry++) {
            uintptr_t value = entry->d_un.d_ptr;
            uintptr_t place = value < it->dlpi_addr ? value + it->dlpi_addr : value; /* the loader has added it, mostly */
            switch (entry->d_tag) {
            case DT_SYMTAB: found.symbols = (const ElfW(Sym) *)place; break;
            case DT_STRTAB: found.names = (const char *)place; break;
            case DT_JMPREL: found.calls = (const ElfW(Rela) *)place; break;
            case DT_PLTRELSZ: found.call_count = value / sizeof(ElfW(Rela)); break;
            case DT_RELA: found.others = (const ElfW(Rela) *)place; break;
            case DT_RELASZ: found.other_count = value / sizeof(ElfW(Rela)); break;
            default: break;
            }
        }
    }
    return found;
}

static void put(const Tables *tables, uintptr_t place, void (*function)(void))
{
    uintptr_t size = (uintptr_t)sysconf(_SC_PAGESIZE), page = place & ~(size - 1);
    if (mprotect((void *)page, size, PROT_READ | PROT_WRITE) == 0) {
        *(void (**)(void))place = function;
        if (place >= tables->sealed && place < tables->sealed_end) {
            mprotect((void *)page, size, PROT_READ);
        }
    }
}

static const char *name_of(const Tables *tables, const ElfW(Rela) *entry)
{
    unsigned long kind = ELF64_R_TYPE(entry->r_info);
    int is_address = kind == IS_CALLED || kind == IS_KNOWN || (kind == IS_KEPT && entry->r_addend == 0);
    return is_address ? tables->names + tables->symbols[ELF64_R_SYM(entry->r_info)].st_name : "";
}

static void hook(const struct dl_phdr_info *it, const Tables *tables, const Hook *hooks)
{
    const ElfW(Rela) *lists[] = {tables->calls, tables->others};
    size_t counts[] = {tables->call_count, tables->other_count};
    for (int n = 0; n < 2; n++) {
        for (size_t k = 0; lists[n] != NULL && k < counts[n]; k++) {
            const char *name = name_of(tables, &lists[n][k]);
            for (const Hook *each = hooks; each->name != NULL; each++) {
                if (strcmp(name, each->name) == 0) {
                    put(tables, it->dlpi_addr + lists[n][k].r_offset, each->function);
                }
            }
        }
    }
}

static int uses_python(const Tables *tables)
{
    for (size_t k = 0; tables->calls != NULL && k < tables->call_count; k++) {
        if (strncmp(name_of(tables, &tables->calls[k]), "Py", 2) == 0) {
            return 1;
        }
    }
    return 0;
}

typedef struct {
    int seen, known;
} Round;

static int hook_if_new(struct dl_phdr_info *it, size_t size, void *context)
{
    Round *round = context;
    (void)size;
    if (round->seen++ >= round->known) {
        Tables tables = tables_of(it);
        /* What uses the interpreter must not be left by a long jump, which would leave that in disorder. */
        if (tables.symbols != NULL && tables.names != NULL && !uses_python(&tables)) {
            hook(it, &tables, hooks_of_fmus);
        }
    }
    return 0;
}

int hooks_watch(int count)
{
    Round round = {0, count};
    dl_iterate_phdr(hook_if_new, &round);
    return round.seen;
}

/* ------------------------------------------------------------------------------------------- the end of the process */

static void at_exit(int code, void *nothing)
{
    (void)nothing;
    if (!is_child() && guard_is_in_run()) {
        end_process(BY_EXIT, code);
    }
}

static void at_quick_exit_(void)
{
    if (!is_child() && guard_is_in_run()) {
        end_process(BY_QUICK_EXIT, 0);
    }
}

static int hook_python(struct dl_phdr_info *it, size_t size, void *place)
{
    (void)size;
    for (int k = 0; k < it->dlpi_phnum; k++) {
        const ElfW(Phdr) *part = &it->dlpi_phdr[k];
        uintptr_t begin = it->dlpi_addr + part->p_vaddr;
        if (part->p_type == PT_LOAD && (uintptr_t)place >= begin && (uintptr_t)place < begin + part->p_memsz) {
            Tables tables = tables_of(it);
            hook(it, &tables, hooks_of_python);
            return 1;
        }
    }
    return 0;
}

void hooks_belong_here(void)
{
    owner = getpid();
}

void hooks_begin(void)
{
    hooks_belong_here();
    on_exit(at_exit, NULL);
    at_quick_exit(at_quick_exit_);
    dl_iterate_phdr(hook_python, guard_place_in_python());
}

#else

void hooks_begin(void) {}
void hooks_belong_here(void) {}
int hooks_watch(int count)
{
    return count;
}

#endif
