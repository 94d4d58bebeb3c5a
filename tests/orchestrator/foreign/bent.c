/* An FMU by hand of which values depend on themselves: y = c + a f(u) + b f(v) + t, z = u v, n = m + 1. By value reference: 0 u,
   1 v (real inputs); 2 y, 3 z (outputs); 4 a, 5 b, 6 c (parameters); 7 f (0 f(x) = x, 1 tanh x, 2 x^3, 3 x between -2 and 2,
   4 exp x, 5 cos x, 6 root of x, which is no number below 0); 8 mode; 9 m (integer input); 10 n (integer output). From t = 1 s on
   mode says what is odd: 100 + s the status of being asked for derivatives, 200 + s of being set, 300 + s of being read;
   400 rounds upward when asked; 401: y = u + 1; 402 and 403 refuse a u that is near the last one, or
   far, 404 to be read where it is near; 405 a u that is the last y and another, once it was set five times in a step;
   406 and 407 derivatives, and every second value that is near the last one, 407 for good. */

#include "fmi2.h"

#include <fenv.h>

typedef struct {
    double v[8], read;
    int whole[11], set_count, near_count;
    double time;
} Bent;

static double f(int which, double x)
{
    switch (which) {
    case 1: return tanh(x);
    case 2: return x * x * x;
    case 3: return x < -2.0 ? -2.0 : x > 2.0 ? 2.0 : x;
    case 4: return exp(x);
    case 5: return cos(x);
    case 6: return sqrt(x);
    default: return x;
    }
}

static double slope(int which, double x)
{
    switch (which) {
    case 1: return 1.0 - tanh(x) * tanh(x);
    case 2: return 3.0 * x * x;
    case 3: return x >= -2.0 && x <= 2.0;
    case 4: return exp(x);
    case 5: return -sin(x);
    case 6: return 0.5 / sqrt(x);
    default: return 1.0;
    }
}

static int odd(const Bent *s, int first)
{
    int how = s->whole[8] - first;
    return s->time < 1.0 || how < 0 || how > 9 ? 0 : how == 9 ? -1 : how;
}

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const Callbacks *callbacks,
                      int visible, int logging)
{
    (void)name, (void)kind, (void)guid, (void)place, (void)callbacks, (void)visible, (void)logging;
    return calloc(1, sizeof(Bent));
}

void fmi2FreeInstance(void *c)
{
    free(c);
}

int fmi2SetupExperiment(void *c, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Bent *)c)->time = start;
    return 0;
}

int fmi2SetReal(void *c, const unsigned *vr, size_t count, const double *values)
{
    Bent *s = c;
    int how = s->time >= 1.0 ? s->whole[8] : 0, is_refused = 0, is_near = 0;
    for (size_t k = 0; k < count; k++) {
        double by = fabs(values[k] - s->v[vr[k]]);
        is_refused |= how == 405 && vr[k] == 0 && ++s->set_count > 5 && values[k] == s->v[2] && by > 1e-3;
        is_refused |= vr[k] == 0 && ((how == 402 && by > 0.0 && by < 1e-4) || (how == 403 && by > 1.0));
        is_near |= by > 0.0 && by < 1e-4;
        s->v[vr[k]] = values[k];
    }
    if ((how == 406 || how == 407) && is_near && ++s->near_count % 2 == 0) {
        return how == 406 ? 3 : 4;
    }
    return is_refused ? 3 : odd(c, 200);
}

int fmi2GetReal(void *c, const unsigned *vr, size_t count, double *values)
{
    Bent *s = c;
    s->v[2] = s->v[6] + s->v[4] * f(s->whole[7], s->v[0]) + s->v[5] * f(s->whole[7], s->v[1]) + s->time;
    s->v[3] = s->v[0] * s->v[1];
    s->v[2] = s->time >= 1.0 && s->whole[8] == 401 ? s->v[0] + 1.0 : s->v[2];
    for (size_t k = 0; k < count; k++) {
        values[k] = s->v[vr[k]];
    }
    double by = fabs(s->v[0] - s->read);
    s->read = s->v[0];
    int how = s->time >= 1.0 ? s->whole[8] : 0;
    return how == 404 && by > 1e-9 && by < 1e-4 ? 3 : odd(c, 300);
}

int fmi2SetInteger(void *c, const unsigned *vr, size_t count, const int *values)
{
    for (size_t k = 0; k < count; k++) {
        ((Bent *)c)->whole[vr[k]] = values[k];
    }
    return 0;
}

int fmi2GetInteger(void *c, const unsigned *vr, size_t count, int *values)
{
    Bent *s = c;
    s->whole[10] = s->whole[9] + 1;
    for (size_t k = 0; k < count; k++) {
        values[k] = s->whole[vr[k]];
    }
    return 0;
}

#ifndef MUTE
int fmi2GetDirectionalDerivative(void *c, const unsigned *unknowns, size_t rows, const unsigned *knowns, size_t columns,
                                 const double *seeds, double *found)
{
    Bent *s = c;
    for (size_t i = 0; i < rows; i++) {
        found[i] = 0.0;
        for (size_t k = 0; k < columns; k++) {
            unsigned other = 1 - knowns[k];
            found[i] += seeds[k] * (unknowns[i] == 3 ? s->v[other] : s->v[4 + knowns[k]] * slope(s->whole[7], s->v[knowns[k]]));
        }
    }
    if (s->whole[8] == 400 && s->time >= 1.0) {
        fesetround(FE_UPWARD);
    }
    if ((s->whole[8] == 406 || s->whole[8] == 407) && s->time >= 1.0) {
        return 3;
    }
    return odd(c, 100);
}
#endif

int fmi2DoStep(void *c, double time, double step, int final)
{
    (void)final;
    ((Bent *)c)->time = time + step;
    ((Bent *)c)->set_count = 0;
    return 0;
}

FINE(fmi2SetDebugLogging) FINE(fmi2EnterInitializationMode) FINE(fmi2ExitInitializationMode) FINE(fmi2Terminate)
FINE(fmi2Reset)
