/* An FMI 3.0 FMU by hand whose variables are arrays: y = 2 u (2 by 3), a number of every element of which is set or read at
   once; z = k . u[1,:] + der; on, off: two booleans and their opposites; words and their copies; n and m: whole numbers; w:
   a whole number of another type, of which nothing comes; wide and wider: whole numbers of 64 bits, where a description has
   them.
   What is set or read in part, with another number of values than the arrays have, is refused. */

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef void (*Logger)(void *environment, int status, const char *category, const char *text);
typedef struct {
    double u[6], k[3];
    int n[2];
    long long w;
    bool on[2];
    char words[2][100];
    unsigned long long wide[2];
} Arrays;

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool events, bool early, const unsigned *intermediate, size_t count,
                                  void *environment, Logger logger, void *update)
{
    return calloc(1, sizeof(Arrays));
}

void fmi3FreeInstance(void *c)
{
    free(c);
}

int fmi3EnterInitializationMode(void *c, bool has_tolerance, double tolerance, double start, bool has_stop, double stop)
{
    return 0;
}

int fmi3ExitInitializationMode(void *c)
{
    return 0;
}

int fmi3Terminate(void *c)
{
    return 0;
}

int fmi3DoStep(void *c, double time, double step, bool final, bool *event, bool *ends, bool *early, double *reached)
{
    *ends = *early = *event = false;
    *reached = time + step;
    return 0;
}

/* Value references: 1 u, 2 y, 3 k, 4 z, 5 n, 6 m, 7 on, 8 off, 9 words, 10 copies. */

int fmi3SetFloat64(void *c, const unsigned *vr, size_t count, const double *values, size_t size)
{
    Arrays *s = c;
    size_t at = 0;
    for (size_t i = 0; i < count; i++) {
        size_t length = vr[i] == 1 ? 6 : 3;
        if ((vr[i] != 1 && vr[i] != 3) || at + length > size) {
            return 3;
        }
        memcpy(vr[i] == 1 ? s->u : s->k, values + at, length * sizeof *values);
        at += length;
    }
    return at == size ? 0 : 3;
}

int fmi3GetFloat64(void *c, const unsigned *vr, size_t count, double *values, size_t size)
{
    Arrays *s = c;
    size_t at = 0;
    for (size_t i = 0; i < count; i++) {
        size_t length = vr[i] <= 2 ? 6 : vr[i] == 3 ? 3 : 1;
        if (at + length > size) {
            return 3;
        }
        for (size_t j = 0; j < length; j++) {
            values[at + j] = vr[i] == 1   ? s->u[j]
                             : vr[i] == 2 ? 2.0 * s->u[j]
                             : vr[i] == 3 ? s->k[j]
                                          : s->k[0] * s->u[0] + s->k[1] * s->u[1] + s->k[2] * s->u[2];
        }
        at += length;
    }
    return at == size ? 0 : 3;
}

#define PAIRS(name, type, kept, other)                                                                                 \
    int fmi3Set##name(void *c, const unsigned *vr, size_t count, const type *values, size_t size)                      \
    {                                                                                                                  \
        memcpy(((Arrays *)c)->kept, values, 2 * sizeof *values);                                                       \
        return count == 1 && size == 2 ? 0 : 3;                                                                        \
    }                                                                                                                  \
    int fmi3Get##name(void *c, const unsigned *vr, size_t count, type *values, size_t size)                            \
    {                                                                                                                  \
        for (size_t i = 0; i < size; i++) {                                                                            \
            type value = ((Arrays *)c)->kept[i % 2];                                                                   \
            values[i] = vr[i / 2] % 2 ? value : other;                                                                 \
        }                                                                                                              \
        return size == 2 * count ? 0 : 3;                                                                              \
    }
int fmi3SetInt64(void *c, const unsigned *vr, size_t count, const long long *values, size_t size)
{
    ((Arrays *)c)->w = values[0];
    return count == 1 && size == 1 && vr[0] == 11 ? 0 : 3;
}

PAIRS(Int32, int, n, -value)
PAIRS(Boolean, bool, on, !value)
PAIRS(UInt64, unsigned long long, wide, value)

int fmi3SetString(void *c, const unsigned *vr, size_t count, const char *const *values, size_t size)
{
    for (size_t k = 0; k < 2; k++) {
        strncpy(((Arrays *)c)->words[k], values[k], 99);
    }
    return count == 1 && size == 2 ? 0 : 3;
}

int fmi3GetString(void *c, const unsigned *vr, size_t count, const char **values, size_t size)
{
    for (size_t k = 0; k < size; k++) {
        values[k] = ((Arrays *)c)->words[k % 2];
    }
    return size == 2 * count ? 0 : 3;
}

/* Of y to u, and of z to u. */
int fmi3GetDirectionalDerivative(void *c, const unsigned *unknowns, size_t rows, const unsigned *knowns, size_t columns,
                                 const double *seed, size_t seeds, double *found, size_t size)
{
    Arrays *s = c;
    if (columns != 1 || seeds != 6 || rows != 1 || size != (unknowns[0] == 2 ? 6 : 1)) {
        return 3;
    }
    for (size_t k = 0; k < size; k++) {
        found[k] = unknowns[0] == 2 ? 2.0 * seed[k] : s->k[0] * seed[0] + s->k[1] * seed[1] + s->k[2] * seed[2];
    }
    return 0;
}
