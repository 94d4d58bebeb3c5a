/* The functions of FMI 2.0 for co-simulation, and those that model exchange shares with it, by those of the runtime. */

/* The importer reads a message as a printf format, and #r12# in it as a reference to a variable: double both signs.
   There is room for twice the longest message. */
static void escape(const char *from, char to[2 * MAX_MESSAGE])
{
    size_t used = 0;
    for (; *from != '\0'; from++) {
        if (*from == '%' || *from == '#') {
            to[used++] = *from;
        }
        to[used++] = *from;
    }
    to[used] = '\0';
}

static void tell(const Listener *listener, const char *name, Status status, const char *category, const char *text)
{
    char escaped[2 * MAX_MESSAGE];
    if (listener->log == NULL) {
        return;
    }
    escape(text, escaped);
    listener->log(listener->environment, name, status, category, escaped);
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

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    Listener listener = {NULL, NULL};
    (void)fmuResourceLocation;
    (void)visible;
    if (functions != NULL) {
        listener.log = functions->logger;
        listener.environment = functions->componentEnvironment;
    }
#if MODEL_EXCHANGE
    Instance *s = create(listener, instanceName, fmuGUID, loggingOn != fmi2False);
    if (s != NULL) {
        s->exchanges = fmuType == fmi2ModelExchange;
    }
    return s;
#else
    if (fmuType != fmi2CoSimulation) {
        return refuse_instance(listener, instanceName == NULL ? "?" : instanceName,
                               MODEL_NAME ": this is a co-simulation FMU");
    }
    return create(listener, instanceName, fmuGUID, loggingOn != fmi2False);
#endif
}

void fmi2FreeInstance(fmi2Component c)
{
    release(c);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[])
{
    return set_logging(c, loggingOn != fmi2False, nCategories, categories, "fmi2SetDebugLogging");
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    (void)toleranceDefined;
    (void)tolerance;
    return set_experiment(c, startTime, stopTimeDefined != fmi2False, stopTime, "fmi2SetupExperiment");
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return enter_initialization(c, "fmi2EnterInitializationMode");
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return exit_initialization(c, "fmi2ExitInitializationMode");
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    return terminate(c, "fmi2Terminate");
}

fmi2Status fmi2Reset(fmi2Component c)
{
    return reset(c, "fmi2Reset");
}

/* --------------------------------------------------------------------------------------------------------- stepping */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return do_step(c, currentCommunicationPoint, communicationStepSize, "fmi2DoStep");
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    Instance *s = enter(c, ANY_PHASE, "fmi2CancelStep");
    return s == NULL ? fmi2Error : fail(s, "fmi2CancelStep: steps are not asynchronous");
}

/* ----------------------------------------------------------------------------------------------------------- values */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    return get_numbers(c, TYPE_REAL, vr, nvr, value, nvr, "fmi2GetReal");
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[])
{
    return get_numbers(c, TYPE_INTEGER, vr, nvr, value, nvr, "fmi2GetInteger");
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    return get_numbers(c, TYPE_BOOLEAN, vr, nvr, value, nvr, "fmi2GetBoolean");
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    return get_texts(c, vr, nvr, value, nvr, "fmi2GetString");
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    return set_numbers(c, TYPE_REAL, vr, nvr, value, nvr, "fmi2SetReal");
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[])
{
    return set_numbers(c, TYPE_INTEGER, vr, nvr, value, nvr, "fmi2SetInteger");
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    return set_numbers(c, TYPE_BOOLEAN, vr, nvr, value, nvr, "fmi2SetBoolean");
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    return set_texts(c, vr, nvr, value, nvr, "fmi2SetString");
}

/* Whether a derivative of this order may be given for a variable. */
static Status check_derivative(Instance *s, fmi2ValueReference reference, fmi2Integer order, double value)
{
    static const char call[] = "fmi2SetRealInputDerivatives";
    if (is_rate(reference, TYPE_REAL)) {
        return fail(s, "%s: a rate is no input", call);
    }
    const Variable *variable = find(s, reference, TYPE_REAL, call);
    if (variable == NULL) {
        return STATUS_ERROR;
    }
    if (variable->role != ROLE_INPUT) {
        return fail(s, "%s: %s is no input", call, variable->name);
    }
    if (order < 1 || order > MAX_ORDER) {
        return fail(s, "%s: %s takes derivatives of the orders 1 to %d, not %d", call, variable->name, MAX_ORDER, order);
    }
    return isfinite(value) ? STATUS_OK : fail(s, "%s: %s takes a finite derivative, not %g", call, variable->name, value);
}

/* For the coming step; in which order values and derivatives are set does not matter. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    Instance *s = enter(c, SETTABLE, "fmi2SetRealInputDerivatives");
#if MODEL_EXCHANGE
    if (s != NULL && s->exchanges) {
        return fail(s, "fmi2SetRealInputDerivatives: this instance is for model exchange");
    }
#endif
    Status status = begin_set(s, vr, nvr, order == NULL ? NULL : value, "fmi2SetRealInputDerivatives");
    for (size_t k = 0; k < nvr && status == STATUS_OK; k++) {
        status = check_derivative(s, vr[k], order[k], value[k]);
    }
    for (size_t k = 0; k < nvr && status == STATUS_OK; k++) {
        s->input_derivatives[model_variables[vr[k]].input][order[k] - 1] = value[k];
        s->moving = s->moving || value[k] != 0.0;
    }
    return status;
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

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[])
{
    fmi2Status status = directional_derivative(c, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, nKnown, dvUnknown,
                                               nUnknown, "fmi2GetDirectionalDerivative");
    return status == fmi2Discard ? fmi2Error : status; /* this version lists what may be discarded: not this */
}

/* ----------------------------------------------------------------------------------------------------------- states */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return get_state(c, state, "fmi2GetFMUstate");
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return set_state(c, state, "fmi2SetFMUstate");
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return free_state(c, state, "fmi2FreeFMUstate");
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    return size_of_state(c, state, size, "fmi2SerializedFMUstateSize");
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return serialize(c, state, bytes, size, "fmi2SerializeFMUstate");
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return deserialize(c, bytes, size, state, "fmi2DeSerializeFMUstate");
}

/* ----------------------------------------------------------------------------------------------------------- status */

/* The standard's answer to a question about the status that has none; nothing is wrong. */
static fmi2Status no_status(const Instance *s, const char *text)
{
    send(s, STATUS_DISCARD, LOG_WARNING, text);
    return fmi2Discard;
}

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
