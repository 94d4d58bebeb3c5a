/* Bare calls of one FMU's library: set, doStep, get. Prints CPU microseconds per step, and the last speed.
   bare_calls LIBRARY GUID STEPS FORCE POSITION SPEED ACCELERATION (value references) */

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"

#define LOAD(type, name) type *name = (type *)dlsym(library, "fmi2" #name)

int main(int argc, char **argv)
{
    void *library = argc > 7 ? dlopen(argv[1], RTLD_NOW) : NULL;
    if (library == NULL) {
        fprintf(stderr, "%s\n", argc > 7 ? dlerror() : "too few arguments");
        return 1;
    }
    LOAD(fmi2InstantiateTYPE, Instantiate);
    LOAD(fmi2SetupExperimentTYPE, SetupExperiment);
    LOAD(fmi2EnterInitializationModeTYPE, EnterInitializationMode);
    LOAD(fmi2ExitInitializationModeTYPE, ExitInitializationMode);
    LOAD(fmi2SetRealTYPE, SetReal);
    LOAD(fmi2GetRealTYPE, GetReal);
    LOAD(fmi2DoStepTYPE, DoStep);
    fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};
    fmi2Component c = Instantiate("train", fmi2CoSimulation, argv[2], "", &callbacks, fmi2False, fmi2False);
    const long steps = atol(argv[3]);
    const fmi2ValueReference force = (fmi2ValueReference)atoi(argv[4]);
    const fmi2ValueReference shown[3] = {(fmi2ValueReference)atoi(argv[5]), (fmi2ValueReference)atoi(argv[6]),
                                         (fmi2ValueReference)atoi(argv[7])};
    double values[3] = {0.0, 0.0, 0.0};
    if (c == NULL) {
        return 1;
    }
    SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    EnterInitializationMode(c);
    ExitInitializationMode(c);
    clock_t begin = clock();
    for (long k = 0; k < steps; k++) {
        const double value = 2e5 + (double)(k % 7);
        if (SetReal(c, &force, 1, &value) || DoStep(c, (double)k * 0.1, 0.1, fmi2True) || GetReal(c, shown, 3, values)) {
            return 1;
        }
    }
    printf("%.9f %.9f\n", 1e6 * (double)(clock() - begin) / CLOCKS_PER_SEC / (double)steps, values[1]);
    return 0;
}
