/* The FMI 2.0 functions: who may call what and when, and the way between value references and values. */

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { ANY_PHASE = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_RUNNING | PHASE_TERMINATED | PHASE_ERROR };
enum { READABLE = PHASE_INITIALIZATION | PHASE_RUNNING | PHASE_TERMINATED | PHASE_ERROR };

static const char *phase_name(Phase phase)
{
    switch (phase) {
    case PHASE_INSTANTIATED: return "instantiated";
    case PHASE_INITIALIZATION: return "in initialization mode";
    case PHASE_RUNNING: return "running";
    case PHASE_TERMINATED: return "terminated";
    default: return "in error; it can be reset, restored to a saved state, or freed";
    }
}

/* NULL unless the call is allowed now. */
static Instance *enter(fmi2Component c, unsigned phases, const char *call)
{
    Instance *s = c;
    if (s == NULL) {
        return NULL;
    }
    if (!((unsigned)s->phase & phases)) {
        fail(s, "%s is not allowed while the instance is %s", call, phase_name(s->phase));
        return NULL;
    }
    return s;
}

/* A failure after which the instance can only be reset, restored or freed. */
static fmi2Status broken(Instance *s)
{
    s->phase = PHASE_ERROR;
    return fmi2Error;
}

/* ------------------------------------------------------------------------------------------------------ life cycle */

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

static void refuse_instance(const fmi2CallbackFunctions *functions, fmi2String name, const char *why)
{
    if (functions != NULL && functions->logger != NULL) {
        functions->logger(functions->componentEnvironment, name, fmi2Error, log_categories[LOG_ERROR], why);
    }
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation;
    (void)visible;
    if (instanceName == NULL || instanceName[0] == '\0') {
        refuse_instance(functions, "?", MODEL_NAME ": an instance needs a name");
        return NULL;
    }
    if (fmuType != fmi2CoSimulation) {
        refuse_instance(functions, instanceName, MODEL_NAME ": this is a co-simulation FMU");
        return NULL;
    }
    if (fmuGUID == NULL || strcmp(fmuGUID, MODEL_GUID) != 0) {
        refuse_instance(functions, instanceName,
                        MODEL_NAME ": the GUID is not " MODEL_GUID ": model description and binary differ");
        return NULL;
    }
    Instance *s = calloc(1, sizeof *s);
    if (s == NULL) {
        refuse_instance(functions, instanceName, MODEL_NAME ": out of memory");
        return NULL;
    }
    strncpy(s->name, instanceName, sizeof s->name - 1);
    if (functions != NULL) {
        s->logger = functions->logger;
        s->environment = functions->componentEnvironment;
    }
    s->debug = loggingOn != fmi2False;
    restart(s);
    tell_event(s, "instantiated");
    return s;
}

void fmi2FreeInstance(fmi2Component c)
{
    Instance *s = c;
    if (s == NULL) {
        return;
    }
    free(s->tape.committed);
    free(s);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[])
{
    Instance *s = enter(c, ANY_PHASE, "fmi2SetDebugLogging");
    if (s == NULL) {
        return fmi2Error;
    }
    if (nCategories > 0 && categories == NULL) {
        return fail(s, "fmi2SetDebugLogging: NULL for an array of %lu", (unsigned long)nCategories);
    }
    bool events = nCategories == 0;
    for (size_t k = 0; k < nCategories; k++) {
        bool known = false;
        for (int n = 0; n < N_LOG_CATEGORIES && categories[k] != NULL; n++) {
            known = known || strcmp(categories[k], log_categories[n]) == 0;
        }
        if (!known) {
            return fail(s, "there is no log category %.100s", categories[k] == NULL ? "NULL" : categories[k]);
        }
        events = events || strcmp(categories[k], log_categories[LOG_EVENTS]) == 0;
    }
    s->debug = loggingOn != fmi2False && events;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    Instance *s = enter(c, PHASE_INSTANTIATED, "fmi2SetupExperiment");
    (void)toleranceDefined;
    (void)tolerance;
    if (s == NULL) {
        return fmi2Error;
    }
    if (!isfinite(startTime) || (stopTimeDefined && !(stopTime >= startTime))) {
        return fail(s, "fmi2SetupExperiment: there is no experiment from %g s to %g s", startTime, stopTime);
    }
    s->time = s->start_time = s->last_successful_time = startTime;
    s->has_stop_time = stopTimeDefined != fmi2False;
    s->stop_time = stopTime;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Instance *s = enter(c, PHASE_INSTANTIATED, "fmi2EnterInitializationMode");
    if (s == NULL) {
        return fmi2Error;
    }
    s->phase = PHASE_INITIALIZATION;
    s->fresh = s->prepared = false;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    Instance *s = enter(c, PHASE_INITIALIZATION, "fmi2ExitInitializationMode");
    if (s == NULL) {
        return fmi2Error;
    }
    for (int n = 0; n < N_VARIABLES; n++) {
        Role role = model_variables[n].role;
        if ((role == ROLE_FIXED || role == ROLE_TUNABLE) &&
            check_bounds(s, &model_variables[n], s->values[n]) != fmi2OK) {
            return broken(s);
        }
    }
    if (prepare(s) != fmi2OK) {
        return broken(s);
    }
    s->phase = PHASE_RUNNING;
    s->fresh = false;
    tell_event(s, "initialized");
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    Instance *s = enter(c, PHASE_RUNNING, "fmi2Terminate");
    if (s == NULL) {
        return fmi2Error;
    }
    s->phase = PHASE_TERMINATED;
#if N_TAPE > 0
    const char *path = s->texts[model_variables[TAPE_FILE].text];
    if (path[0] != '\0') {
        tape_commit(s);
        if (tape_save(s, path) != fmi2OK) {
            return broken(s);
        }
    }
#endif
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2Reset");
    if (s == NULL) {
        return fmi2Error;
    }
    restart(s);
    return fmi2OK;
}

/* ----------------------------------------------------------------------------------------------------------- values */

/* The variable behind a value reference, or NULL with a message. A rate der(x) has no entry of its own. */
static const Variable *find(Instance *s, fmi2ValueReference reference, Type type, const char *call)
{
    if (reference >= N_VARIABLES) {
        fail(s, "%s: there is no variable with value reference %u", call, reference);
        return NULL;
    }
    if (model_variables[reference].type != type) {
        fail(s, "%s: %s is of another type", call, model_variables[reference].name);
        return NULL;
    }
    return &model_variables[reference];
}

static bool is_rate(fmi2ValueReference reference, Type type)
{
    return type == TYPE_REAL && reference >= N_VARIABLES && reference < N_VARIABLES + N_STATES;
}

/* The rates of the states into the scratch space, from which rates are read. */
static fmi2Status rates(Instance *s)
{
#if N_STATES > 0
    call_equations(s, MODEL_DERIVATIVES, s->slopes[0]);
#endif
    for (int n = 0; n < N_STATES; n++) {
        if (!isfinite(s->slopes[0][n])) {
            return fail(s, "derivatives: 'der(%s)' is %g at t = %.17g s", model_variables[FIRST_STATE + n].name,
                        s->slopes[0][n], s->time);
        }
    }
    return fmi2OK;
}

static fmi2Status begin_get(Instance *s, const fmi2ValueReference vr[], size_t nvr, const void *value, const char *call)
{
    if (s == NULL) {
        return fmi2Error;
    }
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        return fail(s, "%s: NULL for an array of %lu", call, (unsigned long)nvr);
    }
    return nvr > 0 ? refresh(s) : fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    Instance *s = enter(c, READABLE, "fmi2GetReal");
    bool rated = false;
    if (begin_get(s, vr, nvr, value, "fmi2GetReal") != fmi2OK) {
        return fmi2Error;
    }
    for (size_t k = 0; k < nvr; k++) {
        if (is_rate(vr[k], TYPE_REAL)) {
            if (!rated && rates(s) != fmi2OK) {
                return fmi2Error;
            }
            rated = true;
            value[k] = s->slopes[0][vr[k] - N_VARIABLES];
        } else if (find(s, vr[k], TYPE_REAL, "fmi2GetReal") == NULL) {
            return fmi2Error;
        } else {
            value[k] = s->values[vr[k]];
        }
    }
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[])
{
    Instance *s = enter(c, READABLE, "fmi2GetInteger");
    if (begin_get(s, vr, nvr, value, "fmi2GetInteger") != fmi2OK) {
        return fmi2Error;
    }
    for (size_t k = 0; k < nvr; k++) {
        if (find(s, vr[k], TYPE_INTEGER, "fmi2GetInteger") == NULL) {
            return fmi2Error;
        }
        value[k] = (fmi2Integer)s->values[vr[k]];
    }
    return fmi2OK;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    Instance *s = enter(c, READABLE, "fmi2GetBoolean");
    if (begin_get(s, vr, nvr, value, "fmi2GetBoolean") != fmi2OK) {
        return fmi2Error;
    }
    for (size_t k = 0; k < nvr; k++) {
        if (find(s, vr[k], TYPE_BOOLEAN, "fmi2GetBoolean") == NULL) {
            return fmi2Error;
        }
        value[k] = s->values[vr[k]] != 0.0 ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    Instance *s = enter(c, READABLE, "fmi2GetString");
    if (begin_get(s, vr, nvr, value, "fmi2GetString") != fmi2OK) {
        return fmi2Error;
    }
    for (size_t k = 0; k < nvr; k++) {
        const Variable *variable = find(s, vr[k], TYPE_STRING, "fmi2GetString");
        if (variable == NULL) {
            return fmi2Error;
        }
        value[k] = s->texts[variable->text];
    }
    return fmi2OK;
}

enum { SETTABLE = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_RUNNING };

/* The variable behind a value reference if it may be set now, or NULL with a message. */
static const Variable *settable(Instance *s, fmi2ValueReference reference, Type type, const char *call)
{
    if (is_rate(reference, type)) {
        fail(s, "%s: a rate is computed and cannot be set", call);
        return NULL;
    }
    const Variable *variable = find(s, reference, type, call);
    if (variable == NULL) {
        return NULL;
    }
    if (variable->role == ROLE_OUTPUT || variable->role == ROLE_COMPUTED) {
        fail(s, "%s: %s is computed and cannot be set", call, variable->name);
        return NULL;
    }
    if ((variable->role == ROLE_FIXED || variable->role == ROLE_START) && s->phase == PHASE_RUNNING) {
        fail(s, "%s: %s is %s; it can only be set before the run begins", call, variable->name,
             variable->role == ROLE_FIXED ? "a fixed parameter" : "a start value");
        return NULL;
    }
    return variable;
}

/* Whether a variable may be set now, to this number; a tunable parameter is held to its bounds at once. */
static fmi2Status check_value(Instance *s, fmi2ValueReference reference, Type type, double value, const char *call)
{
    const Variable *variable = settable(s, reference, type, call);
    if (variable == NULL) {
        return fmi2Error;
    }
    if (!isfinite(value)) {
        return fail(s, "%s: %s takes a finite number, not %g", call, variable->name, value);
    }
    return s->phase == PHASE_RUNNING && variable->role == ROLE_TUNABLE ? check_bounds(s, variable, value) : fmi2OK;
}

static fmi2Status begin_set(Instance *s, const fmi2ValueReference vr[], size_t nvr, const void *value, const char *call)
{
    if (s == NULL) {
        return fmi2Error;
    }
    return nvr > 0 && (vr == NULL || value == NULL)
               ? fail(s, "%s: NULL for an array of %lu", call, (unsigned long)nvr)
               : fmi2OK;
}

static void assign(Instance *s, fmi2ValueReference reference, double value)
{
    s->values[reference] = value;
    s->fresh = s->prepared = false;
}

/* All values are looked at before the first is taken: a refused call changes nothing. */
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    Instance *s = enter(c, SETTABLE, "fmi2SetReal");
    fmi2Status status = begin_set(s, vr, nvr, value, "fmi2SetReal");
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        status = check_value(s, vr[k], TYPE_REAL, value[k], "fmi2SetReal");
    }
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        assign(s, vr[k], value[k]);
    }
    return status;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[])
{
    Instance *s = enter(c, SETTABLE, "fmi2SetInteger");
    fmi2Status status = begin_set(s, vr, nvr, value, "fmi2SetInteger");
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        status = check_value(s, vr[k], TYPE_INTEGER, (double)value[k], "fmi2SetInteger");
    }
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        assign(s, vr[k], (double)value[k]);
    }
    return status;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    Instance *s = enter(c, SETTABLE, "fmi2SetBoolean");
    fmi2Status status = begin_set(s, vr, nvr, value, "fmi2SetBoolean");
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        status = check_value(s, vr[k], TYPE_BOOLEAN, 0.0, "fmi2SetBoolean");
    }
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        assign(s, vr[k], value[k] != fmi2False ? 1.0 : 0.0);
    }
    return status;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    Instance *s = enter(c, SETTABLE, "fmi2SetString");
    fmi2Status status = begin_set(s, vr, nvr, value, "fmi2SetString");
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        const Variable *variable = settable(s, vr[k], TYPE_STRING, "fmi2SetString");
        if (variable == NULL) {
            return fmi2Error;
        }
        if (value[k] == NULL || strlen(value[k]) >= MAX_TEXT) {
            return fail(s, "fmi2SetString: %s takes a text of at most %d bytes", variable->name, MAX_TEXT - 1);
        }
    }
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        char *text = s->texts[model_variables[vr[k]].text];
        memset(text, 0, MAX_TEXT); /* equal states are equal bytes */
        memcpy(text, value[k], strlen(value[k]));
        s->fresh = s->prepared = false;
    }
    return status;
}

/* --------------------------------------------------------------------------------------------------------- stepping */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    Instance *s = enter(c, PHASE_RUNNING, "fmi2DoStep");
    double h = communicationStepSize;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (s == NULL) {
        return fmi2Error;
    }
    /* A communication point is told with a few roundings; the last step of a time that was summed up may end far more
       of them past the stop time. */
    double rounding = 1e-6 * h + 4.0 * DBL_EPSILON * fabs(s->time);
    if (!(h > 0.0) || !isfinite(h)) {
        return fail(s, "fmi2DoStep: a communication step must be positive, not %g s", h);
    }
    if (!(fabs(currentCommunicationPoint - s->time) <= rounding)) {
        return fail(s, "fmi2DoStep: the communication point %.17g s does not continue the last one, %.17g s",
                    currentCommunicationPoint, s->time);
    }
    if (s->has_stop_time && currentCommunicationPoint + h > s->stop_time + 1e-3 * h + rounding) {
        return fail(s, "fmi2DoStep: the step to %.17g s goes past the stop time %.17g s", currentCommunicationPoint + h,
                    s->stop_time);
    }
    s->time = currentCommunicationPoint;
    if (advance(s, h) != fmi2OK) {
        return broken(s);
    }
    s->last_successful_time = s->time;
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2CancelStep");
    return s == NULL ? fmi2Error : fail(s, "fmi2CancelStep: steps are not asynchronous");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    Instance *s = enter(c, SETTABLE, "fmi2SetRealInputDerivatives");
    (void)vr;
    (void)order;
    (void)value;
    if (s == NULL) {
        return fmi2Error;
    }
    return nvr == 0 ? fmi2OK : fail(s, "fmi2SetRealInputDerivatives: inputs are not interpolated");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    Instance *s = enter(c, READABLE, "fmi2GetRealOutputDerivatives");
    (void)vr;
    (void)order;
    (void)value;
    if (s == NULL) {
        return fmi2Error;
    }
    return nvr == 0 ? fmi2OK : fail(s, "fmi2GetRealOutputDerivatives: derivatives of outputs over time are not given");
}

/* ----------------------------------------------------------------------------------------------------------- status */

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2GetStatus");
    (void)value;
    (void)kind;
    return s == NULL ? fmi2Error : no_status(s, "fmi2GetStatus: steps are not asynchronous");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2GetRealStatus");
    if (s == NULL) {
        return fmi2Error;
    }
    if (kind != fmi2LastSuccessfulTime || value == NULL) {
        return no_status(s, "fmi2GetRealStatus: only fmi2LastSuccessfulTime is known");
    }
    *value = s->last_successful_time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2GetIntegerStatus");
    (void)kind;
    (void)value;
    return s == NULL ? fmi2Error : no_status(s, "fmi2GetIntegerStatus: there is none");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2GetBooleanStatus");
    if (s == NULL) {
        return fmi2Error;
    }
    if (kind != fmi2Terminated || value == NULL) {
        return no_status(s, "fmi2GetBooleanStatus: only fmi2Terminated is known");
    }
    *value = fmi2False; /* the model never ends a run by itself */
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2GetStringStatus");
    (void)kind;
    (void)value;
    return s == NULL ? fmi2Error : no_status(s, "fmi2GetStringStatus: there is none");
}

/* ----------------------------------------------------------------------------------------------------- saved states */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2GetFMUstate");
    if (s == NULL) {
        return fmi2Error;
    }
    if (state == NULL) {
        return fail(s, "fmi2GetFMUstate: NULL instead of a place for the state");
    }
    /* A state handed in is overwritten, and its memory reused where it fits. */
    State *block = *state;
    if (block == NULL || block->head.size != state_size(s)) {
        free(block);
        *state = block = malloc(state_size(s));
        if (block == NULL) {
            return fail(s, "out of memory for a saved state");
        }
    }
    save_state(s, block);
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2SetFMUstate");
    if (s == NULL) {
        return fmi2Error;
    }
    return state == NULL ? fail(s, "fmi2SetFMUstate: NULL is no state") : restore_state(s, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2FreeFMUstate");
    if (s == NULL) {
        return fmi2Error;
    }
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2SerializedFMUstateSize");
    if (s == NULL) {
        return fmi2Error;
    }
    if (state == NULL || size == NULL) {
        return fail(s, "fmi2SerializedFMUstateSize: NULL is no state");
    }
    *size = ((const State *)state)->head.size;
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2SerializeFMUstate");
    if (s == NULL) {
        return fmi2Error;
    }
    if (state == NULL || bytes == NULL) {
        return fail(s, "fmi2SerializeFMUstate: NULL is no state");
    }
    size_t needed = ((const State *)state)->head.size;
    if (size < needed) {
        return fail(s, "fmi2SerializeFMUstate: the state has %lu bytes, there is room for %lu", (unsigned long)needed,
                    (unsigned long)size);
    }
    memcpy(bytes, state, needed);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2DeSerializeFMUstate");
    StateHead head;
    if (s == NULL) {
        return fmi2Error;
    }
    if (bytes == NULL || state == NULL || size < sizeof head) {
        return fail(s, "fmi2DeSerializeFMUstate: %lu bytes are no saved state", (unsigned long)size);
    }
    memcpy(&head, bytes, sizeof head);
    if (!is_ours(&head, size)) {
        return fail(s, "fmi2DeSerializeFMUstate: the bytes are no saved state of this model");
    }
    State *block = malloc(head.size);
    if (block == NULL) {
        return fail(s, "out of memory for a saved state");
    }
    memcpy(block, bytes, head.size);
    *state = block;
    return fmi2OK;
}

/* ----------------------------------------------------------------------------------------- directional derivatives */

/* Where a real unknown stands among the results of the equations: outputs first, then rates; -1 if it is neither. */
static int unknown_place(fmi2ValueReference reference)
{
    int place = (int)reference - FIRST_OUTPUT;
    if (place >= 0 && place < N_OUTPUTS && model_variables[reference].type == TYPE_REAL) {
        return place;
    }
    return is_rate(reference, TYPE_REAL) ? (int)(N_OUTPUTS + (reference - N_VARIABLES)) : -1;
}

/* A state or memory that is shown as an output depends on itself alone. */
static bool is_kept(fmi2ValueReference reference)
{
    int state = (int)reference - FIRST_STATE, memory = (int)reference - FIRST_MEMORY;
    bool kept = (state >= 0 && state < N_STATES) || (memory >= 0 && memory < N_MEMORY);
    return kept && model_variables[reference].type == TYPE_REAL;
}

/* The direction at the present values. In initialization mode a start that is computed moves with what it follows from. */
static fmi2Status complete_direction(Instance *s)
{
#if N_INITIAL > 0
    if (s->phase == PHASE_INITIALIZATION) {
        const double clock[2] = {s->time, s->step};
        forget_computed_starts(s);
        MODEL_INITIAL_DIRECTIONAL(clock, s->values, s->direction, s->scratch);
        for (int k = 0; k < N_INITIAL; k++) {
            s->direction[model_initial_targets[k]] = s->scratch[k];
        }
        return compute_starts(s);
    }
#else
    (void)s;
#endif
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[])
{
    Instance *s = enter(c, READABLE, "fmi2GetDirectionalDerivative");
    if (s == NULL) {
        return fmi2Error;
    }
    if ((nUnknown > 0 && (vUnknown_ref == NULL || dvUnknown == NULL)) ||
        (nKnown > 0 && (vKnown_ref == NULL || dvKnown == NULL))) {
        return fail(s, "fmi2GetDirectionalDerivative: NULL for an array");
    }
    if (refresh(s) != fmi2OK) {
        return fmi2Error;
    }
    memset(s->direction, 0, sizeof s->direction);
    for (size_t k = 0; k < nKnown; k++) {
        const Variable *known = find(s, vKnown_ref[k], TYPE_REAL, "fmi2GetDirectionalDerivative");
        if (known == NULL) {
            return fmi2Error;
        }
        if (known->role == ROLE_OUTPUT || (known->role == ROLE_COMPUTED && s->phase == PHASE_INITIALIZATION)) {
            return fail(s, "fmi2GetDirectionalDerivative: %s is computed; it is no known", known->name);
        }
        s->direction[vKnown_ref[k]] = dvKnown[k];
    }
    if (complete_direction(s) != fmi2OK) {
        return fmi2Error;
    }
#if N_OUTPUTS + N_STATES > 0
    const double clock[2] = {s->time, s->step};
    MODEL_DIRECTIONAL(clock, s->values, s->direction, s->scratch);
#endif
    for (size_t k = 0; k < nUnknown; k++) {
        int place = unknown_place(vUnknown_ref[k]);
        if (place >= 0) {
            dvUnknown[k] = s->scratch[place];
        } else if (is_kept(vUnknown_ref[k])) {
            dvUnknown[k] = s->direction[vUnknown_ref[k]];
        } else {
            return fail(s, "fmi2GetDirectionalDerivative: value reference %u is neither a real output nor a rate",
                        vUnknown_ref[k]);
        }
    }
    return fmi2OK;
}
