/* What the files of the compiled step loop share: the plan, and the block of steps that is taken with it. */

#ifndef KERNEL_H
#define KERNEL_H

#ifdef _WIN32
#define HAS_THREADS 0
#else
#define HAS_THREADS 1
#endif

#include "../../fmi/binding/native/step3.h"
#include "../../fmi/guard/native/floats.h"
#include "../../fmi/guard/native/guard.h"
#include "algebraic/solver.h"
#include "loops.h"

#include <stddef.h>
#include <stdint.h>

enum {
    OPERATION_SET = 0, OPERATION_STEP = 1, OPERATION_GET = 2, OPERATION_CHANGE = 3,
    OPERATION_READ = 4,   /* get what need not be finite, */
    OPERATION_LOOK = 5,   /* and look whether it is */
    OPERATION_STAMP = 6,  /* note what time values that were read belong to */
    OPERATION_EXTEND = 7, /* set inputs that go on during a step, */
    OPERATION_SLOPES = 8, /* and their derivatives */
    OPERATION_BEGIN = 9, OPERATION_MARK = 10, OPERATION_END = 11, /* what is repeated: see `Loop` */
    OPERATION_SAVE = 12, OPERATION_RESTORE = 13, OPERATION_FORGET = 14, /* states */
    OPERATION_NOTE = 15, /* inputs that have been set */
    OPERATION_SOLVE = 16, OPERATION_ASK = 17, /* algebraic loops, and for derivatives: see `Solver` */
};

enum { AS_IT_IS = 0, TRUE_ABOVE = 1, ROUNDED_UP = 2 };

/* What a value is among the others: a number, or the bits of a whole number of 64 bits, or the number of a text. */
enum { NUMBER = 0, SIGNED_BITS = 1, UNSIGNED_BITS = 2, TEXT = 3 };

typedef union {
    double number;
    int64_t whole;
    uint64_t natural;
} Cell;

/* The types of FMI 3.0, and some of FMI 1.0 and 2.0; 0 is that of any other channel of theirs. */
enum {
    TYPE_FLOAT64 = 1, TYPE_FLOAT32 = 2, TYPE_INT8 = 3, TYPE_UINT8 = 4, TYPE_INT16 = 5, TYPE_UINT16 = 6, TYPE_INT32 = 7, TYPE_UINT32 = 8, TYPE_INT64 = 9, TYPE_UINT64 = 10,
    TYPE_BOOLEAN = 11, TYPE_BYTE = 12, /* a truth value of FMI 1.0 */
    TYPE_TEXT = 13, /* of FMI 1.0 or 2.0 */
    TYPE_TEXT_3 = 14,
};

/* ------------------------------------------------------------------------------------- the plan, as Python writes it */

typedef struct {
    uint64_t function;  /* address of fmi2SetReal, fmi2GetInteger, ... */
    uint64_t component; /* address of the instance */
    int64_t begin;      /* first of its entries */
    int64_t count;      /* number of its entries */
    int64_t is_real;
    int64_t type;            /* one of those above */
    int64_t reference_count; /* of FMI 3.0: an array has one for all its elements; what is left of `count` is no reference */
} Channel;

typedef struct {
    uint64_t function; /* address of fmi2DoStep, or of fmi3DoStep */
    uint64_t component;
    uint64_t told; /* address of what fmi3DoStep tells; 0: it is fmi2DoStep */
} Instance;

typedef struct {
    int64_t place;  /* among the values; the outputs of a channel stand side by side */
    int64_t age;    /* how many recorded points back to read; -1: the live value */
    int64_t change; /* what events may do to it on the way; -1: nothing */
    double scale;
    double offset;
    int64_t whole; /* what the threshold makes of it: of a truth value read, 1 or 0 */
    double threshold;
    int64_t form; /* of the value that it reads */
} Entry;

/* What an event makes of a value, while it is active; `place` is that of an output. */
typedef struct {
    int64_t active;
    int64_t place;
    int64_t is_real;
    double scale;
    double offset;
    double slope;
    double since;
} Change;

typedef struct {
    int32_t kind;
    int32_t index;  /* of the channel, instance, change, course, loop, state, solver or party */
    int32_t period; /* it is due in every so manyth step, */
    int32_t phase;  /* in those with this rest */
    int32_t is_watched; /* whether it may change how numbers are rounded */
    int32_t is_late;    /* what is set is of the step's end; a step is not the last word: a state may be restored */
} Operation;

/* The last values of an input, and the times that they belong to, newest last. */
typedef struct {
    double times[3];
    double values[3];
    double slopes[2]; /* its derivatives over the coming step */
    int64_t count;
    int64_t place;     /* in its channel */
    int64_t reference; /* value reference */
} Points;

/* Inputs of a channel that go on during a step: polynomials through their last values. */
typedef struct {
    uint64_t function; /* address of fmi2SetRealInputDerivatives */
    int64_t channel;
    int64_t begin; /* first of its points */
    int64_t count; /* number of its inputs that go on */
    int64_t depth; /* former values that are kept */
    int64_t order; /* of the polynomials, at most `depth`; 0: the FMU takes no derivatives */
    int64_t at;    /* the time that values belong to, and are kept of */
} Course;

enum { AT_STAMP = 0, AT_END = 1, /* of the step; */ AS_NOTED = 2 /* points are there, and none is kept */ };

/* Inputs that are set go to the places of another channel's entries, and the points of a course to those of another. */
typedef struct {
    int64_t from, to;      /* channels */
    int64_t course, shown; /* courses, or -1 */
} Noting;

/* The saved state of an instance. */
typedef struct {
    uint64_t save, restore, forget; /* addresses of fmi2GetFMUstate, fmi2SetFMUstate, fmi2FreeFMUstate */
    uint64_t component;
    uint64_t handle; /* that the FMU gave; 0 */
} State;

/* How far a part of a step that was left has got; each thread has one. The others go on with a part that has failed only
   when it is said to have not: by who knows what comes first, and whether it can be helped. */
typedef struct {
    int64_t begin;  /* operation to go on with */
    int64_t failed; /* the one that failed, or -1 */
    int64_t status; /* of its call; ok or warning: a value is not finite, or none that the type holds, or a step is not over */
} Place;

/* ------------------------------------------------------------------------------------------------ the plan, as it runs */

typedef enum {
    STEP, SET_REALS_IN_PLACE, SET_REALS, SET_INTEGERS, GET_REALS, GET_INTEGERS, CHANGE, STEP_3, SET_3, GET_3, SET_TEXTS, GET_TEXTS, LOOK, STAMP, EXTEND,
    SLOPES, SAVE, RESTORE, FORGET, NOTE, ASK, BEGIN, MARK, END, SOLVE,
} Kind;

/* Texts by number (types/texts.c). */
typedef struct Texts Texts;

/* One operation. */
typedef struct {
    void *component;
    double *values;       /* where they are read or written in place */
    const Entry *entries; /* where they are gathered from */
    union {
        const Change *change;
        Told *told;
        const Course *course;
        State *state;
        Loop *loop;
        const Noting *noting;
        const Solver *solver;
    };
} Call;

/* Calls of one kind, one after the other, of one function with the same value references. */
typedef struct {
    Kind kind;
    uintptr_t function;
    const unsigned int *references;
    size_t count; /* of the values */
    size_t reference_count;
    int type; /* of FMI 3.0 */
    int32_t period;
    int32_t phase;
    int32_t is_watched;
    int32_t is_late;
    int32_t is_unseen; /* what is read need not be finite */
    Call *begin;
    Call *end;
} Group;

typedef struct {
    Call *calls;
    Group *groups;
    size_t group_count;
    size_t largest; /* channel, in values */
    size_t *bounds; /* groups of each part: those of part n are from bounds[n] to bounds[n + 1] */
    const int64_t *ends; /* and where its operations end */
    int thread_count;
    double *values;
    size_t value_count;
    double *history; /* the last `depth` recorded points, a ring */
    size_t depth;
    size_t newest; /* the ring's newest row */
    const Change *changes;
    const Entry *entries;
    const Channel *channels;
    const Course *courses;
    Points *points;
    double *stamps; /* what time each of the values belongs to; NULL where nobody asks */
    Loop *loops;
    size_t *loop_groups; /* of each loop those of BEGIN and MARK, from 1 */
    const Solver *solvers;
    double *head; /* what is counted of algebraic loops; NULL where none are solved */
    const Party *parties;
    const Term *terms;
    size_t *group_of; /* of each operation its group */
    const int64_t *passed; /* places of the values that loops compare, and that are solved for */
    double *work;
    const int64_t *forms; /* of the values; NULL where all of them are numbers */
    Texts *texts;         /* NULL where none of them is one */
    int64_t *disturbed; /* by operation, after which of its steps numbers were first rounded in another way, from 1 */
    unsigned control; /* how numbers are rounded when the block begins, as `float_control` has it, */
    fenv_t floats;    /* and all that belongs to it */
    Note *note;       /* of the thread that began the block: how many rows there are */
} Plan;

/* A thread with room for the values of the largest channel, and what it is about. */
typedef struct {
    const Plan *plan;
    double *reals;
    int *integers;
    Note *note;         /* of the call that is under way, */
    const Group *group; /* which is one of these */
} Hand;

/* When a communication step is. */
typedef struct {
    long long number;
    double start; /* of the run, */
    double time;  /* and of the step */
    double step;
    int is_due; /* whether its row is to be written */
} Advance;

/* Which steps to take, and where their rows go. */
typedef struct {
    double start;
    double step;
    long long first; /* number of the first step */
    long long count;
    long long every;
    long long last; /* number of the step that is recorded whatever `every` says */
    Place *places;  /* of the parts of the first step, which may have been left; then of the one that is left */
    double *rows; /* where the first one begins: the time, and in the columns behind it */
    size_t stride; /* from one column to the next */
    size_t capacity; /* of rows */
    const int64_t *kept; /* places of the values that a row has */
    size_t kept_count;
} Block;

/* How far a block got: steps done, and rows written. */
typedef struct {
    long long done;
    size_t written;
    long long wait; /* steps to the next row that is due; counted, because to divide takes as long as a light FMU's step */
} Outcome;

/* Hidden, so that nothing of a name like one of theirs elsewhere in the process can stand in their place. */
#ifdef __GNUC__
#pragma GCC visibility push(hidden)
#endif

/* Notes calls, and leads back from those that are left: as the binding has it, or not at all. */
extern Guard guard;

/* Failed calls have an FMI status, or this with how they were left and the exit code (`said_by_status` in compiled.py). */
#define LEFT(way, code) ((int64_t)(way) << 32 | (uint32_t)(code))

enum { WARNING = 1 }; /* the last status of the standard that is no failure */

static inline int is_failure(int status)
{
    return status < 0 || status > WARNING;
}

static inline void note_call(const Hand *hand, const Call *call)
{
    hand->note->instance = (uint64_t)(uintptr_t)call->component;
}

/* Where the value stands that an entry reads. */
static inline const double *value_of(const Plan *plan, const Entry *entry)
{
    const double *row = plan->values;
    if (entry->age >= 0) {
        size_t age = (size_t)entry->age;
        row = plan->history + (plan->newest + (plan->newest < age ? plan->depth : 0) - age) * plan->value_count;
    }
    return row + entry->place;
}

/* Whether it is set as it is. */
static inline int is_plain(const Entry *entry)
{
    return entry->scale == 1.0 && entry->offset == 0.0 && entry->whole == AS_IT_IS && entry->change < 0;
}

int is_same(const Plan *plan, int64_t place, double a, double b);

/* What an entry makes of the value that it reads. */
double read_entry(const Plan *plan, const Entry *entry, double time);

/* A value as a number, rounded where it has more bits than that. */
double number_of(double value, int64_t form);

/* Each of these takes a group's calls; it returns the one that failed, or the end. A failure with a status that is none is
   a value that is not finite, or none that the type holds, or a step that ended early or with the simulation. */
const Call *take_steps_3(const Hand *hand, const Group *group, double time, double step, int *status);
const Call *set_3(const Hand *hand, const Group *group, double time, int *status);
const Call *get_3(const Hand *hand, const Group *group, int *status);

const Call *set_texts(const Hand *hand, const Group *group, double time, int *status);
const Call *get_texts(const Hand *hand, const Group *group, int *status);

/* Whether there was no memory for one. */
int texts_are_full(const Texts *texts);

/* The same for what else there is to do (courses.c, loops.c); values that are looked at, stamped or extended. */
const Call *look_at(const Plan *plan, const Group *group, int *status);
void stamp(const Plan *plan, const Group *group, const Advance *it);
const Call *extend(const Hand *hand, const Group *group, const Advance *it, int *status);
const Call *set_slopes(const Hand *hand, const Group *group, int *status);
void note_inputs(const Plan *plan, const Group *group, double time);
const Call *treat_states(const Hand *hand, const Group *group, int *status);

typedef enum { ON, AGAIN, LOST } Way_on;

/* Loops (loops.c): a loop begins, a round of it begins, and whether there is another one. */
void begin_loop(const Plan *plan, const Loop *loop);
void begin_round(const Plan *plan, const Loop *loop);
Way_on end_round(const Plan *plan, const Loop *loop);

size_t work_of(const Plan *plan, const Loop *loop); /* numbers in the work space */

/* The next guess in the place of the last one, from what it led to; 0 if it is not finite (acceleration.c). */
int accelerate(int64_t method, double relaxation, size_t count, int is_first, double *guess, double *reached,
               double *work);

size_t work_of_acceleration(int64_t method, size_t count); /* numbers in the work space */

/* Operations from one to another, whenever they are due; NULL, or the call that failed. */
const Call *take_calls(Hand *hand, int64_t from, int64_t to, const Advance *it, int *status);

/* After a call of one that may change how numbers are rounded: they are rounded as before, and that is noted. */
void look_at_floats(const Hand *hand, const Advance *it);

Outcome outcome_of(const Block *block); /* nothing is done of it */

/* One part of a communication step, from its place on. */
void take_part(Hand *hand, int part, const Advance *it, Place *place);

/* The call that is under way was left, and how. */
void note_failure(Hand *hand, Place *place, int way, int code);

/* The block's next step; 0 if it is at its end, or has no room for the row that would be due. */
int has_next(const Block *block, const Outcome *outcome, Advance *it);

/* The next row: a time, and the values that are kept. */
void write_row(const Plan *plan, const Block *block, double time, Outcome *outcome);

/* A step has been taken: remember its values, write its row if it is due, and let the next one begin at its begin. */
void finish_step(Plan *plan, const Block *block, const Advance *it, Outcome *outcome);

Outcome take_block(Plan *plan, Hand *hand, const Block *block);

#if HAS_THREADS
/* As `take_block`, by as many threads as the plan has parts for, and with a hand for each; 0 if they cannot be had. */
int take_block_together(Plan *plan, const Hand *hands, const Block *block, Outcome *outcome);
#endif

#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
