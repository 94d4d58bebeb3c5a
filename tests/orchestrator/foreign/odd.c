/* An FMU by hand, which behaves until t = 5 s and then does what its parameter `mode` says. Variables by value reference:
   0 u, 1 v (real inputs); 2 x, 3 y (real outputs: der(x) = u - x, y = x + v); 4 m (integer input); 5 n (integer output:
   m + 1 a step ago); 6 on (boolean input); 7 off (boolean output: not on, a step ago); 8 mode.
   Modes 1 to 5: the status of the step, 5 one that must be cancelled before it comes back to a state; 9: status -1; 10, 11, 12: y is NaN, infinity, minus infinity; 20 + s, 30 + s: the
   status of getting, of setting; 40 to 43 discarded steps: 40 refuses more than 0.1 s, 41 gets 0.15 s of them done, 42
   half of one and asks for the end, 43 is 40 and goes on only when it was restored; 44: rounds upward from then on;
   60 + s, 70 + s: the status of getting, of setting whole numbers; 80 + s: of setting derivatives of inputs, of which 91
   refuses the second and 92 all; 100 + s, 110 + s, 120 + s: of saving a state, of coming back to one, of giving it back.
   Once one of these was fatal, or while a step is pending, it aborts as it is given back; and as that is cancelled once more. */

#include "fmi2.h"

#include <fenv.h>

typedef struct {
    double reals[4];
    int whole[9];
    double slopes[2][2]; /* of u and v */
    double time, reached;
    int stuck, ends, pends, is_cancelled, is_dead;
    Logger logger;
    void *environment;
    char name[100];
} Odd;

static int tell(Odd *s, int status)
{
    if (status) {
        s->is_dead = status == 4;
        s->logger(s->environment, s->name, status, "odd", "%s does as it was told: %d", s->name, status);
    }
    return status;
}

static int mode(const Odd *s, int first)
{
    int mode = s->whole[8];
    return s->time >= 5.0 && mode >= first && mode < first + 10 ? mode - first : 0;
}

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const Callbacks *callbacks,
                      int visible, int logging)
{
    Odd *s = calloc(1, sizeof *s);
    strncpy(s->name, name, sizeof s->name - 1);
    s->logger = callbacks->logger;
    s->environment = callbacks->environment;
    return s;
}

void fmi2FreeInstance(void *c)
{
    if (((Odd *)c)->is_dead || ((Odd *)c)->pends) {
        abort();
    }
    free(c);
}

int fmi2SetReal(void *c, const unsigned *vr, size_t count, const double *values)
{
    Odd *s = c;
    for (size_t k = 0; k < count; k++) {
        s->reals[vr[k]] = values[k];
        memset(s->slopes[vr[k]], 0, sizeof s->slopes[vr[k]]);
    }
    return tell(s, mode(s, 30));
}

int fmi2SetRealInputDerivatives(void *c, const unsigned *vr, size_t count, const int *orders, const double *values)
{
    Odd *s = c;
    int how = mode(s, 90), is_refused = how == 2;
    for (size_t k = 0; k < count; k++) {
        s->slopes[vr[k]][orders[k] - 1] = values[k];
        is_refused |= how == 1 && orders[k] > 1;
    }
    return tell(s, is_refused ? 3 : mode(s, 80));
}

int fmi2GetReal(void *c, const unsigned *vr, size_t count, double *values)
{
    Odd *s = c;
    int how = s->time >= 5.0 ? s->whole[8] : 0;
    s->reals[3] = how == 10 ? NAN : how == 11 ? INFINITY : how == 12 ? -INFINITY : s->reals[2] + s->reals[1];
    for (size_t k = 0; k < count; k++) {
        values[k] = s->reals[vr[k]];
    }
    return tell(s, mode(s, 20));
}

int fmi2SetInteger(void *c, const unsigned *vr, size_t count, const int *values)
{
    Odd *s = c;
    for (size_t k = 0; k < count; k++) {
        s->whole[vr[k]] = values[k];
    }
    return tell(s, mode(s, 70));
}

int fmi2GetInteger(void *c, const unsigned *vr, size_t count, int *values)
{
    Odd *s = c;
    for (size_t k = 0; k < count; k++) {
        values[k] = s->whole[vr[k]];
    }
    return tell(s, mode(s, 60));
}

int fmi2SetBoolean(void *c, const unsigned *vr, size_t count, const int *values)
{
    return fmi2SetInteger(c, vr, count, values);
}

int fmi2GetBoolean(void *c, const unsigned *vr, size_t count, int *values)
{
    return fmi2GetInteger(c, vr, count, values);
}

int fmi2SetupExperiment(void *c, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    ((Odd *)c)->time = start;
    return 0;
}

static void advance(Odd *s, double step)
{
    s->reals[2] += step * (s->reals[0] - s->reals[2]) + step * step * (s->slopes[0][0] / 2.0 + step * s->slopes[0][1] / 6.0);
    s->whole[5] = s->whole[4] + 1;
    s->whole[7] = !s->whole[6];
    s->time += step;
}

int fmi2DoStep(void *c, double time, double step, int final)
{
    Odd *s = c;
    int status = mode(s, 0), how = s->time >= 5.0 ? s->whole[8] : 0;
    s->reached = how >= 40 ? time : NAN;
    if (s->stuck) {
        return tell(s, 3);
    }
    if ((how == 40 || how == 43) && step > 0.1000001) {
        s->stuck = how == 43;
        return tell(s, 2);
    }
    if ((how == 41 && step > 0.1500001) || how == 42) {
        s->ends = how == 42;
        advance(s, how == 42 ? 0.5 * step : 0.15);
        s->reached = s->time;
        return tell(s, 2);
    }
    advance(s, step);
    if (how == 44) {
        fesetround(FE_UPWARD);
    }
    s->pends = status == 5;
    s->is_cancelled = 0;
    return tell(s, status == 9 ? -1 : status);
}

int fmi2CancelStep(void *c)
{
    Odd *s = c;
    if (s->is_cancelled) {
        abort();
    }
    s->is_cancelled = s->pends;
    s->pends = 0;
    return 0;
}

int fmi2GetRealStatus(void *c, int kind, double *value)
{
    *value = ((Odd *)c)->reached;
    return 0;
}

int fmi2GetBooleanStatus(void *c, int kind, int *value)
{
    *value = ((Odd *)c)->ends;
    return 0;
}

int fmi2GetFMUstate(void *c, void **state)
{
    *state = *state ? *state : malloc(sizeof(Odd));
    memcpy(*state, c, sizeof(Odd));
    return tell(c, mode(c, 100));
}

int fmi2SetFMUstate(void *c, void *state)
{
    if (((Odd *)c)->pends) {
        return tell(c, 4);
    }
    memcpy(c, state, sizeof(Odd));
    return tell(c, mode(c, 110));
}

int fmi2FreeFMUstate(void *c, void **state)
{
    free(*state);
    *state = NULL;
    return tell(c, mode(c, 120));
}

FINE(fmi2SetDebugLogging) FINE(fmi2EnterInitializationMode) FINE(fmi2ExitInitializationMode) FINE(fmi2Terminate)
FINE(fmi2Reset) FINE(fmi2GetString) FINE(fmi2SetString) FINE(fmi2SerializedFMUstateSize) FINE(fmi2SerializeFMUstate)
FINE(fmi2DeSerializeFMUstate) FINE(fmi2GetDirectionalDerivative)
FINE(fmi2GetRealOutputDerivatives) FINE(fmi2GetStatus) FINE(fmi2GetIntegerStatus)
FINE(fmi2GetStringStatus)
