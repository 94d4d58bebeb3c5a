/* A small FMU of FMPy's headers, dy/dt = k + u - y by Euler's method, that insists on the order of calls. By value
   reference: 0 y (output), 1 u (input), 2 k (parameter). What ON_INSTANTIATE, ON_RESET, ON_GET, ON_STEP, ON_RESTORE and
   ON_FREE are defined as is done there, BEFORE stands before all; with -DSHARED_STATE=1 all instances have one state. */

#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"
typedef struct { double t, y, u, k; int phase; fmi2CallbackLogger log; } Model;
#ifndef SHARED_STATE
#define SHARED_STATE 0
#endif
static double shared;
#ifdef BEFORE
BEFORE
#endif
#define M ((Model *)c)
#define Y (*(SHARED_STATE ? &shared : &M->y))
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) { return fmi2OK; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String place,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    ON_INSTANTIATE
    Model *c = calloc(1, sizeof(Model));
    c->k = 1.0;
    c->log = functions->logger;
    return c;
}
void fmi2FreeInstance(fmi2Component c) { ON_FREE free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real start, fmi2Boolean d, fmi2Real e)
{ M->t = start; Y = 0.0; return fmi2OK; }
static fmi2Status go(fmi2Component c, int from) { if (M->phase != from) return fmi2Error; M->phase++; return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return go(c, 0); }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return go(c, 1); }
fmi2Status fmi2Terminate(fmi2Component c) { M->phase = 3; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { ON_RESET M->phase = 0; M->t = 0.0; M->u = 0.0; M->k = 1.0; return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real v[])
{
    for (size_t i = 0; i < n; i++) {
        ON_GET
        if (vr[i] > 2) return fmi2Error;
        v[i] = vr[i] == 0 ? Y : vr[i] == 1 ? M->u : M->k;
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real v[])
{
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == 1) M->u = v[i]; else if (vr[i] == 2) M->k = v[i]; else return fmi2Error;
    }
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no)
{
    ON_STEP
    if (M->phase != 2 || !(h > 0)) return fmi2Error;
    M->t = t + h;
    Y += h * (M->k + M->u - Y);
    return fmi2OK;
}
#define NO(name, ...) fmi2Status name(fmi2Component c, __VA_ARGS__) { return fmi2Error; }
typedef const fmi2ValueReference *R;
NO(fmi2GetInteger, R r, size_t n, fmi2Integer *v) NO(fmi2GetBoolean, R r, size_t n, fmi2Boolean *v)
NO(fmi2GetString, R r, size_t n, fmi2String *v) NO(fmi2SetInteger, R r, size_t n, const fmi2Integer *v)
NO(fmi2SetBoolean, R r, size_t n, const fmi2Boolean *v) NO(fmi2SetString, R r, size_t n, const fmi2String *v)
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s)
{ Model *m = malloc(sizeof *m); memcpy(m, c, sizeof *m); *s = m; return fmi2OK; }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) { memcpy(c, s, sizeof(Model)); ON_RESTORE return fmi2OK; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { free(*s); *s = NULL; return fmi2OK; }
NO(fmi2SerializedFMUstateSize, fmi2FMUstate s, size_t *n)
NO(fmi2SerializeFMUstate, fmi2FMUstate s, fmi2Byte b[], size_t n)
NO(fmi2DeSerializeFMUstate, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
NO(fmi2GetDirectionalDerivative, R r, size_t n, R q, size_t m, const fmi2Real *a, fmi2Real *b)
NO(fmi2SetRealInputDerivatives, R r, size_t n, const fmi2Integer *o, const fmi2Real *v)
NO(fmi2GetRealOutputDerivatives, R r, size_t n, const fmi2Integer *o, fmi2Real *v)
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
NO(fmi2GetStatus, const fmi2StatusKind k, fmi2Status *v) NO(fmi2GetRealStatus, const fmi2StatusKind k, fmi2Real *v)
NO(fmi2GetIntegerStatus, const fmi2StatusKind k, fmi2Integer *v)
NO(fmi2GetBooleanStatus, const fmi2StatusKind k, fmi2Boolean *v)
NO(fmi2GetStringStatus, const fmi2StatusKind k, fmi2String *v)
