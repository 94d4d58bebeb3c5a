/* Drives one model through model exchange in FMI 3.0, for a run under sanitizers: an explicit Euler solver that meets time
   events, everything read at each step, saved states, wrong calls. Compiled in one translation unit with the model. */

#include "all.c"

#include <stdio.h>

#define CHECK(condition)                                                                                              \
    do {                                                                                                              \
        if (!(condition)) {                                                                                           \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition);                                                   \
            return 1;                                                                                                 \
        }                                                                                                             \
    } while (0)

enum { STEPS = 40, ROOM = 64 };
static const double STEP = 0.25;
static int messages;

static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    messages += environment != NULL && status >= fmi3OK && category[0] != '\0' && message[0] != '\0';
}

static int set_inputs(fmi3Instance c, int k)
{
    for (unsigned n = 0; n < N_VARIABLES; n++) {
        const Variable *variable = &model_variables[n];
        if (variable->role != ROLE_INPUT || variable->size == 0 || n == TRIP || n == TRIP_TIME) {
            continue;
        }
        size_t count = (size_t)variable->size;
        double reals[ROOM];
        int32_t wholes[ROOM];
        bool truths[ROOM];
        const char *texts[ROOM];
        CHECK(count <= ROOM);
        for (size_t m = 0; m < count; m++) {
            reals[m] = 0.5 * (double)((k + (int)(n + m)) % 5);
            wholes[m] = k % 3;
            truths[m] = k % 2 == 0;
            texts[m] = k % 2 == 0 ? "even" : "";
        }
        switch (variable->type) {
        case TYPE_REAL: CHECK(fmi3SetFloat64(c, &n, 1, reals, count) == fmi3OK); break;
        case TYPE_INTEGER: CHECK(fmi3SetInt32(c, &n, 1, wholes, count) == fmi3OK); break;
        case TYPE_BOOLEAN: CHECK(fmi3SetBoolean(c, &n, 1, truths, count) == fmi3OK); break;
        default: CHECK(fmi3SetString(c, &n, 1, texts, count) == fmi3OK);
        }
    }
    return 0;
}

/* Rates, the time and the event indicators among it. */
static int get_everything(fmi3Instance c, double *sum)
{
    for (unsigned n = 0; n < N_VARIABLES + N_STATES + 1 + (N_INDICATORS > 0); n++) {
        unsigned state = FIRST_STATE + (n - N_VARIABLES);
        size_t count = 1;
        if (n < N_VARIABLES + N_STATES) {
            count = (size_t)model_variables[n < N_VARIABLES ? n : state].size;
        } else if (n > N_VARIABLES + N_STATES) {
            count = N_INDICATORS;
        }
        double reals[ROOM];
        int32_t wholes[ROOM];
        bool truths[ROOM];
        const char *texts[ROOM];
        CHECK(count <= ROOM);
        for (size_t m = 0; count > 0 && m < 1; m++) {
            switch (n < N_VARIABLES ? model_variables[n].type : TYPE_REAL) {
            case TYPE_REAL: CHECK(fmi3GetFloat64(c, &n, 1, reals, count) == fmi3OK); *sum += reals[count - 1]; break;
            case TYPE_INTEGER: CHECK(fmi3GetInt32(c, &n, 1, wholes, count) == fmi3OK); *sum += wholes[count - 1]; break;
            case TYPE_BOOLEAN: CHECK(fmi3GetBoolean(c, &n, 1, truths, count) == fmi3OK); *sum += truths[count - 1]; break;
            default: CHECK(fmi3GetString(c, &n, 1, texts, count) == fmi3OK && texts[count - 1] != NULL);
            }
        }
        CHECK(count == 0 || fmi3GetFloat64(c, &n, 1, reals, count + 1) == fmi3Error);
    }
    return 0;
}

static int start(fmi3Instance c)
{
    double sum = 0.0;
    CHECK(fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0) == fmi3OK);
    CHECK(set_inputs(c, 0) == 0 && get_everything(c, &sum) == 0);
    CHECK(fmi3ExitInitializationMode(c) == fmi3OK);
    return 0;
}

static int exchange(fmi3Instance c, double *sum)
{
    double x[AT_LEAST_ONE(N_STATES)], rates_of[AT_LEAST_ONE(N_STATES)], z[AT_LEAST_ONE(N_INDICATORS)], time = 0.0, next = 0.0;
    bool needed, end, nominals, changed, timed, event;
    size_t n_states = 77, n_indicators = 77;
    CHECK(fmi3GetNumberOfContinuousStates(c, &n_states) == fmi3OK && n_states == N_STATES);
    CHECK(fmi3GetNumberOfEventIndicators(c, &n_indicators) == fmi3OK && n_indicators == N_INDICATORS);
    for (int k = 0; k < STEPS; k++) {
        CHECK(k == 0 || (fmi3SetTime(c, time) == fmi3OK && fmi3EnterEventMode(c) == fmi3OK));
        CHECK(set_inputs(c, k) == 0);
        CHECK(fmi3UpdateDiscreteStates(c, &needed, &end, &nominals, &changed, &timed, &next) == fmi3OK);
        CHECK(!needed && !end && !nominals && get_everything(c, sum) == 0);
        CHECK(fmi3UpdateDiscreteStates(c, &needed, &end, &nominals, NULL, &timed, &next) == fmi3Error);
        CHECK(fmi3EnterContinuousTimeMode(c) == fmi3OK);
        CHECK(fmi3DoStep(c, time, STEP, true, &needed, &end, &event, &next) == fmi3Error);
        double h = timed && next > time && next < time + STEP ? next - time : STEP;
        CHECK(fmi3GetContinuousStates(c, x, N_STATES) == fmi3OK);
        CHECK(fmi3GetContinuousStateDerivatives(c, rates_of, N_STATES) == fmi3OK);
        for (int n = 0; n < N_STATES; n++) {
            x[n] += h * rates_of[n];
        }
        time += h;
        CHECK(fmi3SetTime(c, time) == fmi3OK && fmi3SetContinuousStates(c, x, N_STATES) == fmi3OK);
        CHECK(fmi3GetEventIndicators(c, z, N_INDICATORS) == fmi3OK && get_everything(c, sum) == 0);
        CHECK(fmi3CompletedIntegratorStep(c, true, &event, &end) == fmi3OK && !event && !end);
        CHECK(fmi3GetNominalsOfContinuousStates(c, x, N_STATES) == fmi3OK && fmi3SetTime(c, NAN) == fmi3Error);
        CHECK(fmi3SetContinuousStates(c, NULL, N_STATES + 1) == fmi3Error && fmi3EvaluateDiscreteStates(c) == fmi3Error);
    }
    fmi3FMUState state = NULL;
    CHECK(fmi3GetFMUState(c, &state) == fmi3OK && fmi3SetFMUState(c, state) == fmi3OK);
    CHECK(fmi3FreeFMUState(c, &state) == fmi3OK);
    return 0;
}

int main(void)
{
    int environment = 0;
    double expected = 0.0, again = 0.0, reached = 0.0;
    bool needed, end, early;
    fmi3Instance e = fmi3InstantiateModelExchange("x", MODEL_GUID, "", false, true, &environment, logger);
    CHECK(e != NULL && start(e) == 0 && exchange(e, &expected) == 0 && fmi3Reset(e) == fmi3OK);
    CHECK(start(e) == 0 && exchange(e, &again) == 0 && again == expected && fmi3Terminate(e) == fmi3OK);
    fmi3FreeInstance(e);
    CHECK(fmi3InstantiateModelExchange("x", "", "", false, true, &environment, logger) == NULL);
    fmi3Instance c = fmi3InstantiateCoSimulation("c", MODEL_GUID, "", false, false, false, false, NULL, 0, &environment,
                                                 logger, NULL);
    CHECK(c != NULL && start(c) == 0 && fmi3EnterEventMode(c) == fmi3Error && fmi3SetTime(c, 0.5) == fmi3Error);
    for (int k = 0; k < STEPS; k++) {
        CHECK(set_inputs(c, k) == 0 && get_everything(c, &again) == 0);
        CHECK(fmi3DoStep(c, (double)k * STEP, STEP, true, &needed, &end, &early, &reached) == fmi3OK);
    }
    CHECK(fmi3Terminate(c) == fmi3OK && messages > 20);
    fmi3FreeInstance(c);
    puts("clean");
    return 0;
}
