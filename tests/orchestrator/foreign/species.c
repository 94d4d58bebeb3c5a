/* One of two species, dx/dt = x (a + b u) + c u by RK4 in parts no longer than 1 ms, with u held over the step. By value
   reference: 0 u (input); 1 y (output: x + d u, with -DHELD the u of the last step, else the one that is set); 2 a; 3 b;
   4 c; 5 d; 6 start (parameters); 7 states (output: how many there are in the process, saved and not given back). The
   description may say of y's dependencies what it likes. With -DSHY it cannot be read between being set and the next
   step; with -DROUGH its solver is off by 1e-5, in another way for each u; with -DORDER=n it refuses derivatives of u of a
   higher order than n, and follows the first; with -DREFUSED=n its states cannot be saved from the nth on. */

#include "fmi2.h"

typedef struct {
    double v[7], x, held, time, rate;
    int steps, is_set;
} Species;

static int states;

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const Callbacks *callbacks,
                      int visible, int logging)
{
    (void)name, (void)kind, (void)guid, (void)place, (void)callbacks, (void)visible, (void)logging;
    return calloc(1, sizeof(Species));
}

void fmi2FreeInstance(void *c)
{
    free(c);
}

int fmi2SetupExperiment(void *c, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Species *)c)->time = start;
    return 0;
}

int fmi2ExitInitializationMode(void *c)
{
    Species *s = c;
    s->x = s->v[6];
    s->held = s->v[0];
    return 0;
}

int fmi2SetReal(void *c, const unsigned *vr, size_t count, const double *values)
{
    Species *s = c;
    for (size_t k = 0; k < count; k++) {
        s->v[vr[k]] = values[k];
    }
    s->x = s->steps == 0 ? s->v[6] : s->x;
    s->is_set = s->steps > 0;
    s->rate = 0.0;
    return 0;
}

int fmi2GetReal(void *c, const unsigned *vr, size_t count, double *values)
{
    Species *s = c;
#ifdef SHY
    if (s->is_set) {
        return 3;
    }
#endif
#ifdef HELD
    s->v[1] = s->x + s->v[5] * s->held;
#else
    s->v[1] = s->x + s->v[5] * s->v[0];
#endif
    for (size_t k = 0; k < count; k++) {
        values[k] = s->v[vr[k]];
    }
    return 0;
}

int fmi2GetInteger(void *c, const unsigned *vr, size_t count, int *values)
{
    (void)c, (void)vr, (void)count;
    values[0] = states;
    return 0;
}

#ifdef ORDER
int fmi2SetRealInputDerivatives(void *c, const unsigned *vr, size_t count, const int *orders, const double *values)
{
    for (size_t k = 0; k < count; k++) {
        if (orders[k] > ORDER || vr[k] != 0) {
            return 3;
        }
        ((Species *)c)->rate = orders[k] == 1 ? values[k] : ((Species *)c)->rate;
    }
    return 0;
}
#endif

static double slope(const Species *s, double x, double since)
{
    double u = s->v[0] + s->rate * since;
    return x * (s->v[2] + s->v[3] * u) + s->v[4] * u;
}

int fmi2DoStep(void *c, double time, double step, int final)
{
    Species *s = c;
    int count = (int)ceil(step / 1e-3);
    double h = step / count;
    (void)final;
    s->held = s->v[0];
    s->is_set = 0;
    s->steps++;
    for (int k = 0; k < count; k++) {
        double t = k * h, p = slope(s, s->x, t), q = slope(s, s->x + 0.5 * h * p, t + 0.5 * h);
        double r = slope(s, s->x + 0.5 * h * q, t + 0.5 * h);
        s->x += h / 6.0 * (p + 2.0 * q + 2.0 * r + slope(s, s->x + h * r, t + h));
    }
#ifdef ROUGH
    s->x += 1e-5 * sin(1e9 * s->v[0]);
#endif
    s->time = time + step;
    return 0;
}

int fmi2GetFMUstate(void *c, void **state)
{
#ifdef REFUSED
    static int saved;
    if (++saved >= REFUSED) {
        return 3;
    }
#endif
    *state = malloc(sizeof(Species));
    states++;
    memcpy(*state, c, sizeof(Species));
    return 0;
}

int fmi2SetFMUstate(void *c, void *state)
{
    memcpy(c, state, sizeof(Species));
    return 0;
}

int fmi2FreeFMUstate(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    states--;
    return 0;
}

FINE(fmi2EnterInitializationMode) FINE(fmi2Terminate) FINE(fmi2Reset) FINE(fmi2SetDebugLogging)
