/* A program that links the sources of two FMUs, told apart by the prefix of their functions, and runs both: the train's
   speed is the measurement of the estimator. Prints the speed and the estimate, in hexadecimal, after each step. */

#include <stdio.h>

#include "fmi2FunctionTypes.h"

#define DECLARE(prefix)                                                                                               \
    fmi2InstantiateTYPE prefix##_fmi2Instantiate;                                                                     \
    fmi2SetupExperimentTYPE prefix##_fmi2SetupExperiment;                                                             \
    fmi2EnterInitializationModeTYPE prefix##_fmi2EnterInitializationMode;                                             \
    fmi2ExitInitializationModeTYPE prefix##_fmi2ExitInitializationMode;                                               \
    fmi2SetRealTYPE prefix##_fmi2SetReal;                                                                             \
    fmi2GetRealTYPE prefix##_fmi2GetReal;                                                                             \
    fmi2DoStepTYPE prefix##_fmi2DoStep;                                                                               \
    fmi2FreeInstanceTYPE prefix##_fmi2FreeInstance;

#define CHECK(call)                                                                                                   \
    if ((call) != fmi2OK) {                                                                                           \
        return 1;                                                                                                     \
    }

DECLARE(PointMassTrain)
DECLARE(Estimator)

int main(void)
{
    const unsigned force = FORCE, speed = SPEED, measured = MEASURED, estimate = ESTIMATE;
    fmi2Component train = PointMassTrain_fmi2Instantiate("train", fmi2CoSimulation, TRAIN_GUID, "", NULL, 0, 0);
    fmi2Component observer = Estimator_fmi2Instantiate("observer", fmi2CoSimulation, OBSERVER_GUID, "", NULL, 0, 0);
    if (train == NULL || observer == NULL || Estimator_fmi2Instantiate("x", fmi2CoSimulation, TRAIN_GUID, "", NULL, 0, 0)) {
        return 1;
    }
    CHECK(PointMassTrain_fmi2SetupExperiment(train, 0, 0.0, 0.0, 0, 0.0));
    CHECK(PointMassTrain_fmi2EnterInitializationMode(train));
    CHECK(PointMassTrain_fmi2ExitInitializationMode(train));
    CHECK(Estimator_fmi2SetupExperiment(observer, 0, 0.0, 0.0, 0, 0.0));
    CHECK(Estimator_fmi2EnterInitializationMode(observer));
    CHECK(Estimator_fmi2ExitInitializationMode(observer));
    for (int k = 0; k < 50; k++) {
        double newtons = 1e5 * (double)(k % 7), v = 0.0, e = 0.0;
        CHECK(PointMassTrain_fmi2SetReal(train, &force, 1, &newtons));
        CHECK(PointMassTrain_fmi2DoStep(train, 0.1 * k, 0.1, 1));
        CHECK(PointMassTrain_fmi2GetReal(train, &speed, 1, &v));
        CHECK(Estimator_fmi2SetReal(observer, &measured, 1, &v));
        CHECK(Estimator_fmi2DoStep(observer, 0.1 * k, 0.1, 1));
        CHECK(Estimator_fmi2GetReal(observer, &estimate, 1, &e));
        printf("%a %a\n", v, e);
    }
    PointMassTrain_fmi2FreeInstance(train);
    Estimator_fmi2FreeInstance(observer);
    return 0;
}
