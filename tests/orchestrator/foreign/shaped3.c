/* An FMI 3.0 FMU by hand whose arrays have the size of a structural parameter n: y = 2 u (n), z the sum of m (n by 2); echo
   is blob backwards, echoes are blobs. It keeps a list of what may be called when (FMI 3.0, 2.3 and 4.2): n is set in
   configuration mode and nothing else there; sizes that do not fit are refused. With mode 1 a step that is longer than
   0.05 s returns early, half way (4.2.2); with mode 2 echo has a length and no address. No intermediate update and no event
   mode must be asked for. */

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 8, LONG = 16 };
enum { INSTANTIATED, CONFIGURING, INITIALIZING, STEPPING };

typedef void (*Logger)(void *environment, int status, const char *category, const char *text);
typedef struct {
    size_t size;
    uint8_t bytes[LONG];
} Bytes;
typedef struct {
    int state, mode, steps;
    size_t n;
    double u[MOST], m[2 * MOST], time;
    bool halved;
    Bytes blob, echo, blobs[2];
    void *environment;
    Logger logger;
} Shaped;

static int refuse(Shaped *s, const char *why)
{
    s->logger(s->environment, 3, "shaped", why);
    return 3;
}

static void begin(Shaped *s)
{
    s->state = INSTANTIATED;
    s->mode = s->steps = 0;
    s->n = 3;
    s->halved = false;
    for (int k = 0; k < MOST; k++) {
        s->u[k] = k < 3 ? k + 1.0 : 0.25; /* which no description says */
        s->m[2 * k] = s->m[2 * k + 1] = 1.5;
    }
    s->blob = (Bytes){2, {0x00, 0xff}};
    s->blobs[0] = (Bytes){1, {0x01}};
    s->blobs[1] = (Bytes){0, {0}};
}

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool events, bool early, const unsigned *intermediate, size_t count,
                                  void *environment, Logger logger, void *update)
{
    if (events || !early || intermediate || count || update) {
        logger(environment, 3, "shaped", "what was not offered is asked for");
        return NULL;
    }
    Shaped *s = calloc(1, sizeof *s);
    s->environment = environment;
    s->logger = logger;
    begin(s);
    return s;
}

void fmi3FreeInstance(void *c)
{
    free(c);
}

static int go(Shaped *s, int from, int to, const char *why)
{
    if (s->state != from) {
        return refuse(s, why);
    }
    s->state = to;
    return 0;
}

int fmi3EnterConfigurationMode(void *c)
{
    return go(c, INSTANTIATED, CONFIGURING, "no configuration mode from here");
}

int fmi3ExitConfigurationMode(void *c)
{
    return go(c, CONFIGURING, INSTANTIATED, "no configuration mode to leave");
}

int fmi3EnterInitializationMode(void *c, bool has_tolerance, double tolerance, double start, bool has_stop, double stop)
{
    ((Shaped *)c)->time = start;
    return go(c, INSTANTIATED, INITIALIZING, "no initialization from here");
}

int fmi3ExitInitializationMode(void *c)
{
    return go(c, INITIALIZING, STEPPING, "no initialization to leave");
}

int fmi3Terminate(void *c)
{
    return 0;
}

int fmi3Reset(void *c)
{
    begin(c);
    return 0;
}

int fmi3DoStep(void *c, double time, double step, bool final, bool *event, bool *ends, bool *early, double *reached)
{
    Shaped *s = c;
    *ends = *event = false;
    *early = s->mode == 1 && step > 0.05;
    s->steps++;
    s->time = *reached = time + (*early ? 0.5 : 1.0) * step;
    return s->state == STEPPING ? 0 : refuse(s, "a step before its time");
}

/* Value references: 1 n, 2 u, 3 y, 4 m, 5 z, 6 blob, 7 echo, 8 blobs, 9 echoes, 10 mode, 11 steps, 12 halved, 13 t. */

int fmi3SetUInt64(void *c, const unsigned *vr, size_t count, const uint64_t *values, size_t size)
{
    Shaped *s = c;
    if (s->state != CONFIGURING || count != 1 || size != 1 || vr[0] != 1 || values[0] > MOST) {
        return refuse(s, "n is set in configuration mode, up to 8");
    }
    s->n = values[0];
    return 0;
}

int fmi3GetUInt64(void *c, const unsigned *vr, size_t count, uint64_t *values, size_t size)
{
    values[0] = ((Shaped *)c)->n;
    return 0;
}

int fmi3SetBoolean(void *c, const unsigned *vr, size_t count, const bool *values, size_t size)
{
    Shaped *s = c;
    s->halved = values[0];
    return s->state == CONFIGURING ? 0 : refuse(s, "a structural parameter is set in configuration mode");
}

static double *place(Shaped *s, unsigned vr, size_t *size)
{
    *size = vr == 2 ? s->n : vr == 4 ? 2 * s->n : 0;
    return vr == 2 ? s->u : s->m;
}

int fmi3SetFloat64(void *c, const unsigned *vr, size_t count, const double *values, size_t size)
{
    Shaped *s = c;
    if (s->state == CONFIGURING) {
        return refuse(s, "configuration mode is for structural parameters");
    }
    size_t done = 0, own;
    for (size_t k = 0; k < count; k++, done += own) {
        double *kept = place(s, vr[k], &own);
        if (own == 0 || done + own > size) {
            return refuse(s, "sizes that do not fit");
        }
        memcpy(kept, values + done, own * sizeof *kept);
    }
    return done == size ? 0 : refuse(s, "sizes that do not fit");
}

int fmi3GetFloat64(void *c, const unsigned *vr, size_t count, double *values, size_t size)
{
    Shaped *s = c;
    size_t done = 0;
    for (size_t k = 0; k < count; k++) {
        size_t own = vr[k] == 5 || vr[k] == 13 ? 1 : vr[k] == 4 ? 2 * s->n : s->n;
        if (done + own > size) {
            return refuse(s, "sizes that do not fit");
        }
        double sum = 0.0;
        for (size_t j = 0; j < 2 * s->n; j++) {
            sum += s->m[j];
        }
        for (size_t j = 0; j < own; j++) {
            values[done++] = vr[k] == 2    ? s->u[j]
                             : vr[k] == 3  ? (s->halved ? 0.5 : 2.0) * s->u[j]
                             : vr[k] == 4  ? s->m[j]
                             : vr[k] == 13 ? s->time
                                           : sum;
        }
    }
    return done == size ? 0 : refuse(s, "sizes that do not fit");
}

int fmi3SetInt32(void *c, const unsigned *vr, size_t count, const int32_t *values, size_t size)
{
    ((Shaped *)c)->mode = values[0];
    return 0;
}

int fmi3GetInt32(void *c, const unsigned *vr, size_t count, int32_t *values, size_t size)
{
    for (size_t k = 0; k < count; k++) {
        values[k] = vr[k] == 10 ? ((Shaped *)c)->mode : ((Shaped *)c)->steps;
    }
    return 0;
}

int fmi3SetBinary(void *c, const unsigned *vr, size_t count, const size_t *sizes, const uint8_t *const *values, size_t size)
{
    Shaped *s = c;
    size_t n = 0;
    for (size_t k = 0; k < count; k++) {
        Bytes *kept = vr[k] == 6 ? &s->blob : s->blobs;
        for (int j = 0; j < (vr[k] == 6 ? 1 : 2); j++, n++) {
            if (n == size || sizes[n] > LONG || values[n] == NULL) {
                return refuse(s, "bytes that do not fit");
            }
            kept[j].size = sizes[n];
            memcpy(kept[j].bytes, values[n], sizes[n]);
        }
    }
    return n == size ? 0 : refuse(s, "bytes that do not fit");
}

int fmi3GetBinary(void *c, const unsigned *vr, size_t count, size_t *sizes, const uint8_t **values, size_t size)
{
    Shaped *s = c;
    size_t n = 0;
    s->echo.size = s->blob.size;
    for (size_t k = 0; k < s->blob.size; k++) {
        s->echo.bytes[k] = s->blob.bytes[s->blob.size - 1 - k];
    }
    for (size_t k = 0; k < count; k++) {
        Bytes *kept = vr[k] == 6 ? &s->blob : vr[k] == 7 ? &s->echo : s->blobs;
        for (int j = 0; j < (vr[k] < 8 ? 1 : 2); j++, n++) {
            sizes[n] = kept[j].size;
            values[n] = kept[j].size == 0 || s->mode == 2 ? NULL : kept[j].bytes;
        }
    }
    return n == size ? 0 : refuse(s, "bytes that do not fit");
}
