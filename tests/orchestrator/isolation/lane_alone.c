/* Both sides of a lane in one process, as threads, so that a sanitizer sees them: two instances in one lane hand on what
   they count. Each step is taken twice, from a state that is saved before and given back; what the first one gives is wrong
   by a derivative of the input. The argument is how long either side watches, in ns. */

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

enum { STEPS = 10000, INSTANCES = 2, HEAD = 64, ROOM = 192, AT_SLOPES = 8, AT_QUESTION = 13 };

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
static int set_whole(void *c, const unsigned *vr, size_t count, const int *values)
{
    (void)vr;
    (void)count;
    ((Model *)c)->m = values[0];
    return 0;
}
static int get_whole(void *c, const unsigned *vr, size_t count, int *values)
{
    (void)vr;
    (void)count;
    values[0] = ((Model *)c)->n;
    return 0;
}
static int do_step(void *c, double time, double length, int is_final)
{
    Model *it = c;
    if (is_final) {
        return 4;
    }
    it->x = it->u + 1.0 + it->slope;
    it->n = it->m + 1;
    return time + length > STEPS + 1.0 ? 3 : 0; /* one step more than there are */
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
typedef int (*SetI)(void *, const unsigned *, size_t, const int *);
typedef int (*GetI)(void *, const unsigned *, size_t, int *);
typedef int (*SetS)(void *, const unsigned *, size_t, const int *, const double *);
typedef int (*Derive)(void *, const unsigned *, size_t, const unsigned *, size_t, const double *, double *);
typedef int (*Get)(void *, void **);
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
    uintptr_t functions[N_KINDS] = {(uintptr_t)set_real,  (uintptr_t)set_whole, (uintptr_t)do_step,
                                    (uintptr_t)get_real,  (uintptr_t)get_whole, (uintptr_t)set_slope,
                                    (uintptr_t)derive,
                                    (uintptr_t)get_state, (uintptr_t)set_state, (uintptr_t)free_state};
    void *handles[INSTANCES];
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
            uint32_t place = n == SET_SLOPES ? AT_SLOPES : n == ASK ? AT_QUESTION : n;
            uint64_t offset = (uint64_t)head + HEAD + 8 * place, many = n == SET_SLOPES ? 2 : 1;
            uintptr_t where = n >= SAVE ? (uintptr_t)&handles[k] : 0;
            operations[k][n] = (Operation){n, functions[n], (uintptr_t)&models[k], where, many, offset, n + 1};
            seats[k][n] = (Seat){.rider = &riders[k], .number = n, .offset = (Py_ssize_t)offset, .count = (Py_ssize_t)many};
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
            MUST(((Get)lane_functions[SAVE])(&seats[j][SAVE], &handle));
            MUST(((SetR)lane_functions[SET_REALS])(&seats[j][SET_REALS], NULL, 1, &x));
            MUST(((SetS)lane_functions[SET_SLOPES])(&seats[j][SET_REALS], references, 2, orders, slopes));
            MUST(((Step)lane_functions[STEP])(&seats[j][STEP], k, 1.0, 0));
            if (k % 2 == 0) {
                MUST(((GetR)lane_functions[GET_REALS])(&seats[j][GET_REALS], NULL, 1, &wrong));
                misses += wrong != x + 3.0;
            }
            MUST(((Put)lane_functions[k % 3 ? RESTORE : RESTORE_NOW])(&seats[j][SAVE], handle));
            MUST(((SetR)lane_functions[SET_REALS])(&seats[j][SET_REALS], NULL, 1, &x));
            MUST(((SetI)lane_functions[SET_INTEGERS])(&seats[j][SET_INTEGERS], NULL, 1, &n));
            MUST(((Step)lane_functions[STEP])(&seats[j][STEP], k, 1.0, 0));
            MUST(((Get)lane_functions[FORGET])(&seats[j][SAVE], &handle));
            MUST(((GetR)lane_functions[GET_REALS])(&seats[j][GET_REALS], NULL, 1, &x));
            MUST(((GetI)lane_functions[GET_INTEGERS])(&seats[j][GET_INTEGERS], NULL, 1, &n));
            const unsigned unknowns[] = {8}, knowns[] = {9};
            double slope = 0.0;
            int how = ((Derive)lane_functions[ASK])(&seats[j][ASK], unknowns, 1, knowns, 1, slopes, &slope);
            misses += how != (n % 2 ? 1 : 2) || slope != x + slopes[0];
        }
    }
    MUST(((Step)lane_functions[STEP])(&seats[1][STEP], STEPS + 1.0, 1.0, 0));
    int status = ((GetR)lane_functions[GET_REALS])(&seats[1][GET_REALS], NULL, 1, &x);
    uint32_t ticket;
    while (!post(&road, (Entry){.what = LEAVE}, 1, &ticket)) {
    }
    pthread_join(thread, NULL);
    printf("%g %d %d\n", x, n, status);
    return !(x == INSTANCES * STEPS && n == INSTANCES * STEPS && status == 3 && misses == 0 && states == 0);
}
