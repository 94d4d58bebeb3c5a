/* Both sides of a lane in one process, as threads, so that a sanitizer sees them: two instances in one lane hand on what
   they count. Each step is taken twice, from a state that is saved before and given back; what the first one gives is wrong
   by a derivative of the input. Real numbers go as FMI 1.0 and 2.0 have them, whole ones and the second step as FMI 3.0
   has. The argument is how long either side watches, in ns. */

#include "serving.c"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Python has no part in it. */
Lane *lane_in(const Py_buffer *memory, Py_ssize_t offset)
{
    (void)memory;
    (void)offset;
    return NULL;
}
int add_riding(PyObject *made)
{
    (void)made;
    return 0;
}

enum { STEPS = 10000, INSTANCES = 2, HEAD = 64, ROOM = 256, AT_SLOPES = 8, AT_QUESTION = 13, AT_QUESTION_3 = 21 };

typedef struct {
    double u, x, slope;
    int m, n;
} Model;

static atomic_int states;

static int set_real(void *c, const unsigned *vr, size_t count, const double *values)
{
    (void)vr;
    (void)count;
    ((Model *)c)->u = values[0];
    ((Model *)c)->slope = 0.0;
    return 0;
}
static int set_slope(void *c, const unsigned *vr, size_t count, const int *orders, const double *values)
{
    ((Model *)c)->slope = count == 2 && vr[1] == 7 && orders[1] == 2 ? values[1] : NAN;
    return 0;
}
static int derive(void *c, const unsigned *unknowns, size_t count, const unsigned *knowns, size_t known_count,
                  const double *seeds, double *slopes)
{
    slopes[0] = count == 1 && known_count == 1 && unknowns[0] == 8 && knowns[0] == 9 ? ((Model *)c)->x + seeds[0] : NAN;
    return ((Model *)c)->n % 2 ? 1 : 2; /* a warning, or a refusal */
}
static int derive_3(void *c, const unsigned *unknowns, size_t count, const unsigned *knowns, size_t known_count,
                    const double *seeds, size_t seed_count, double *slopes, size_t slope_count)
{
    return derive(c, unknowns, count, knowns, seed_count == 2 && slope_count == 1 ? known_count : 0, seeds + 1, slopes);
}
static int get_state(void *c, void **state)
{
    atomic_fetch_add(&states, 1);
    *state = malloc(sizeof(Model));
    memcpy(*state, c, sizeof(Model));
    return 0;
}
static int set_state(void *c, void *state)
{
    memcpy(c, state, sizeof(Model));
    return 0;
}
static int free_state(void *c, void **state)
{
    (void)c;
    atomic_fetch_sub(&states, 1);
    free(*state);
    return 0;
}
static int get_real(void *c, const unsigned *vr, size_t count, double *values)
{
    (void)vr;
    (void)count;
    values[0] = ((Model *)c)->x;
    return 0;
}
static int set_whole(void *c, const unsigned *vr, size_t count, const int *values, size_t size)
{
    (void)vr;
    ((Model *)c)->m = values[0];
    return count == size ? 0 : 3;
}
static int get_whole(void *c, const unsigned *vr, size_t count, int *values, size_t size)
{
    (void)vr;
    values[0] = ((Model *)c)->n;
    return count == size ? 0 : 3;
}
static int do_step(void *c, double time, double length, int is_final)
{
    Model *it = c;
    if (is_final) {
        return 4;
    }
    it->x = it->u + 1.0 + it->slope;
    it->n = it->m + 1;
    return 0;
}
static int do_step_3(void *c, double time, double length, bool is_final, bool *waits, bool *ends, bool *early,
                     double *reached)
{
    *waits = *early = false;
    *ends = time + length > STEPS + 1.0; /* one step more than there are */
    *reached = time + length;
    return do_step(c, time, length, is_final);
}

static struct {
    Lane lane;
    double memory[INSTANCES][(HEAD + ROOM) / sizeof(double)];
} shared __attribute__((aligned(64)));

static void *host(void *service)
{
    ride(service);
    return NULL;
}

typedef int (*Step)(void *, double, double, int);
typedef int (*SetR)(void *, const unsigned *, size_t, const double *);
typedef int (*GetR)(void *, const unsigned *, size_t, double *);
typedef int (*SetI)(void *, const unsigned *, size_t, const int *, size_t);
typedef int (*GetI)(void *, const unsigned *, size_t, int *, size_t);
typedef int (*SetS)(void *, const unsigned *, size_t, const int *, const double *);
typedef int (*Derive)(void *, const unsigned *, size_t, const unsigned *, size_t, const double *, double *);
typedef int (*Derive3)(void *, const unsigned *, size_t, const unsigned *, size_t, const double *, size_t, double *,
                       size_t);
typedef int (*Put)(void *, void *);

static int misses;

/* What is not there at once is waited for again and again. */
static int goes_on(LaneObject *road, uint32_t number)
{
    (void)road;
    (void)number;
    return 1;
}

#define MUST(call) misses += (call) != 0

int main(int count, char **arguments)
{
    Model models[INSTANCES] = {{0}};
    Operation operations[INSTANCES][N_KINDS];
    Guest guests[INSTANCES];
    uintptr_t functions[N_KINDS] = {(uintptr_t)set_real,  (uintptr_t)set_whole,
                                    (uintptr_t)do_step,   (uintptr_t)do_step_3,
                                    (uintptr_t)get_real,  (uintptr_t)get_whole, (uintptr_t)set_slope,
                                    (uintptr_t)derive, (uintptr_t)derive_3,
                                    (uintptr_t)get_state, (uintptr_t)set_state, (uintptr_t)free_state};
    void *handles[INSTANCES];
    Told told[INSTANCES];
    int64_t spin = count > 1 ? atol(arguments[1]) : 0;
    LaneObject road = {.lane = &shared.lane, .line = -1, .moment = spin < 1000 ? 5000 : 1000000000, .goes_on = goes_on};
    RiderObject riders[INSTANCES];
    Seat seats[INSTANCES][N_KINDS];
    road.memory.buf = &shared;
    road.spin.most = road.spin.now = spin;
    for (uint32_t k = 0; k < INSTANCES; k++) {
        Py_ssize_t head = (char *)shared.memory[k] - (char *)&shared;
        guests[k] = (Guest){.memory = (char *)&shared, .notes = (int64_t *)shared.memory[k]};
        guests[k].operations.buf = operations[k];
        guests[k].operations.len = sizeof operations[k];
        riders[k] = (RiderObject){.road = &road, .head = head, .number = k, .gives = 1};
        for (uint32_t n = 0; n < N_KINDS; n++) {
            uint32_t place = n == SET_SLOPES ? AT_SLOPES : n == ASK ? AT_QUESTION : n == ASK_3 ? AT_QUESTION_3 : n;
            uint64_t offset = (uint64_t)head + HEAD + 8 * place, many = n == SET_SLOPES || n == ASK_3 ? 2 : 1;
            uintptr_t where = n >= SAVE ? (uintptr_t)&handles[k] : n == STEP_3 ? (uintptr_t)&told[k] : 0;
            Py_ssize_t width = n == SET_3 || n == GET_3 ? sizeof(int) : sizeof(double);
            operations[k][n] = (Operation){n, functions[n], (uintptr_t)&models[k], where, many, many, offset, n + 1};
            seats[k][n] = (Seat){.rider = &riders[k], .number = n, .offset = (Py_ssize_t)offset,
                                 .count = (Py_ssize_t)many, .width = width};
        }
        riders[k].slopes = &seats[k][SET_SLOPES];
    }
    Service service = {.lane = &shared.lane, .guests = guests, .count = INSTANCES, .spin = {spin, spin}};
    pthread_t thread;
    pthread_create(&thread, NULL, host, &service);
    double x = 0.0;
    int n = 0;
    for (int k = 0; k < STEPS; k++) {
        for (int j = 0; j < INSTANCES; j++) {
            const unsigned references[] = {7, 7};
            const int orders[] = {1, 2};
            const double slopes[] = {1.0, 2.0};
            double wrong = 0.0;
            void *handle = NULL;
            MUST(((Save)lane_functions[SAVE])(&seats[j][SAVE], &handle));
            MUST(((SetR)lane_functions[SET])(&seats[j][SET], NULL, 1, &x));
            MUST(((SetS)lane_functions[SET_SLOPES])(&seats[j][SET], references, 2, orders, slopes));
            MUST(((Step)lane_functions[STEP])(&seats[j][STEP], k, 1.0, 0));
            if (k % 2 == 0) {
                MUST(((GetR)lane_functions[GET])(&seats[j][GET], NULL, 1, &wrong));
                misses += wrong != x + 3.0;
            }
            MUST(((Put)lane_functions[k % 3 ? RESTORE : RESTORE_NOW])(&seats[j][SAVE], handle));
            MUST(((SetR)lane_functions[SET])(&seats[j][SET], NULL, 1, &x));
            MUST(((SetI)lane_functions[SET_3])(&seats[j][SET_3], NULL, 1, &n, 1));
            MUST(((Step)lane_functions[STEP_3])(&seats[j][STEP_3], k, 1.0, 0));
            MUST(((Save)lane_functions[FORGET])(&seats[j][SAVE], &handle));
            MUST(((GetR)lane_functions[GET])(&seats[j][GET], NULL, 1, &x));
            MUST(((GetI)lane_functions[GET_3])(&seats[j][GET_3], NULL, 1, &n, 1));
            const unsigned unknowns[] = {8}, knowns[] = {9};
            double slope = 0.0;
            void *one = &seats[j][ASK], *other = &seats[j][ASK_3];
            int how = j ? ((Derive3)lane_functions[ASK_3])(other, unknowns, 1, knowns, 1, slopes, 2, &slope, 1)
                        : ((Derive)lane_functions[ASK])(one, unknowns, 1, knowns, 1, slopes, &slope);
            misses += how != (n % 2 ? 1 : 2) || slope != x + slopes[j];
        }
    }
    MUST(((Step)lane_functions[STEP_3])(&seats[1][STEP_3], STEPS + 1.0, 1.0, 0));
    int status = ((GetR)lane_functions[GET])(&seats[1][GET], NULL, 1, &x);
    uint32_t ticket;
    while (!post(&road, (Entry){.what = LEAVE}, 1, &ticket)) {
    }
    pthread_join(thread, NULL);
    printf("%g %d %d\n", x, n, status);
    return !(x == INSTANCES * STEPS && n == INSTANCES * STEPS && status == CUT_SHORT && misses == 0 && states == 0);
}
