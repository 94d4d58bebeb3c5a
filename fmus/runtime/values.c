/* The FMI 2.0 functions that get and set: the way between value references and values. */

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
    if (variable->role == ROLE_OUTPUT || variable->role == ROLE_KEPT) {
        fail(s, "%s: %s is computed and cannot be set", call, variable->name);
        return NULL;
    }
    if (variable->role == ROLE_FIXED && s->phase == PHASE_RUNNING) {
        fail(s, "%s: %s is a fixed parameter; it can only be set before the run begins", call, variable->name);
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

/* Whether a derivative of this order may be given for a variable. */
static fmi2Status check_derivative(Instance *s, fmi2ValueReference reference, fmi2Integer order, double value)
{
    static const char call[] = "fmi2SetRealInputDerivatives";
    if (is_rate(reference, TYPE_REAL)) {
        return fail(s, "%s: a rate is no input", call);
    }
    const Variable *variable = find(s, reference, TYPE_REAL, call);
    if (variable == NULL) {
        return fmi2Error;
    }
    if (variable->role != ROLE_INPUT) {
        return fail(s, "%s: %s is no input", call, variable->name);
    }
    if (order < 1 || order > MAX_ORDER) {
        return fail(s, "%s: %s takes derivatives of the orders 1 to %d, not %d", call, variable->name, MAX_ORDER, order);
    }
    return isfinite(value) ? fmi2OK : fail(s, "%s: %s takes a finite derivative, not %g", call, variable->name, value);
}

/* For the coming step; in which order values and derivatives are set does not matter. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    Instance *s = enter(c, SETTABLE, "fmi2SetRealInputDerivatives");
    fmi2Status status = begin_set(s, vr, nvr, order == NULL ? NULL : value, "fmi2SetRealInputDerivatives");
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        status = check_derivative(s, vr[k], order[k], value[k]);
    }
    for (size_t k = 0; k < nvr && status == fmi2OK; k++) {
        s->input_derivatives[model_variables[vr[k]].input][order[k] - 1] = value[k];
        s->moving = s->moving || value[k] != 0.0;
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
