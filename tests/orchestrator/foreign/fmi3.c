/* An FMI 3.0 FMU by hand, with the functions of co-simulation and no others: der(x) = u - x, solved exactly over a step, and
   an input and an output of every type, which gives what the input was a step ago. From t = 5 s on its parameter `mode`
   rules: 1 to 5 and 9: the step gives that status (9: -1); 6: a step takes 0.05 s at most, and is discarded there; 7: a step
   of more than 0.05 s is refused; 8: the simulation shall end after half a step; 10: numbers are rounded upward; 11: half of a step of more than 0.05 s is
   taken, and that is told as an early return; 12: y is not a number; 13: setting fails; 14, 15, 16: the step crashes, hangs, ends the
   process; 17, 18: reading, setting a UInt16 crashes; 20 + s: the status of getting reals. At any time 40: initialization fails. Value references are ten times the place of a type below plus 0 for its input and 1 for its output;
   Float64: 0 time, 1 u, 2 x, 3 y = x + gain * u, 4 gain, 5 der(x); Int32: 62 mode; Int64: 82 gear, 83 shown.
   With -DEVENTS=1 it insists on its event mode: a step ends early at each third of a second, where an event waits whose
   discrete states are updated twice. With -DANY_ORDER it enters and leaves that mode whenever it is told to,
   and the one for its configuration. */

#include <fenv.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifndef TRUE
#define TRUE 1 /* any byte but 0 */
#endif
#ifndef EVENTS
#define EVENTS 0
#endif

typedef void (*Logger)(void *environment, int status, const char *category, const char *text);
typedef struct {
    double f64[10], time;
    float f32[2];
    int8_t i8[2];
    uint8_t u8[2];
    int16_t i16[2];
    uint16_t u16[2];
    int32_t i32[3];
    uint32_t u32[2];
    int64_t i64[4];
    uint64_t u64[2];
    bool truth[2], ready;
    char text[2][100];
} Values;
typedef struct {
    Values now;
    Logger logger;
    void *environment;
    bool logging, in_events, waits;
    int updates;
} Third;

static int tell(Third *s, int status, const char *text)
{
    if (status) {
        s->logger(s->environment, status, "third", text);
    }
    return status;
}

static int mode(const Third *s)
{
    return s->now.time >= 5.0 ? s->now.i32[2] : 0;
}

/* A deed of the mode in a call. */
static void misbehave(const Third *s, const char *call)
{
    int how = mode(s);
    if ((how == 14 && !strcmp(call, "step")) || (how == 17 && !strcmp(call, "GetUInt16")) ||
        (how == 18 && !strcmp(call, "SetUInt16"))) {
        *(volatile int *)0 = 1;
    }
    if (how == 16 && !strcmp(call, "step")) {
        exit(7);
    }
    for (volatile int k = 0; how == 15 && !strcmp(call, "step"); k++) {
    }
}

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool events, bool early, const unsigned *intermediate, size_t count,
                                  void *environment, Logger logger, void *update)
{
    if (strcmp(token, "{3}") || events != EVENTS || count || update) {
        logger(environment, 3, "third", "another token, or what was not offered, 100 %");
        return NULL;
    }
    Third *s = calloc(1, sizeof *s);
    s->logger = logger;
    s->environment = environment;
    s->now.f64[2] = s->now.f64[4] = 1.0;
    s->now.i64[2] = s->now.i64[3] = 1;
    s->now.i8[0] = -128;
    s->now.u8[0] = 7;
    if (resources) {
        strncpy(s->now.text[1], resources, 99);
    }
    return s;
}

#ifdef RESET /* what comes of it */
int fmi3Reset(void *c)
{
    Third *s = c, fresh = {{{0}}};
    memcpy(fresh.now.text[1], s->now.text[1], sizeof s->now.text[1]);
    fresh.logger = s->logger;
    fresh.environment = s->environment;
    fresh.now.f64[2] = fresh.now.f64[4] = 1.0;
    fresh.now.i64[2] = fresh.now.i64[3] = 1;
    fresh.now.i8[0] = -128;
    fresh.now.u8[0] = 7;
    *s = fresh;
    return RESET;
}
#endif

void fmi3FreeInstance(void *c)
{
    free(c);
}

int fmi3EnterInitializationMode(void *c, bool has_tolerance, double tolerance, double start, bool has_stop, double stop)
{
    Third *s = c;
    s->now.time = start;
    return tell(s, s->now.ready || !has_stop || stop <= start || s->now.i32[2] == 40 ? 3 : 0, "no initialization");
}

int fmi3ExitInitializationMode(void *c)
{
    ((Third *)c)->now.ready = true;
    ((Third *)c)->in_events = EVENTS;
    return 0;
}

#ifdef ANY_ORDER
#define REFUSED 0
#else
#define REFUSED 3
#endif

#ifdef ANY_ORDER
int fmi3EnterConfigurationMode(void *c)
{
    return tell(c, 0, "");
}
#endif

#if EVENTS || defined ANY_ORDER
int fmi3EnterEventMode(void *c)
{
    Third *s = c;
    s->in_events = true;
    return tell(s, s->waits ? 0 : REFUSED, "no event waits");
}

int fmi3UpdateDiscreteStates(void *c, bool *needed, bool *ends, bool *nominals, bool *states, bool *timed, double *next)
{
    Third *s = c;
    *needed = ++s->updates % 2;
    *ends = *nominals = *states = *timed = false;
    return tell(s, s->in_events ? 0 : REFUSED, "no event mode");
}

int fmi3EnterStepMode(void *c)
{
    Third *s = c;
    int status = tell(s, s->in_events && s->updates % 2 == 0 ? 0 : REFUSED, "no settled event mode");
    s->in_events = s->waits = false;
    return status;
}
#endif

int fmi3Terminate(void *c)
{
    return tell(c, ((Third *)c)->now.ready ? 0 : 3, "termination");
}

static int update(Third *s)
{
    double *v = s->now.f64;
    v[0] = s->now.time;
    v[3] = mode(s) == 12 ? NAN : v[2] + v[4] * v[1];
    v[5] = v[1] - v[2];
    return tell(s, mode(s) >= 20 ? mode(s) - 20 : 0, "reading");
}

#define EXCHANGE(name, type, kept)                                                                                     \
    int fmi3Set##name(void *c, const unsigned *vr, size_t count, const type *values, size_t size)                      \
    {                                                                                                                  \
        misbehave(c, "Set" #name);                                                                                     \
        for (size_t k = 0; k < count; k++) {                                                                           \
            ((Third *)c)->now.kept[vr[k] % 10] = values[k];                                                            \
        }                                                                                                              \
        return count == size && mode(c) != 13 ? 0 : 3;                                                                 \
    }                                                                                                                  \
    int fmi3Get##name(void *c, const unsigned *vr, size_t count, type *values, size_t size)                            \
    {                                                                                                                  \
        int status = sizeof(type) == sizeof(double) && vr[0] < 10 ? update(c) : 0;                                     \
        misbehave(c, "Get" #name);                                                                                     \
        for (size_t k = 0; k < count; k++) {                                                                           \
            values[k] = ((Third *)c)->now.kept[vr[k] % 10];                                                            \
        }                                                                                                              \
        return count == size ? status : 3;                                                                             \
    }
EXCHANGE(Float64, double, f64)
EXCHANGE(Float32, float, f32)
EXCHANGE(Int8, int8_t, i8)
EXCHANGE(UInt8, uint8_t, u8)
EXCHANGE(Int16, int16_t, i16)
EXCHANGE(UInt16, uint16_t, u16)
EXCHANGE(Int32, int32_t, i32)
EXCHANGE(UInt32, uint32_t, u32)
EXCHANGE(Int64, int64_t, i64)
EXCHANGE(UInt64, uint64_t, u64)

int fmi3SetBoolean(void *c, const unsigned *vr, size_t count, const unsigned char *values, size_t size)
{
    for (size_t k = 0; k < count; k++) {
        ((Third *)c)->now.truth[vr[k] % 10] = values[k] != 0;
    }
    return count == size ? 0 : 3;
}

int fmi3GetBoolean(void *c, const unsigned *vr, size_t count, unsigned char *values, size_t size)
{
    for (size_t k = 0; k < count; k++) {
        values[k] = ((Third *)c)->now.truth[vr[k] % 10] ? TRUE : 0;
    }
    return count == size ? 0 : 3;
}

int fmi3SetString(void *c, const unsigned *vr, size_t count, const char *const *values, size_t size)
{
    for (size_t k = 0; k < count; k++) {
        strncpy(((Third *)c)->now.text[vr[k] % 10], values[k], 99);
    }
    return 0;
}

int fmi3GetString(void *c, const unsigned *vr, size_t count, const char **values, size_t size)
{
    for (size_t k = 0; k < count; k++) {
        values[k] = ((Third *)c)->now.text[vr[k] % 10];
    }
    return 0;
}

int fmi3DoStep(void *c, double time, double step, bool final, bool *event, bool *ends, bool *early, double *reached)
{
    Third *s = c;
    Values *v = &s->now;
    int how = mode(s), status = how >= 1 && how <= 5 ? how : how == 9 ? -1 : 0;
    if (!v->ready || fabs(time - v->time) > 1e-9) {
        return tell(s, 3, "a step that was not expected");
    }
    if (s->in_events || s->waits) {
        return tell(s, 3, "a step without the event mode");
    }
    misbehave(s, "step");
    double until = (floor(3.0 * time + 1e-9) + 1.0) / 3.0 - time;
    s->waits = EVENTS && until <= step + 1e-9;
    *event = s->waits || !EVENTS; /* of no meaning without an event mode */
    *ends = how == 8;
    *early = how == 11 && step > 0.05;
    *reached = v->time;
    if (how == 7 && step > 0.05) {
        return tell(s, 2, "too long");
    }
    if (how == 6 && step > 0.05) {
        step = 0.05;
        status = 2;
    }
    step *= *ends || *early ? 0.5 : 1.0;
    if (s->waits && until < step - 1e-9) {
        step = until;
        *early = true;
    }
    v->f64[2] = v->f64[1] + (v->f64[2] - v->f64[1]) * exp(-step);
    v->f32[1] = v->f32[0];
    v->i8[1] = v->i8[0];
    v->u8[1] = v->u8[0];
    v->i16[1] = v->i16[0];
    v->u16[1] = v->u16[0];
    v->i32[1] = v->i32[0];
    v->u32[1] = v->u32[0];
    v->i64[1] = v->i64[0];
    v->i64[3] = v->i64[2];
    v->u64[1] = v->u64[0];
    v->truth[1] = !v->truth[0];
    strcpy(v->text[1], v->text[0]);
    v->time = *reached = time + step;
    if (how == 10) {
        fesetround(FE_UPWARD);
    }
    return tell(s, status, "as it was told, 100 %");
}

int fmi3GetFMUState(void *c, void **state)
{
    *state = *state ? *state : malloc(sizeof(Values));
    memcpy(*state, &((Third *)c)->now, sizeof(Values));
    return 0;
}

int fmi3SetFMUState(void *c, void *state)
{
    memcpy(&((Third *)c)->now, state, sizeof(Values));
    return 0;
}

int fmi3FreeFMUState(void *c, void **state)
{
    free(*state);
    *state = NULL;
    return 0;
}

int fmi3SerializedFMUStateSize(void *c, void *state, size_t *size)
{
    *size = sizeof(Values);
    return 0;
}

int fmi3SerializeFMUState(void *c, void *state, uint8_t *bytes, size_t size)
{
    memcpy(bytes, state, size);
    return 0;
}

int fmi3DeserializeFMUState(void *c, const uint8_t *bytes, size_t size, void **state)
{
    if (size != sizeof(Values)) {
        return tell(c, 3, "another size");
    }
    *state = malloc(size);
    memcpy(*state, bytes, size);
    return 0;
}

int fmi3GetDirectionalDerivative(void *c, const unsigned *unknowns, size_t n, const unsigned *knowns, size_t m,
                                 const double *seed, size_t seeds, double *found, size_t size)
{
    for (size_t k = 0; k < n; k++) {
        found[k] = 0.0;
        for (size_t j = 0; j < m; j++) {
            double by_u = unknowns[k] == 3 ? ((Third *)c)->now.f64[4] : unknowns[k] == 5 ? 1.0 : 0.0;
            double by_x = unknowns[k] == 3 ? 1.0 : unknowns[k] == 5 ? -1.0 : unknowns[k] == 2 ? 1.0 : 0.0;
            found[k] += seed[j] * (knowns[j] == 1 ? by_u : knowns[j] == 2 ? by_x : 0.0);
        }
    }
    return n == size && m == seeds ? 0 : 3;
}

/* blob, which is empty */
int fmi3GetBinary(void *c, const unsigned *vr, size_t count, size_t *sizes, const uint8_t **values, size_t size)
{
    for (size_t k = 0; k < size; k++) {
        sizes[k] = 0;
        values[k] = NULL;
    }
    return count == size ? 0 : 3;
}
