/* Drives one model through the whole interface, for a run under sanitizers: every function, saved states, two instances,
   errors, trips on a tape. Compiled in one translation unit with the model, whose tables say what there is to set. */

#include "all.c"

#include <stdio.h>

#define CHECK(condition)                                                                                              \
    do {                                                                                                              \
        if (!(condition)) {                                                                                           \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition);                                                   \
            return 1;                                                                                                 \
        }                                                                                                             \
    } while (0)

enum { STEPS = 40, RIDE = 8, WAIT = 2 };
static const double STEP = 0.25;
static int messages;

static void logger(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    messages += environment != NULL && instance[0] != '\0' && status >= fmi2OK && category[0] != '\0' && message[0] != '\0';
}

static fmi2ValueReference reference_of(const char *name)
{
    for (unsigned n = 0; n < N_VARIABLES; n++) {
        if (strcmp(model_variables[n].name, name) == 0) {
            return n;
        }
    }
    return N_VARIABLES + N_STATES;
}

static int set_inputs(fmi2Component c, int k)
{
    for (unsigned n = 0; n < N_VARIABLES; n++) {
        const Variable *variable = &model_variables[n];
        if (variable->role != ROLE_INPUT) {
            continue;
        }
        double real = 0.5 * (double)((k + (int)n) % 5);
        int whole = k % 3;
        const char *text = k % 2 == 0 ? "even" : "";
        if (n == TRIP) {
            whole = k / RIDE;
        }
        if (n == TRIP_TIME) {
            real = (double)(k % RIDE - WAIT) * STEP;
        }
        switch (variable->type) {
        case TYPE_REAL: CHECK(fmi2SetReal(c, &n, 1, &real) == fmi2OK); break;
        case TYPE_INTEGER: CHECK(fmi2SetInteger(c, &n, 1, &whole) == fmi2OK); break;
        case TYPE_BOOLEAN: whole = k % 2; CHECK(fmi2SetBoolean(c, &n, 1, &whole) == fmi2OK); break;
        default: CHECK(fmi2SetString(c, &n, 1, &text) == fmi2OK);
        }
    }
    return 0;
}

/* Of every order in turn, of some inputs in some steps. */
static int set_derivatives(fmi2Component c, int k)
{
    for (unsigned n = 0; n < N_VARIABLES; n++) {
        const Variable *variable = &model_variables[n];
        int order = 1 + (k + (int)n) % MAX_ORDER;
        double real = n == TRIP_TIME ? (order == 1 ? 1.0 : 0.0) : 0.25 * (double)(k % 3);
        if (variable->role == ROLE_INPUT && variable->type == TYPE_REAL && k % 4 != 0) {
            CHECK(fmi2SetRealInputDerivatives(c, &n, 1, &order, &real) == fmi2OK);
        } else if (variable->role != ROLE_INPUT || variable->type != TYPE_REAL) {
            CHECK(fmi2SetRealInputDerivatives(c, &n, 1, &order, &real) == fmi2Error);
        }
    }
    return 0;
}

static int get_everything(fmi2Component c, double *sum)
{
    for (unsigned n = 0; n < N_VARIABLES + N_STATES; n++) {
        double real = 0.0;
        int whole = 0;
        const char *text = "";
        switch (n < N_VARIABLES ? model_variables[n].type : TYPE_REAL) {
        case TYPE_REAL: CHECK(fmi2GetReal(c, &n, 1, &real) == fmi2OK); break;
        case TYPE_INTEGER: CHECK(fmi2GetInteger(c, &n, 1, &whole) == fmi2OK); break;
        case TYPE_BOOLEAN: CHECK(fmi2GetBoolean(c, &n, 1, &whole) == fmi2OK); break;
        default: CHECK(fmi2GetString(c, &n, 1, &text) == fmi2OK);
        }
        bool own = n < N_VARIABLES && model_variables[n].role == ROLE_FIXED; /* such as the name of the tape's file */
        *sum += real + (double)whole + (own ? 0.0 : (double)strlen(text));
        double direction = 1.0, derivative = 0.0;
        unsigned known = N_STATES > 0 ? FIRST_STATE : 0;
        fmi2GetDirectionalDerivative(c, &n, 1, &known, 1, &direction, &derivative);
    }
    return 0;
}

static int start(fmi2Component c, const char *tape_file)
{
    CHECK(fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2True, STEP * STEPS) == fmi2OK);
    const char *reals[] = {"sample_time", "tape_duration", "tape_cutoff"};
    const double values[] = {STEP, STEP * RIDE, 0.5};
    for (int k = 0; k < 3; k++) {
        unsigned n = reference_of(reals[k]);
        CHECK(n >= N_VARIABLES || fmi2SetReal(c, &n, 1, &values[k]) == fmi2OK);
    }
    unsigned n = reference_of("tape_file");
    CHECK(n >= N_VARIABLES || fmi2SetString(c, &n, 1, &tape_file) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK);
    double sum = 0.0;
    CHECK(set_inputs(c, 0) == 0 && get_everything(c, &sum) == 0);
    CHECK(fmi2ExitInitializationMode(c) == fmi2OK);
    return 0;
}

static int steps(fmi2Component c, int from, int to, double *sum)
{
    for (int k = from; k < to; k++) {
        CHECK(set_inputs(c, k) == 0 && set_derivatives(c, k) == 0);
        CHECK(fmi2DoStep(c, (double)k * STEP, STEP, fmi2True) == fmi2OK);
        CHECK(get_everything(c, sum) == 0);
    }
    return 0;
}

#if MODEL_EXCHANGE
/* An explicit Euler solver that meets time events and answers each change of an indicator by an event. */
static int exchange(fmi2Component c, double *sum)
{
    double x[AT_LEAST_ONE(N_STATES)], rates_of[AT_LEAST_ONE(N_STATES)], z[AT_LEAST_ONE(N_INDICATORS)], time = 0.0;
    fmi2EventInfo info;
    fmi2Boolean event = fmi2False, end = fmi2False;
    for (int k = 0; k < STEPS; k++) {
        CHECK(k == 0 || (fmi2SetTime(c, time) == fmi2OK && fmi2EnterEventMode(c) == fmi2OK));
        CHECK(set_inputs(c, k) == 0 && fmi2NewDiscreteStates(c, &info) == fmi2OK && get_everything(c, sum) == 0);
        CHECK(fmi2EnterContinuousTimeMode(c) == fmi2OK && fmi2DoStep(c, time, STEP, fmi2True) == fmi2Error);
        double h = info.nextEventTimeDefined && info.nextEventTime < time + STEP ? info.nextEventTime - time : STEP;
        CHECK(fmi2GetContinuousStates(c, x, N_STATES) == fmi2OK && fmi2GetDerivatives(c, rates_of, N_STATES) == fmi2OK);
        for (int n = 0; n < N_STATES; n++) {
            x[n] += h * rates_of[n];
        }
        time += h;
        CHECK(fmi2SetTime(c, time) == fmi2OK && fmi2SetContinuousStates(c, x, N_STATES) == fmi2OK);
        CHECK(fmi2GetEventIndicators(c, z, N_INDICATORS) == fmi2OK && get_everything(c, sum) == 0);
        CHECK(fmi2CompletedIntegratorStep(c, fmi2True, &event, &end) == fmi2OK && !event && !end);
        CHECK(fmi2GetNominalsOfContinuousStates(c, x, N_STATES) == fmi2OK && fmi2SetTime(c, NAN) == fmi2Error);
    }
    fmi2FMUstate state = NULL;
    CHECK(fmi2GetFMUstate(c, &state) == fmi2OK && fmi2SetFMUstate(c, state) == fmi2OK);
    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK);
    return 0;
}
#endif

static int abuse(fmi2Component c)
{
    unsigned far[] = {N_VARIABLES + N_STATES, 0x7FFFFFFFu, 0xFFFFFFFFu};
    double real = NAN;
    int whole = 0;
    const char *text = NULL;
    for (int k = 0; k < 3; k++) {
        CHECK(fmi2GetReal(c, far + k, 1, &real) == fmi2Error && fmi2SetReal(c, far + k, 1, &real) == fmi2Error);
        CHECK(fmi2GetInteger(c, far + k, 1, &whole) == fmi2Error && fmi2SetInteger(c, far + k, 1, &whole) == fmi2Error);
        CHECK(fmi2GetBoolean(c, far + k, 1, &whole) == fmi2Error && fmi2SetBoolean(c, far + k, 1, &whole) == fmi2Error);
        CHECK(fmi2GetString(c, far + k, 1, &text) == fmi2Error && fmi2SetString(c, far + k, 1, &text) == fmi2Error);
        CHECK(fmi2GetDirectionalDerivative(c, far + k, 1, NULL, 0, NULL, &real) == fmi2Error);
        whole = 1;
        CHECK(fmi2SetRealInputDerivatives(c, far + k, 1, &whole, &real) == fmi2Error);
    }
    CHECK(fmi2GetReal(c, NULL, 1, NULL) == fmi2Error && fmi2GetReal(c, NULL, 0, NULL) == fmi2OK);
    CHECK(fmi2DoStep(c, 0.0, -1.0, fmi2True) == fmi2Error && fmi2DoStep(c, 77.0, STEP, fmi2True) == fmi2Error);
    CHECK(fmi2DoStep(c, NAN, NAN, fmi2True) == fmi2Error && fmi2EnterInitializationMode(c) == fmi2Error);
    CHECK(fmi2CancelStep(c) == fmi2Error && fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &real) == fmi2OK);
    fmi2Status status;
    fmi2String category = "logEvents";
    CHECK(fmi2GetStatus(c, fmi2DoStepStatus, &status) == fmi2Discard);
    CHECK(fmi2GetIntegerStatus(c, fmi2DoStepStatus, &whole) == fmi2Discard);
    CHECK(fmi2GetBooleanStatus(c, fmi2Terminated, &whole) == fmi2OK);
    CHECK(fmi2GetStringStatus(c, fmi2PendingStatus, &text) == fmi2Discard);
    CHECK(fmi2SetRealInputDerivatives(c, NULL, 0, NULL, NULL) == fmi2OK);
    CHECK(fmi2SetRealInputDerivatives(c, far, 1, NULL, &real) == fmi2Error);
    CHECK(fmi2GetRealOutputDerivatives(c, NULL, 0, NULL, NULL) == fmi2OK);
    CHECK(fmi2SetDebugLogging(c, fmi2True, 1, &category) == fmi2OK);
    return 0;
}

int main(int count, char **arguments)
{
    int environment = 0;
    const fmi2CallbackFunctions functions = {logger, calloc, free, NULL, &environment};
    double expected = 0.0, again = 0.0, other = 0.0;
    CHECK(count == 2 && fmi2GetVersion()[0] == '2' && fmi2GetTypesPlatform()[0] == 'd');
    fmi2Component e = fmi2Instantiate("x", fmi2ModelExchange, MODEL_GUID, "", &functions, fmi2False, fmi2True);
#if MODEL_EXCHANGE
    CHECK(e != NULL && start(e, "") == 0 && exchange(e, &again) == 0 && fmi2Reset(e) == fmi2OK);
    CHECK(start(e, "") == 0 && exchange(e, &expected) == 0 && again == expected);
    fmi2FreeInstance(e);
    expected = again = 0.0;
#else
    CHECK(e == NULL);
#endif
    fmi2Component c = fmi2Instantiate("%s#1#", fmi2CoSimulation, MODEL_GUID, "", &functions, fmi2False, fmi2True);
    fmi2Component d = fmi2Instantiate("d", fmi2CoSimulation, MODEL_GUID, NULL, NULL, fmi2False, fmi2False);
    CHECK(c != NULL && d != NULL && start(c, "") == 0 && start(d, arguments[1]) == 0);

    fmi2FMUstate state = NULL, copy = NULL;
    CHECK(steps(c, 0, 13, &again) == 0 && steps(d, 0, 13, &other) == 0 && again == other && abuse(c) == 0);
    CHECK(fmi2GetFMUstate(c, &state) == fmi2OK && steps(c, 13, STEPS, &expected) == 0);
    size_t size = 0;
    CHECK(fmi2SerializedFMUstateSize(c, state, &size) == fmi2OK);
    char *bytes = malloc(size);
    CHECK(bytes != NULL && fmi2SerializeFMUstate(c, state, bytes, size) == fmi2OK);
    CHECK(fmi2DeSerializeFMUstate(d, bytes, size - 1, &copy) == fmi2Error);
    CHECK(fmi2DeSerializeFMUstate(d, bytes, size, &copy) == fmi2OK && fmi2SetFMUstate(c, copy) == fmi2OK);
    again = 0.0;
    CHECK(steps(c, 13, STEPS, &again) == 0 && again == expected);
    CHECK(fmi2GetFMUstate(c, &copy) == fmi2OK && fmi2DoStep(c, STEP * STEPS, STEP, fmi2True) == fmi2Error);

    other = 0.0;
    CHECK(steps(d, 13, STEPS, &other) == 0);
    CHECK(other == expected);
    CHECK(fmi2Terminate(d) == fmi2OK); /* writes the tape */
    CHECK(get_everything(d, &other) == 0 && fmi2Reset(d) == fmi2OK && start(d, arguments[1]) == 0); /* and reads it */
    CHECK(steps(d, 0, STEPS, &other) == 0 && fmi2Terminate(d) == fmi2OK);

    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK && fmi2FreeFMUstate(c, &copy) == fmi2OK && messages > 20);
    free(bytes);
    fmi2FreeInstance(c);
    fmi2FreeInstance(d);
    puts("clean");
    return 0;
}
