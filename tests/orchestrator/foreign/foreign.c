/* An FMU of another maker, which does what its parameter `mode` says once its parameter `at` (5 s) is reached. Until it
   is set, the mode is what resources/mode.txt holds. By value reference:
   real     0 u (input); 1 y (output: gain * u); 2 gain (tunable parameter); 3 x (output, state: der(x) = u); 4 calls
            (output: how often fmi2DoStep was called); 5 at (parameter); 6 longest (parameter: the longest step that is
            taken in modes 11 and 14); 7 now (output: its own time); from 100 on 2 k is an input, 2 k + 1 an output that
            follows it
   integer  0 mode (parameter); 1 m (input); 2 n (output: m + 1); 3 gear (input, enumeration); 4 next (output,
            enumeration: gear)
   boolean  0 on (input); 1 off (output: not on)
   string   0 label (parameter); 1 word (input); 2 said (output: label and word)
   Modes:
   1 to 6   the status of the step
   10 to 18 discarded steps: 10 gets three fifths of the step done, once; 11 refuses more than `longest`; 12 asks for the
            end; 13 does not say how far it got; 14 is 11 without a word of how far; 15 gets next to nothing done each
            time; 16 claims to be far past the end; 17 is 12 without a word of when; 18 says that it got to NaN
   19       is 11, but what it got done of a longer step has to be taken back: it says how far it would get, and refuses
            every step until a saved state is restored
   20 to 24 values: 20, 21, 22: y is NaN, infinite, minus infinite; 23: said has ends of lines; 24: said is no text
   30, 31   the end of the process: a segmentation fault, exit(7)
   40, 50   40 takes 2 ms for each step; 50 refuses a step past the stop time, be it by a rounding error
   100 on   calls that fail with the status mode - 100 k, k being 1 getReal, 2 setReal, 3 terminate, 4 getFMUstate,
            5 exitInitializationMode, 6 getString
   -DBARE leaves out what the standard demands and hardly any FMU needs; -DLAME leaves out fmi2DoStep as well.
   Calls that begin, step and end are written to the file that the environment variable FOREIGN_TRACE names. */

#include "fmi2.h"

#define REALS 12000
#ifndef TRUE
#define TRUE 1 /* any number but 0 */
#endif

typedef struct {
    double reals[REALS];
    int whole[5], truths[2];
    char texts[3][300];
    double time, reached, stop;
    int ends, stuck;
    Logger logger;
    void *environment;
    char name[200];
} Foreign;

static void trace(const char *call)
{
    const char *path = getenv("FOREIGN_TRACE");
    FILE *file = path ? fopen(path, "a") : NULL;
    if (file) {
        fprintf(file, "%s\n", call);
        fclose(file);
    }
}

static int tell(Foreign *s, int status)
{
    if (status) {
        s->logger(s->environment, s->name, status, "foreign", "%s does as it was told: %d", s->name, status);
    }
    return status;
}

static int mode(const Foreign *s)
{
    return s->time >= s->reals[5] - 1e-9 ? s->whole[0] : 0;
}

static int hundreds(Foreign *s, int k)
{
    return mode(s) / 100 == k ? tell(s, mode(s) % 100) : 0;
}

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const Callbacks *callbacks,
                      int visible, int logging)
{
    char path[4000];
    FILE *file;
    Foreign *s;
    (void)visible;
    trace("instantiate");
    if (kind != 1 || strcmp(guid, "{1}")) {
        if (logging) {
            callbacks->logger(callbacks->environment, name, 3, "foreign", "wrong guid %s", guid);
        }
        return NULL;
    }
    s = calloc(1, sizeof *s);
    strncpy(s->name, name, sizeof s->name - 1);
    s->logger = callbacks->logger;
    s->environment = callbacks->environment;
    s->reals[2] = 2.0;
    s->reals[5] = 5.0;
    s->reals[6] = 1e9;
    snprintf(path, sizeof path, "%s/mode.txt", place + strlen("file://"));
    file = fopen(path, "r");
    if (file) {
        if (fscanf(file, "%d", &s->whole[0]) != 1) {
            s->whole[0] = 0;
        }
        fclose(file);
    }
    return s;
}

void fmi2FreeInstance(void *c)
{
    trace("free");
    free(c);
}

int fmi2SetupExperiment(void *c, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance;
    trace("setup");
    ((Foreign *)c)->time = start;
    ((Foreign *)c)->stop = has_stop ? stop : HUGE_VAL;
    return 0;
}

int fmi2EnterInitializationMode(void *c)
{
    (void)c;
    trace("enter");
    return 0;
}

int fmi2ExitInitializationMode(void *c)
{
    Foreign *s = c;
    trace("exit");
    return s->whole[0] / 100 == 5 ? tell(s, s->whole[0] % 100) : 0;
}

int fmi2Terminate(void *c)
{
    trace("terminate");
    return hundreds(c, 3);
}

int fmi2SetReal(void *c, const unsigned *vr, size_t count, const double *values)
{
    Foreign *s = c;
    for (size_t k = 0; k < count; k++) {
        s->reals[vr[k]] = values[k];
    }
    return hundreds(s, 2);
}

int fmi2GetReal(void *c, const unsigned *vr, size_t count, double *values)
{
    static const double wrong[] = {NAN, INFINITY, -INFINITY};
    Foreign *s = c;
    int how = mode(s);
    s->reals[1] = how >= 20 && how < 23 ? wrong[how - 20] : s->reals[2] * s->reals[0];
    s->reals[7] = s->time;
    for (size_t k = 0; k < count; k++) {
        values[k] = s->reals[vr[k] < 100 ? vr[k] : vr[k] & ~1u];
    }
    return hundreds(s, 1);
}

#ifndef LAME
static int advance(Foreign *s, double step)
{
    s->reals[3] += step * s->reals[0];
    s->time += step;
    s->reached = s->time;
    return 0;
}

static int discard(Foreign *s, double step, double done)
{
    if (done > 0.0) {
        advance(s, done * step);
    }
    s->reached = s->time;
    return tell(s, 2);
}

int fmi2DoStep(void *c, double time, double step, int final)
{
    Foreign *s = c;
    int how = mode(s);
    (void)final;
    trace("step");
    s->reals[4] += 1.0;
    if (fabs(time - s->time) > 1e-9 * (1.0 + fabs(time))) {
        s->logger(s->environment, s->name, 3, "foreign", "asked to step from %g, but am at %g", time, s->time);
        return 3;
    }
    if (how >= 1 && how <= 6) {
        if (how == 1) {
            advance(s, step);
        }
        return tell(s, how);
    }
    switch (how) {
    case 10:
        s->whole[0] = 0;
        return discard(s, step, 0.6);
    case 11:
    case 14:
        return step > s->reals[6] * (1.0 + 1e-9) ? discard(s, step, 0.0) : advance(s, step);
    case 19:
        if (s->stuck) {
            return tell(s, 3);
        }
        if (step > s->reals[6] * (1.0 + 1e-9)) {
            discard(s, step, s->reals[6] / step);
            s->stuck = 1;
            return 2;
        }
        return advance(s, step);
    case 12:
    case 17:
        s->ends = 1;
        return discard(s, step, 0.5);
    case 13:
        return discard(s, step, 0.5);
    case 15:
        return discard(s, step, 1e-9);
    case 16:
    case 18:
        advance(s, step);
        s->reached = how == 16 ? s->time + 100.0 : NAN;
        return tell(s, 2);
    case 30:
        raise(SIGSEGV);
        break;
    case 31:
        exit(7);
    case 50:
        if (time + step > s->stop) {
            return tell(s, 3);
        }
        break;
    case 40:
        usleep(2000);
        break;
    }
    return advance(s, step);
}
#endif

#ifndef BARE
int fmi2SetInteger(void *c, const unsigned *vr, size_t count, const int *values)
{
    for (size_t k = 0; k < count; k++) {
        ((Foreign *)c)->whole[vr[k]] = values[k];
    }
    return 0;
}

int fmi2GetInteger(void *c, const unsigned *vr, size_t count, int *values)
{
    Foreign *s = c;
    s->whole[2] = s->whole[1] + 1;
    s->whole[4] = s->whole[3];
    for (size_t k = 0; k < count; k++) {
        values[k] = s->whole[vr[k]];
    }
    return 0;
}

int fmi2SetBoolean(void *c, const unsigned *vr, size_t count, const int *values)
{
    for (size_t k = 0; k < count; k++) {
        ((Foreign *)c)->truths[vr[k]] = values[k];
    }
    return 0;
}

int fmi2GetBoolean(void *c, const unsigned *vr, size_t count, int *values)
{
    Foreign *s = c;
    s->truths[1] = !s->truths[0];
    for (size_t k = 0; k < count; k++) {
        values[k] = s->truths[vr[k]] ? TRUE : 0;
    }
    return 0;
}

int fmi2SetString(void *c, const unsigned *vr, size_t count, const char *const *values)
{
    Foreign *s = c;
    for (size_t k = 0; k < count; k++) {
        snprintf(s->texts[vr[k]], sizeof s->texts[0], "%s", values[k]);
    }
    return 0;
}

int fmi2GetString(void *c, const unsigned *vr, size_t count, const char **values)
{
    Foreign *s = c;
    snprintf(s->texts[2], sizeof s->texts[2], mode(s) == 23 ? "a\rb\nc\r\n%s\"%s" : "%s %s", s->texts[0], s->texts[1]);
    for (size_t k = 0; k < count; k++) {
        values[k] = mode(s) == 24 ? NULL : s->texts[vr[k]];
    }
    return hundreds(s, 6);
}

int fmi2GetRealStatus(void *c, int kind, double *value)
{
    Foreign *s = c;
    int how = mode(s);
    trace("real status");
    if (how == 13 || how == 14 || how == 17) {
        return 3;
    }
    *value = s->reached;
    return kind == 2 ? 0 : 2;
}

int fmi2GetBooleanStatus(void *c, int kind, int *value)
{
    *value = ((Foreign *)c)->ends;
    return kind == 3 ? 0 : 2;
}

int fmi2CancelStep(void *c)
{
    (void)c;
    trace("cancel");
    return 0;
}

int fmi2GetFMUstate(void *c, void **state)
{
    int status = hundreds(c, 4);
    *state = NULL;
    if (!status) {
        *state = malloc(sizeof(Foreign));
        memcpy(*state, c, sizeof(Foreign));
    }
    return status;
}

int fmi2SetFMUstate(void *c, void *state)
{
    memcpy(c, state, sizeof(Foreign));
    return 0;
}

int fmi2FreeFMUstate(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return 0;
}

FINE(fmi2SetDebugLogging) FINE(fmi2Reset) FINE(fmi2SerializedFMUstateSize) FINE(fmi2SerializeFMUstate)
FINE(fmi2DeSerializeFMUstate) FINE(fmi2GetDirectionalDerivative) FINE(fmi2SetRealInputDerivatives)
FINE(fmi2GetRealOutputDerivatives) FINE(fmi2GetStatus) FINE(fmi2GetIntegerStatus) FINE(fmi2GetStringStatus)
#endif
