/* Getting and setting, whatever the version of FMI: the way between value references and values. A value reference means a
   variable, or with FMI 3.0 all elements of an array, which stand side by side among the values. Each function is called as
   `call` by the importer. */

/* How many values a value reference means, 0 within an array. Of FMI 2.0 it is known to the compiler. */
static inline size_t elements(Reference reference)
{
    return HAS_ARRAYS ? (size_t)model_variables[reference].size : 1;
}

/* The variable behind a value reference, or NULL with a message. A rate der(x) has no entry of its own. */
static const Variable *find(Instance *s, Reference reference, Type type, const char *call)
{
    if (reference >= N_VARIABLES || elements(reference) == 0) {
        fail(s, "%s: there is no variable with value reference %u", call, reference);
        return NULL;
    }
    if (model_variables[reference].type != type) {
        fail(s, "%s: %s is of another type", call, model_variables[reference].name);
        return NULL;
    }
    return &model_variables[reference];
}

static bool is_rate(Reference reference, Type type)
{
    return type == TYPE_REAL && reference >= N_VARIABLES && reference < N_VARIABLES + N_STATES &&
           elements(FIRST_STATE + (reference - N_VARIABLES)) > 0;
}

#if N_STATES > 0
static void find_rates(Instance *s, double *result)
{
#if MODEL_EXCHANGE
    if (s->exchanges && s->phase != PHASE_INITIALIZATION) {
        frozen_rates(s, result);
        return;
    }
#endif
    call_equations(s, MODEL_DERIVATIVES, result);
}
#endif

/* The rates of the states into the scratch space, from which rates are read. */
static Status rates(Instance *s)
{
#if N_STATES > 0
    find_rates(s, s->slopes[0]);
#endif
    for (int n = 0; n < N_STATES; n++) {
        if (!isfinite(s->slopes[0][n])) {
            return fail(s, "derivatives: 'der(%s)' is %g at t = %.17g s", model_variables[FIRST_STATE + n].name,
                        s->slopes[0][n], s->time);
        }
    }
    return STATUS_OK;
}

static Status begin_get(Instance *s, const Reference vr[], size_t nvr, const void *value, const char *call)
{
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        return fail(s, "%s: NULL for an array of %lu", call, (unsigned long)nvr);
    }
    return nvr > 0 ? refresh(s) : STATUS_OK;
}

/* Too few values, or too many, for the value references. */
NEVER_INLINE Status miscounted(Instance *s, size_t given, const char *call)
{
    return fail(s, "%s: %lu values are not those of the variables", call, (unsigned long)given);
}

/* Importers keep numbers in the types of their version of FMI. */
ALWAYS_INLINE void write_number(void *numbers, size_t place, Type type, double value)
{
    switch (type) {
    case TYPE_REAL: ((double *)numbers)[place] = value; break;
    case TYPE_INTEGER: ((int32_t *)numbers)[place] = (int32_t)value; break;
    default: ((Truth *)numbers)[place] = value != 0.0;
    }
}

ALWAYS_INLINE double read_number(const void *numbers, size_t place, Type type)
{
    switch (type) {
    case TYPE_REAL: return ((const double *)numbers)[place];
    case TYPE_INTEGER: return (double)((const int32_t *)numbers)[place];
    default: return ((const Truth *)numbers)[place] ? 1.0 : 0.0;
    }
}

/* The numbers behind a value reference, or NULL with a message; rates are found once in a call. */
ALWAYS_INLINE const double *numbers_of(Instance *s, Reference reference, Type type, bool *rated, size_t *count,
                                       const char *call)
{
    if (HAS_TIME && type == TYPE_REAL && reference == N_VARIABLES + N_STATES) {
        *count = 1;
        return &s->last_successful_time;
    }
#if HAS_INDICATORS && MODEL_EXCHANGE && N_INDICATORS > 0
    if (type == TYPE_REAL && reference == N_VARIABLES + N_STATES + 1) {
        if (find_indicators(s, s->scratch) != STATUS_OK) {
            return NULL;
        }
        *count = N_INDICATORS;
        return s->scratch;
    }
#endif
    if (is_rate(reference, type)) {
        if (!*rated && rates(s) != STATUS_OK) {
            return NULL;
        }
        *rated = true;
        *count = elements(FIRST_STATE + (reference - N_VARIABLES));
        return s->slopes[0] + (reference - N_VARIABLES);
    }
    if (find(s, reference, type, call) == NULL) {
        return NULL;
    }
    *count = elements(reference);
    return s->values + reference;
}

/* Reals, integers or booleans into `values`, of which there are `room`. */
ALWAYS_INLINE Status get_numbers(void *c, Type type, const Reference vr[], size_t nvr, void *values, size_t room,
                                 const char *call)
{
    Instance *s = enter(c, READABLE, call);
    size_t used = 0, count = 1;
    bool rated = false;
    if (begin_get(s, vr, nvr, values, call) != STATUS_OK) {
        return STATUS_ERROR;
    }
    for (size_t k = 0; k < nvr; k++) {
        const double *numbers = numbers_of(s, vr[k], type, &rated, &count, call);
        if (numbers == NULL) {
            return STATUS_ERROR;
        }
        if (HAS_ARRAYS && count > room - used) {
            return miscounted(s, room, call);
        }
        for (size_t n = 0; n < count; n++) {
            write_number(values, used++, type, numbers[n]);
        }
    }
    return HAS_ARRAYS && used != room ? miscounted(s, room, call) : STATUS_OK;
}

static Status get_texts(void *c, const Reference vr[], size_t nvr, const char *values[], size_t room, const char *call)
{
    Instance *s = enter(c, READABLE, call);
    size_t used = 0;
    if (begin_get(s, vr, nvr, values, call) != STATUS_OK) {
        return STATUS_ERROR;
    }
    for (size_t k = 0; k < nvr; k++) {
        const Variable *variable = find(s, vr[k], TYPE_STRING, call);
        if (variable == NULL) {
            return STATUS_ERROR;
        }
        if (HAS_ARRAYS && elements(vr[k]) > room - used) {
            return miscounted(s, room, call);
        }
        for (size_t n = 0; n < elements(vr[k]); n++) {
            values[used++] = s->texts[variable[n].text];
        }
    }
    return HAS_ARRAYS && used != room ? miscounted(s, room, call) : STATUS_OK;
}

/* The variable behind a value reference if it may be set now, or NULL with a message. */
static const Variable *settable(Instance *s, Reference reference, Type type, const char *call)
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
#if MODEL_EXCHANGE
    /* The standard would have discrete inputs refused as well, but FMPy sets all inputs whenever it looks for events. */
    if (s->exchanges && s->phase == PHASE_RUNNING && s->regime == REGIME_CONTINUOUS && variable->role != ROLE_INPUT) {
        fail(s, "%s: %s is set at events only; enter event mode", call, variable->name);
        return NULL;
    }
#endif
    return variable;
}

/* Whether a variable takes this number; a tunable parameter is held to its bounds at once. */
static Status check_value(Instance *s, const Variable *variable, double value, const char *call)
{
    if (!isfinite(value)) {
        return fail(s, "%s: %s takes a finite number, not %g", call, variable->name, value);
    }
    return s->phase == PHASE_RUNNING && variable->role == ROLE_TUNABLE ? check_bounds(s, variable, value) : STATUS_OK;
}

static Status begin_set(Instance *s, const Reference vr[], size_t nvr, const void *value, const char *call)
{
    if (s == NULL) {
        return STATUS_ERROR;
    }
    return nvr > 0 && (vr == NULL || value == NULL)
               ? fail(s, "%s: NULL for an array of %lu", call, (unsigned long)nvr)
               : STATUS_OK;
}

/* All values are looked at before the first is taken: a refused call changes nothing. */
ALWAYS_INLINE Status set_numbers(void *c, Type type, const Reference vr[], size_t nvr, const void *values, size_t given,
                                 const char *call)
{
    Instance *s = enter(c, SETTABLE, call);
    Status status = begin_set(s, vr, nvr, values, call);
    size_t used = 0;
    for (size_t k = 0; k < nvr && status == STATUS_OK; k++) {
        const Variable *variable = settable(s, vr[k], type, call);
        if (variable == NULL) {
            return STATUS_ERROR;
        }
        if (HAS_ARRAYS && elements(vr[k]) > given - used) {
            return miscounted(s, given, call);
        }
        for (size_t n = 0; n < elements(vr[k]) && status == STATUS_OK; n++) {
            status = check_value(s, variable + n, read_number(values, used++, type), call);
        }
    }
    if (status != STATUS_OK) {
        return status;
    }
    if (HAS_ARRAYS && used != given) {
        return miscounted(s, given, call);
    }
    used = 0;
    for (size_t k = 0; k < nvr; k++) {
        for (size_t n = 0; n < elements(vr[k]); n++) {
            s->values[vr[k] + n] = read_number(values, used++, type);
        }
        s->fresh = s->prepared = false;
    }
    return STATUS_OK;
}

static Status set_texts(void *c, const Reference vr[], size_t nvr, const char *const values[], size_t given,
                        const char *call)
{
    Instance *s = enter(c, SETTABLE, call);
    Status status = begin_set(s, vr, nvr, values, call);
    size_t used = 0;
    for (size_t k = 0; k < nvr && status == STATUS_OK; k++) {
        const Variable *variable = settable(s, vr[k], TYPE_STRING, call);
        if (variable == NULL) {
            return STATUS_ERROR;
        }
        if (HAS_ARRAYS && elements(vr[k]) > given - used) {
            return miscounted(s, given, call);
        }
        for (size_t n = 0; n < elements(vr[k]); n++, used++) {
            if (values[used] == NULL || strlen(values[used]) >= MAX_TEXT) {
                return fail(s, "%s: %s takes a text of at most %d bytes", call, variable[n].name, MAX_TEXT - 1);
            }
        }
    }
    if (status != STATUS_OK) {
        return status;
    }
    if (HAS_ARRAYS && used != given) {
        return miscounted(s, given, call);
    }
    used = 0;
    for (size_t k = 0; k < nvr; k++) {
        for (size_t n = 0; n < elements(vr[k]); n++, used++) {
            char *text = s->texts[model_variables[vr[k] + n].text];
            memset(text, 0, MAX_TEXT); /* equal states are equal bytes */
            memcpy(text, values[used], strlen(values[used]));
        }
        s->fresh = s->prepared = false;
    }
    return STATUS_OK;
}
