/* The FMI 2.0 functions of the life cycle, of stepping and of the status: who may call what, and when. */

enum { ANY_PHASE = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_RUNNING | PHASE_TERMINATED | PHASE_ERROR };
enum { SETTABLE = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_RUNNING };
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
    Instance *s = (Instance *)c;
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

/* ------------------------------------------------------------------------------------------------------- life cycle */

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

#if defined(MAX_INSTANCES)
/* A host without a heap says at compile time how many instances there are at once; one thread makes and frees them. */
#define NO_INSTANCE "all instances are taken; compile with a larger MAX_INSTANCES"
static Instance instances[MAX_INSTANCES];
static bool taken_instances[MAX_INSTANCES];

static Instance *take_instance(void)
{
    for (int n = 0; n < MAX_INSTANCES; n++) {
        if (!taken_instances[n]) {
            taken_instances[n] = true;
            memset(&instances[n], 0, sizeof instances[n]);
            return &instances[n];
        }
    }
    return NULL;
}

static void leave_instance(Instance *s)
{
    taken_instances[s - instances] = false;
}
#else
#define NO_INSTANCE "out of memory"

static Instance *take_instance(void)
{
    return (Instance *)calloc(1, sizeof(Instance));
}

static void leave_instance(Instance *s)
{
    free(s);
}
#endif

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
    Instance *s = take_instance();
    if (s == NULL) {
        refuse_instance(functions, instanceName, MODEL_NAME ": " NO_INSTANCE);
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
    Instance *s = (Instance *)c;
    if (s == NULL) {
        return;
    }
#if !REAL_TIME
    free(s->tape.committed);
#endif
    leave_instance(s);
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
        int known = -1;
        for (int n = 0; n < N_LOG_CATEGORIES && categories[k] != NULL; n++) {
            known = strcmp(categories[k], log_categories[n]) == 0 ? n : known;
        }
        if (known < 0) {
            return fail(s, "there is no log category %.100s", categories[k] == NULL ? "NULL" : categories[k]);
        }
        events = events || known == LOG_EVENTS || known == LOG_ALL;
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
    s->time = s->start_time = s->last_successful_time = s->reached = startTime;
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
#if N_TAPE > 0 && !REAL_TIME
    const char *path = s->texts[model_variables[TAPE_FILE].text];
    if (path[0] != '\0') {
        if (tape_commit(s) != fmi2OK || tape_save(s, path) != fmi2OK) {
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
    double reached = s->last_successful_time, rounding = 1e-6 * h + 4.0 * DBL_EPSILON * fabs(reached);
    if (!(h > 0.0) || !isfinite(h)) {
        return fail(s, "fmi2DoStep: a communication step must be positive, not %g s", h);
    }
    if (!(fabs(currentCommunicationPoint - reached) <= rounding)) {
        return fail(s, "fmi2DoStep: the communication point %.17g s does not continue the last one, %.17g s",
                    currentCommunicationPoint, reached);
    }
    if (s->has_stop_time && currentCommunicationPoint + h > s->stop_time + 1e-3 * h + rounding) {
        return fail(s, "fmi2DoStep: the step to %.17g s goes past the stop time %.17g s", currentCommunicationPoint + h,
                    s->stop_time);
    }
    if (advance(s, currentCommunicationPoint, h) != fmi2OK) {
        return broken(s);
    }
    s->last_successful_time = currentCommunicationPoint + h;
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2CancelStep");
    return s == NULL ? fmi2Error : fail(s, "fmi2CancelStep: steps are not asynchronous");
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
