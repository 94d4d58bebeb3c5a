/* The smallest importer: loads an FMU's library, runs it, prints what comes out. It links nothing of ours.

   importer LIBRARY GUID STEP COUNT < script

   The script holds numbers. First, for the inputs and then for the outputs, and in each for reals, integers and
   booleans: how many, and their value references. Then COUNT rows of input values in that order, one for each step (the
   first also for the initialization). Printed are COUNT + 1 rows of outputs, with digits enough to get every bit back. */

#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#endif

enum { MOST = 512 };

typedef struct {
    size_t count;
    fmi2ValueReference references[MOST];
} Variables;

static void die(const char *what)
{
    fprintf(stderr, "importer: %s\n", what);
    exit(1);
}

static void check(fmi2Status status, const char *what)
{
    if (status != fmi2OK) {
        die(what);
    }
}

static void logger(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    (void)environment;
    fprintf(stderr, "%s: status %d, %s: %s\n", instance, (int)status, category, message);
}

static double read_number(void)
{
    double number = 0.0;
    if (scanf("%lf", &number) != 1) {
        die("the script is too short");
    }
    return number;
}

static Variables read_variables(void)
{
    Variables variables = {0};
    double count = read_number();
    if (count < 0.0 || count > (double)MOST) {
        die("too many variables");
    }
    variables.count = (size_t)count;
    for (size_t k = 0; k < variables.count; k++) {
        variables.references[k] = (fmi2ValueReference)read_number();
    }
    return variables;
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        die("importer LIBRARY GUID STEP COUNT");
    }
    void *library = OPEN(argv[1]);
    if (library == NULL) {
        die("the library cannot be loaded");
    }
#define FUNCTION(name) \
    name##TYPE *name = (name##TYPE *)FIND(library, #name); \
    if (name == NULL) { \
        die("the library has no " #name); \
    }
    FUNCTION(fmi2Instantiate)
    FUNCTION(fmi2SetupExperiment)
    FUNCTION(fmi2EnterInitializationMode)
    FUNCTION(fmi2ExitInitializationMode)
    FUNCTION(fmi2SetReal)
    FUNCTION(fmi2SetInteger)
    FUNCTION(fmi2SetBoolean)
    FUNCTION(fmi2GetReal)
    FUNCTION(fmi2GetInteger)
    FUNCTION(fmi2GetBoolean)
    FUNCTION(fmi2DoStep)
    FUNCTION(fmi2Terminate)
    FUNCTION(fmi2FreeInstance)

    double step = atof(argv[3]);
    int count = atoi(argv[4]);
    Variables inputs[3], outputs[3];
    for (int type = 0; type < 3; type++) {
        inputs[type] = read_variables();
    }
    for (int type = 0; type < 3; type++) {
        outputs[type] = read_variables();
    }
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    fmi2Component it = fmi2Instantiate("it", fmi2CoSimulation, argv[2], "", &callbacks, fmi2False, fmi2False);
    if (it == NULL) {
        die("fmi2Instantiate");
    }
    check(fmi2SetupExperiment(it, fmi2False, 0.0, 0.0, fmi2False, 0.0), "fmi2SetupExperiment");
    check(fmi2EnterInitializationMode(it), "fmi2EnterInitializationMode");
    for (int k = -1; k < count; k++) { /* set, step, get: in initialization mode without the step */
        fmi2Real real[MOST];
        fmi2Integer whole[2][MOST];
        if (k != 0) {
            for (size_t n = 0; n < inputs[0].count; n++) {
                real[n] = read_number();
            }
            for (int type = 0; type < 2; type++) {
                for (size_t n = 0; n < inputs[1 + type].count; n++) {
                    whole[type][n] = (fmi2Integer)read_number();
                }
            }
            check(fmi2SetReal(it, inputs[0].references, inputs[0].count, real), "fmi2SetReal");
            check(fmi2SetInteger(it, inputs[1].references, inputs[1].count, whole[0]), "fmi2SetInteger");
            check(fmi2SetBoolean(it, inputs[2].references, inputs[2].count, whole[1]), "fmi2SetBoolean");
        }
        if (k >= 0) {
            check(fmi2DoStep(it, k * step, step, fmi2True), "fmi2DoStep");
        }
        check(fmi2GetReal(it, outputs[0].references, outputs[0].count, real), "fmi2GetReal");
        check(fmi2GetInteger(it, outputs[1].references, outputs[1].count, whole[0]), "fmi2GetInteger");
        check(fmi2GetBoolean(it, outputs[2].references, outputs[2].count, whole[1]), "fmi2GetBoolean");
        if (k < 0) {
            check(fmi2ExitInitializationMode(it), "fmi2ExitInitializationMode");
        }
        for (size_t n = 0; n < outputs[0].count; n++) {
            printf("%.17g ", real[n]);
        }
        for (int type = 0; type < 2; type++) {
            for (size_t n = 0; n < outputs[1 + type].count; n++) {
                printf("%d ", whole[type][n]);
            }
        }
        printf("\n");
    }
    check(fmi2Terminate(it), "fmi2Terminate");
    fmi2FreeInstance(it);
    return 0;
}
