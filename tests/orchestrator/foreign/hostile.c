/* An FMU by hand that does harm where its text parameter `deed` says, as "where what when": from t = when on. Until that is
   set it is what resources/deed.txt holds. By value reference: 0 u, 1 v (real inputs); 2 x, 3 y (real outputs: der(x) = u
   by Euler's method, y = x + v); 4 calls, 5 pid (real outputs: how often it stepped, in which process); 6 m (integer
   input); 7 n (integer output: m + 1); 8 on (boolean input); 9 off (boolean output: not on); 10 deed (text parameter);
   11 word (text input); 12 said (text output: word, twice).
   Where: instantiate, setup, enter, exit, set, get, step, save, forget, derive, terminate, free.
   What: null (writes where nothing is),
   abort, exit (with code 7), kill (by SIGKILL), hang, slow (0.3 s), leak (16 MiB, and an error when there are no more),
   gulp (the same, and a crash), print (100 lines), say (a line to the logger and one printed), cry (the same, and null), fork (a child that stays),
   discard, error, fatal, nan, once (nothing but the process's first instance is made), and those of deeds.h. */

#define _GNU_SOURCE
#include "fmi2.h"
#include "deeds.h"

typedef struct {
    double reals[6], slope, time;
    int whole[2], truths[2];
    char texts[3][200];
} Values;
typedef struct {
    Values v;
    Logger logger;
    void *environment;
    char name[100];
} Hostile;

static int instances;

static void say(Hostile *s, int status, const char *text)
{
    s->logger(s->environment, s->name, status, "hostile", "%s: %s", s->name, text);
}

static int gulp(Hostile *s, int crash)
{
    char *more = malloc(16 << 20);
    if (more) {
        memset(more, 1, 16 << 20);
        return 0;
    }
    if (crash) {
        *(volatile int *)0 = 1;
    }
    say(s, 3, "no memory is left");
    return 3;
}

static int misbehave(Hostile *s, const char *here)
{
    char where[50] = "", what[50] = "";
    double when = 0.0;
    if (sscanf(s->v.texts[0], "%49s %49s %lf", where, what, &when) < 2 || strcmp(where, here) || s->v.time < when) {
        return 0;
    }
#define IS(name) (strcmp(what, name) == 0)
    if (IS("null")) {
        *(volatile int *)0 = 1;
    } else if (IS("abort")) {
        abort();
    } else if (IS("exit")) {
        exit(7);
    } else if (IS("kill")) {
        raise(SIGKILL);
    } else if (IS("hang")) {
        for (volatile int k = 0;; k++) {
        }
    } else if (IS("slow")) {
        usleep(300000);
    } else if (IS("leak") || IS("gulp")) {
        return gulp(s, IS("gulp"));
    } else if (IS("print")) {
        for (int k = 0; k < 100; k++) {
            printf("%s prints line %d of step %g\n", s->name, k, s->v.reals[4]);
        }
    } else if (IS("say") || IS("cry")) {
        say(s, 1, "beware");
        printf("printed at %g", s->v.time);
        printf(" s\n");
        if (IS("cry")) {
            *(volatile int *)0 = 1;
        }
    } else if (IS("fork")) {
        if (fork() == 0) {
            sleep(60);
            _exit(0);
        }
        abort();
    } else if (IS("discard") || IS("error") || IS("fatal")) {
        say(s, 3, what);
        return IS("discard") ? 2 : IS("error") ? 3 : 4;
    } else if (IS("once")) {
        return instances > 1;
    } else if (IS("nan")) {
        s->v.reals[2] = NAN;
    } else {
        return do_deed(what);
    }
    return 0;
}

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const Callbacks *callbacks,
                      int visible, int logging)
{
    instances++;
    Hostile *s = calloc(1, sizeof *s);
    strncpy(s->name, name, sizeof s->name - 1);
    s->logger = callbacks->logger;
    s->environment = callbacks->environment;
    s->v.reals[5] = getpid();
    char path[1000];
    snprintf(path, sizeof path, "%s/deed.txt", place + strlen("file://"));
    FILE *stream = fopen(path, "r");
    if (stream) {
        if (!fgets(s->v.texts[0], sizeof s->v.texts[0], stream)) {
            s->v.texts[0][0] = 0;
        }
        fclose(stream);
    }
    return misbehave(s, "instantiate") ? NULL : s;
}

void fmi2FreeInstance(void *c)
{
    misbehave(c, "free");
    instances--;
    free(c);
}

int fmi2SetupExperiment(void *c, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    ((Hostile *)c)->v.time = start;
    return misbehave(c, "setup");
}

int fmi2EnterInitializationMode(void *c)
{
    return misbehave(c, "enter");
}

int fmi2ExitInitializationMode(void *c)
{
    return misbehave(c, "exit");
}

int fmi2Terminate(void *c)
{
    return misbehave(c, "terminate");
}

int fmi2DoStep(void *c, double time, double step, int final)
{
    Hostile *s = c;
    s->v.time = time;
    int status = misbehave(s, "step");
    s->v.reals[2] += step * (s->v.reals[0] + 0.5 * step * s->v.slope);
    s->v.reals[4] += 1.0;
    s->v.slope = 0.0;
    s->v.time = time + step;
    return status;
}

int fmi2SetReal(void *c, const unsigned *vr, size_t count, const double *values)
{
    for (size_t k = 0; k < count; k++) {
        ((Hostile *)c)->v.reals[vr[k]] = values[k];
    }
    return misbehave(c, "set");
}

int fmi2GetReal(void *c, const unsigned *vr, size_t count, double *values)
{
    Hostile *s = c;
    int status = misbehave(s, "get");
    s->v.reals[3] = s->v.reals[2] + s->v.reals[1];
    for (size_t k = 0; k < count; k++) {
        values[k] = s->v.reals[vr[k]];
    }
    return status;
}

#define WHOLE(name, field, first, formula)                                                 \
    int fmi2Set##name(void *c, const unsigned *vr, size_t count, const int *values)   \
    {                                                                                 \
        for (size_t k = 0; k < count; k++) {                                          \
            ((Hostile *)c)->v.field[vr[k] - first] = values[k];                          \
        }                                                                             \
        return 0;                                                                     \
    }                                                                                 \
    int fmi2Get##name(void *c, const unsigned *vr, size_t count, int *values)         \
    {                                                                                 \
        Hostile *s = c;                                                               \
        s->v.field[1] = formula;                                                      \
        for (size_t k = 0; k < count; k++) {                                          \
            values[k] = s->v.field[vr[k] - first];                                    \
        }                                                                             \
        return 0;                                                                     \
    }
WHOLE(Integer, whole, 6, s->v.whole[0] + 1)
WHOLE(Boolean, truths, 8, !s->v.truths[0])

int fmi2SetString(void *c, const unsigned *vr, size_t count, const char *const *values)
{
    for (size_t k = 0; k < count; k++) {
        snprintf(((Hostile *)c)->v.texts[vr[k] - 10], 200, "%s", values[k]);
    }
    return 0;
}

int fmi2GetString(void *c, const unsigned *vr, size_t count, const char **values)
{
    Hostile *s = c;
    snprintf(s->v.texts[2], 200, "%.90s%.90s", s->v.texts[1], s->v.texts[1]);
    for (size_t k = 0; k < count; k++) {
        values[k] = s->v.texts[vr[k] - 10];
    }
    return 0;
}

int fmi2SetRealInputDerivatives(void *c, const unsigned *vr, size_t count, const int *orders, const double *values)
{
    ((Hostile *)c)->v.slope = values[0];
    return 0;
}

int fmi2GetDirectionalDerivative(void *c, const unsigned *unknown, size_t rows, const unsigned *known, size_t columns,
                                 const double *seed, double *found)
{
    for (size_t k = 0; k < rows; k++) {
        found[k] = unknown[k] == 3 && known[0] == 1 ? seed[0] : 0.0;
    }
    return misbehave(c, "derive");
}

int fmi2GetFMUstate(void *c, void **state)
{
    int status = misbehave(c, "save");
    if (!*state) {
        *state = malloc(sizeof(Values));
    }
    memcpy(*state, &((Hostile *)c)->v, sizeof(Values));
    return status;
}

int fmi2SetFMUstate(void *c, void *state)
{
    memcpy(&((Hostile *)c)->v, state, sizeof(Values));
    return 0;
}

int fmi2FreeFMUstate(void *c, void **state)
{
    free(*state);
    *state = NULL;
    return misbehave(c, "forget");
}

int fmi2SerializedFMUstateSize(void *c, void *state, size_t *size)
{
    *size = sizeof(Values);
    return 0;
}

int fmi2SerializeFMUstate(void *c, void *state, char *bytes, size_t size)
{
    memcpy(bytes, state, sizeof(Values));
    return 0;
}

int fmi2DeSerializeFMUstate(void *c, const char *bytes, size_t size, void **state)
{
    if (size != sizeof(Values)) {
        say(c, 3, "these bytes are not mine");
        return 3;
    }
    *state = malloc(sizeof(Values));
    memcpy(*state, bytes, sizeof(Values));
    return 0;
}

int fmi2GetRealStatus(void *c, int kind, double *value)
{
    return 2;
}

FINE(fmi2SetDebugLogging) FINE(fmi2Reset) FINE(fmi2GetRealOutputDerivatives) FINE(fmi2CancelStep) FINE(fmi2GetStatus)
FINE(fmi2GetIntegerStatus) FINE(fmi2GetBooleanStatus) FINE(fmi2GetStringStatus)
