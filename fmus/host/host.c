/* A bare host for one FMU that is linked in: no importer, no XML, no heap of its own.

       host [STEP] < inputs.csv > outputs.csv

   It reads a line of names, then a row for each communication point, the time first and the inputs after it, and writes the
   outputs in the same form. What goes in and out stands in signals.h, by value reference. */

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2Functions.h"
#include "signals.h"

static double given[N_INPUTS + 1]; /* the time, and the inputs that hold from it on */

static void say(fmi2ComponentEnvironment e, fmi2String who, fmi2Status status, fmi2String kind, fmi2String text, ...)
{
    (void)e, (void)kind;
    fprintf(stderr, "%s (%d): %s\n", who, (int)status, text);
}

static bool read_row(void)
{
    bool whole = scanf("%lf", &given[0]) == 1;
    for (int k = 1; k <= N_INPUTS && whole; k++) {
        whole = scanf(",%lf", &given[k]) == 1;
    }
    return whole;
}

static bool set_inputs(fmi2Component fmu)
{
    fmi2Status status = fmi2OK;
    for (int k = 0; k < N_INPUTS && status == fmi2OK; k++) {
        fmi2Integer whole = (fmi2Integer)given[k + 1];
        status = inputs[k].type == 'r'   ? fmi2SetReal(fmu, &inputs[k].reference, 1, &given[k + 1])
                 : inputs[k].type == 'i' ? fmi2SetInteger(fmu, &inputs[k].reference, 1, &whole)
                                         : fmi2SetBoolean(fmu, &inputs[k].reference, 1, &whole);
    }
    return status == fmi2OK;
}

static bool write_row(fmi2Component fmu, double time)
{
    fmi2Status status = fmi2OK;
    printf("%.17g", time);
    for (int k = 0; k < N_OUTPUTS && status == fmi2OK; k++) {
        fmi2Real value = 0.0;
        fmi2Integer whole = 0;
        status = outputs[k].type == 'r'   ? fmi2GetReal(fmu, &outputs[k].reference, 1, &value)
                 : outputs[k].type == 'i' ? fmi2GetInteger(fmu, &outputs[k].reference, 1, &whole)
                                          : fmi2GetBoolean(fmu, &outputs[k].reference, 1, &whole);
        printf(",%.17g", outputs[k].type == 'r' ? value : (double)whole);
    }
    puts("");
    return status == fmi2OK;
}

int main(int argc, char **argv)
{
    static const fmi2CallbackFunctions functions = {say, NULL, NULL, NULL, NULL};
    double step = argc > 1 ? atof(argv[1]) : STEP;
    fmi2Component fmu = fmi2Instantiate("fmu", fmi2CoSimulation, GUID, "", &functions, fmi2False, fmi2False);
    bool good = fmu != NULL && fmi2SetupExperiment(fmu, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK &&
                fmi2EnterInitializationMode(fmu) == fmi2OK && scanf("%*[^\n]") == 0 && read_row() && set_inputs(fmu) &&
                fmi2ExitInitializationMode(fmu) == fmi2OK;
    puts(OUTPUT_NAMES);
    good = good && write_row(fmu, 0.0);
    for (int k = 0; good && read_row(); k++) {
        good = fmi2DoStep(fmu, k * step, step, fmi2True) == fmi2OK && write_row(fmu, (k + 1) * step) && set_inputs(fmu);
    }
    fmi2FreeInstance(fmu);
    return good && feof(stdin) ? 0 : 1;
}
