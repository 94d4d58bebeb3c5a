/* der(x) = rate (u - x) with nothing checked and one Euler step: about the least that an FMU can do, so that the master's
   own cost shows. The macros U, X and RATE are value references of the component's FMU, whose library this replaces. */

#include <stddef.h>
#include <stdlib.h>

enum { N = U + X + RATE + 1 };

void *fmi2Instantiate(void)
{
    return calloc(N, sizeof(double));
}

void fmi2FreeInstance(void *c)
{
    free(c);
}

int fmi2SetReal(void *c, const unsigned *vr, size_t count, const double *values)
{
    double *v = c;
    for (size_t k = 0; k < count; k++) {
        if (vr[k] < N) {
            v[vr[k]] = values[k];
        }
    }
    return 0;
}

int fmi2GetReal(void *c, const unsigned *vr, size_t count, double *values)
{
    const double *v = c;
    for (size_t k = 0; k < count; k++) {
        values[k] = vr[k] < N ? v[vr[k]] : 0.0;
    }
    return 0;
}

int fmi2DoStep(void *c, double time, double step, int final)
{
    double *v = c;
    (void)time;
    (void)final;
    v[X] += step * v[RATE] * (v[U] - v[X]);
    return 0;
}

const char *fmi2GetVersion(void)
{
    return "2.0";
}

const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

#define FINE(name) int name(void) { return 0; }
FINE(fmi2SetupExperiment) FINE(fmi2EnterInitializationMode) FINE(fmi2ExitInitializationMode) FINE(fmi2Terminate)
FINE(fmi2SetDebugLogging) FINE(fmi2Reset) FINE(fmi2GetString) FINE(fmi2SetString) FINE(fmi2GetInteger)
FINE(fmi2SetInteger) FINE(fmi2GetBoolean) FINE(fmi2SetBoolean) FINE(fmi2GetFMUstate) FINE(fmi2SetFMUstate)
FINE(fmi2FreeFMUstate) FINE(fmi2SerializedFMUstateSize) FINE(fmi2SerializeFMUstate) FINE(fmi2DeSerializeFMUstate)
FINE(fmi2GetDirectionalDerivative) FINE(fmi2SetRealInputDerivatives) FINE(fmi2GetRealOutputDerivatives)
FINE(fmi2CancelStep) FINE(fmi2GetStatus) FINE(fmi2GetRealStatus) FINE(fmi2GetIntegerStatus)
FINE(fmi2GetBooleanStatus) FINE(fmi2GetStringStatus)
