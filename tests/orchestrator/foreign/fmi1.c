/* An FMI 1.0 FMU by hand: der(x) = u - x, solved exactly over a step, and an input and an output of every type, which
   gives what the input was a step ago. It insists on the order of calls. From t = 5 s on its parameter `mode` rules:
   1 to 5 and 9: the step gives that status (9: -1); 6: a step takes 0.05 s at most, and says how far it came; 7: a step of
   more than 0.05 s is refused, and the next must be told to be a repetition; 10: numbers are rounded upward; 14, 15, 16: the step crashes, hangs, ends the process;
   17, 18: reading, setting booleans crashes; 20 + s: the status of getting reals, 30 + s: of getting texts, 40 + s: of setting them. At any
   time 90: initialization fails. Value references: reals 0 u, 1 x, 2 y = x + gain * u, 3 gain, 4 guess, 5 pi, 6 twice the
   gain, 7 switch; whole numbers 0 n, 1 m, 2 gear, 3 shown, 4 mode; booleans 0 on, 1 off; texts 0 word, 1 said. */

#include <fenv.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef void (*Logger)(void *c, const char *instance, int status, const char *category, const char *text, ...);
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished;
} Callbacks;
typedef struct {
    double reals[8], time;
    int whole[5], ready, refused;
    char flags[2], texts[2][100], name[100];
    Logger logger;
} First;

#ifndef TRUE
#define TRUE 1 /* any char but 0 */
#endif
#define EXPORT(name) First_##name

static int tell(First *s, int status, const char *text)
{
    if (status) {
        s->logger(s, s->name, status, "first", "%s says: %s, %d", s->name, text, status);
    }
    return status;
}

static int mode(const First *s)
{
    return s->time >= 5.0 ? s->whole[4] : 0;
}

/* A deed of the mode in a call: in the step, in reading or in setting booleans, which begin there. */
static void misbehave(const First *s, int begin)
{
    int how = mode(s);
    if (how == 14 + begin) {
        *(volatile int *)0 = 1;
    }
    if (how == 16 && begin == 0) {
        exit(7);
    }
    for (volatile int k = 0; how == 15 && begin == 0; k++) {
    }
}

void *EXPORT(fmiInstantiateSlave)(const char *name, const char *guid, const char *place, const char *mime, double timeout,
                                  char visible, char interactive, Callbacks callbacks, char logging)
{
    if (strcmp(guid, "{1}") || strcmp(mime, "application/x-fmu-sharedlibrary") || strncmp(place, "file:///", 8)) {
        callbacks.logger(NULL, name, 3, "first", "not with %s and %s", guid, mime);
        return NULL;
    }
    First *s = calloc(1, sizeof *s);
    strncpy(s->name, name, sizeof s->name - 1);
    s->logger = callbacks.logger;
    s->reals[1] = s->reals[3] = 1.0;
    s->reals[4] = 2.0;
    s->reals[5] = 3.0;
    s->whole[2] = s->whole[3] = 1;
    return s;
}

#ifdef RESET /* what comes of it */
int EXPORT(fmiResetSlave)(void *c)
{
    First *s = c, fresh = {0};
    memcpy(fresh.name, s->name, sizeof s->name);
    fresh.logger = s->logger;
    fresh.reals[1] = fresh.reals[3] = 1.0;
    fresh.reals[4] = 2.0;
    fresh.reals[5] = 3.0;
    fresh.whole[2] = fresh.whole[3] = 1;
    *s = fresh;
    return RESET;
}
#endif

void EXPORT(fmiFreeSlaveInstance)(void *c)
{
    free(c);
}

int EXPORT(fmiInitializeSlave)(void *c, double start, char has_stop, double stop)
{
    First *s = c;
    if (s->ready || !has_stop || stop <= start || s->whole[4] == 40) {
        return tell(s, 3, "no initialization");
    }
    s->time = start;
    s->ready = 1;
    return 0;
}

int EXPORT(fmiTerminateSlave)(void *c)
{
    return tell(c, ((First *)c)->ready ? 0 : 3, "termination");
}

int EXPORT(fmiSetReal)(void *c, const unsigned *vr, size_t count, const double *values)
{
    for (size_t k = 0; k < count; k++) {
        ((First *)c)->reals[vr[k]] = values[k];
    }
    return 0;
}

int EXPORT(fmiGetReal)(void *c, const unsigned *vr, size_t count, double *values)
{
    First *s = c;
    s->reals[2] = s->reals[1] + s->reals[3] * s->reals[0];
    s->reals[6] = 2.0 * s->reals[3];
    for (size_t k = 0; k < count; k++) {
        values[k] = s->reals[vr[k]];
    }
    int status = !s->ready ? 3 : mode(s) >= 20 && mode(s) < 30 ? mode(s) - 20 : 0;
    return tell(s, status, "reading");
}

int EXPORT(fmiSetInteger)(void *c, const unsigned *vr, size_t count, const int *values)
{
    for (size_t k = 0; k < count; k++) {
        ((First *)c)->whole[vr[k]] = values[k];
    }
    return 0;
}

int EXPORT(fmiGetInteger)(void *c, const unsigned *vr, size_t count, int *values)
{
    for (size_t k = 0; k < count; k++) {
        values[k] = ((First *)c)->whole[vr[k]];
    }
    return 0;
}

int EXPORT(fmiSetBoolean)(void *c, const unsigned *vr, size_t count, const char *values)
{
    for (size_t k = 0; k < count; k++) {
        ((First *)c)->flags[vr[k]] = values[k];
    }
    misbehave(c, 4);
    return 0;
}

int EXPORT(fmiGetBoolean)(void *c, const unsigned *vr, size_t count, char *values)
{
    for (size_t k = 0; k < count; k++) {
        values[k] = ((First *)c)->flags[vr[k]] ? TRUE : 0;
    }
    misbehave(c, 3);
    return 0;
}

int EXPORT(fmiSetString)(void *c, const unsigned *vr, size_t count, const char *const *values)
{
    for (size_t k = 0; k < count; k++) {
        strncpy(((First *)c)->texts[vr[k]], values[k], 99);
    }
    return mode(c) >= 40 && mode(c) < 50 ? tell(c, mode(c) - 40, "setting texts") : 0;
}

int EXPORT(fmiGetString)(void *c, const unsigned *vr, size_t count, const char **values)
{
    for (size_t k = 0; k < count; k++) {
        values[k] = ((First *)c)->texts[vr[k]];
    }
    return mode(c) >= 30 && mode(c) < 40 ? tell(c, mode(c) - 30, "reading texts") : 0;
}

int EXPORT(fmiSetRealInputDerivatives)(void *c, const unsigned *vr, size_t count, const int *order, const double *values)
{
    First *s = c;
    for (size_t k = 0; k < count; k++) {
        s->reals[vr[k]] += 100.0 * order[k] + values[k]; /* to be seen by the test */
    }
    return 0;
}

int EXPORT(fmiDoStep)(void *c, double time, double step, char is_new)
{
    First *s = c;
    int how = mode(s), status = how >= 1 && how <= 5 ? how : how == 9 ? -1 : 0;
    if (!s->ready || fabs(time - s->time) > 1e-9 || is_new == s->refused) {
        return tell(s, 3, "a step that was not expected");
    }
    s->refused = 0;
    misbehave(s, 0);
    if (how == 6 && step > 0.05) {
        step = 0.05;
        status = 2;
    }
    if (how == 7 && step > 0.05) {
        s->refused = 1;
        return tell(s, 2, "too long");
    }
    s->reals[1] = s->reals[0] + (s->reals[1] - s->reals[0]) * exp(-step);
    s->whole[1] = s->whole[0] + 1;
    s->whole[3] = s->whole[2];
    s->flags[1] = s->flags[0] ? 0 : -1; /* what is not zero is true */
    strcpy(s->texts[1], s->texts[0]);
    s->time = time + step;
    if (how == 10) {
        fesetround(FE_UPWARD);
    }
    return tell(s, status, "as it was told");
}

int EXPORT(fmiCancelStep)(void *c)
{
    return 0;
}

int EXPORT(fmiGetRealStatus)(void *c, int kind, double *value)
{
    First *s = c;
    *value = s->time;
    return kind == 2 && (mode(s) == 6 || mode(s) == 7) ? 0 : 2;
}
