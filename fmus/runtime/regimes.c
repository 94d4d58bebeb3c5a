/* Model exchange as an importer calls it, whatever the version of FMI: who may call what in which regime, and what is read and
   set there. Each function is called as `call` by the importer. */

#if MODEL_EXCHANGE
/* NULL unless an instance for model exchange may be called so now: while it runs, in one of the regimes. */
static Instance *enter_regime(void *c, unsigned regimes, const char *call)
{
    Instance *s = enter(c, PHASE_RUNNING, call);
    if (s == NULL) {
        return NULL;
    }
    if (!s->exchanges) {
        fail(s, "%s: this instance is for co-simulation", call);
        return NULL;
    }
    if (!((unsigned)s->regime & regimes)) {
        fail(s, "%s is not allowed in %s", call, s->regime == REGIME_EVENT ? "event mode" : "continuous-time mode");
        return NULL;
    }
    return s;
}

static Status enter_event_mode(void *c, unsigned regimes, const char *call)
{
    Instance *s = enter_regime(c, regimes, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    s->regime = REGIME_EVENT;
    s->fresh = false;
    return STATUS_OK;
}

static Status enter_continuous_time(void *c, const char *call)
{
    Instance *s = enter_regime(c, REGIME_EVENT, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    s->regime = REGIME_CONTINUOUS;
    s->fresh = false;
    return STATUS_OK;
}

/* What `update_discrete` tells of an event; whether there is room to tell it is the importer's. */
static Status handle_event(void *c, bool has_room, bool *states_changed, double *next, const char *call)
{
    Instance *s = enter_regime(c, REGIME_EVENT, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (!has_room) {
        return fail(s, "%s: NULL for what the event is told by", call);
    }
    return update_discrete(s, states_changed, next) == STATUS_OK ? STATUS_OK : broken(s);
}

/* No step needs to be told: what changes does so at events, which indicators and times tell. */
static Status complete_step(void *c, Truth *enter_event, Truth *end, const char *call)
{
    Instance *s = enter_regime(c, REGIME_CONTINUOUS, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (enter_event == NULL || end == NULL) {
        return fail(s, "%s: NULL for an answer", call);
    }
    *enter_event = *end = false;
    return STATUS_OK;
}

static Status set_time(void *c, double time, const char *call)
{
    Instance *s = enter_regime(c, REGIME_EVENT | REGIME_CONTINUOUS, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (!isfinite(time)) {
        return fail(s, "%s: %g is no time", call, time);
    }
    s->time = s->last_successful_time = time;
    s->fresh = false;
    return STATUS_OK;
}

static Status set_continuous_states(void *c, const double x[], size_t nx, const char *call)
{
    Instance *s = enter_regime(c, REGIME_CONTINUOUS, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (nx != N_STATES || (nx > 0 && x == NULL)) {
        return fail(s, "%s: there are %d numbers, not %lu", call, N_STATES, (unsigned long)nx);
    }
    for (size_t k = 0; k < nx; k++) {
        if (!isfinite(x[k])) {
            return fail(s, "%s: %s takes a finite number, not %g", call, model_variables[FIRST_STATE + k].name, x[k]);
        }
    }
    for (size_t k = 0; k < nx; k++) {
        s->values[FIRST_STATE + k] = x[k];
    }
    s->fresh = false;
    return STATUS_OK;
}

/* ---------------------------------------------------------------------------------------------------------- reading */

/* What may be read but the outputs: where they are not asked for, one without a value is in the way of nothing else. */
static Status refresh_all_but_outputs(Instance *s)
{
    if (s->phase == PHASE_INITIALIZATION) {
        return prepare(s);
    }
    return s->phase == PHASE_RUNNING && s->regime == REGIME_EVENT ? look(s) : STATUS_OK;
}

/* NULL unless something of an instance for model exchange may be read in these phases, of which there are `count` numbers. */
static Instance *enter_to_read(void *c, unsigned phases, const double *numbers, size_t given, int count, const char *call)
{
    Instance *s = enter(c, phases, call);
    if (s == NULL) {
        return NULL;
    }
    if (!s->exchanges) {
        fail(s, "%s: this instance is for co-simulation", call);
        return NULL;
    }
    if (given != (size_t)count || (given > 0 && numbers == NULL)) {
        fail(s, "%s: there are %d numbers, not %lu", call, count, (unsigned long)given);
        return NULL;
    }
    return refresh_all_but_outputs(s) == STATUS_OK ? s : NULL;
}

static Status read_rates(void *c, double derivatives[], size_t nx, const char *call)
{
    Instance *s = enter_to_read(c, READABLE, derivatives, nx, N_STATES, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (rates(s) != STATUS_OK) {
        return STATUS_DISCARD; /* a solver may try a shorter step */
    }
    for (size_t k = 0; k < nx; k++) {
        derivatives[k] = s->slopes[0][k];
    }
    return STATUS_OK;
}

static Status read_indicators(void *c, double indicators[], size_t ni, const char *call)
{
    Instance *s = enter_to_read(c, READABLE, indicators, ni, N_INDICATORS, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    return find_indicators(s, indicators);
}

static Status read_continuous_states(void *c, double x[], size_t nx, const char *call)
{
    Instance *s = enter_to_read(c, READABLE, x, nx, N_STATES, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    for (size_t k = 0; k < nx; k++) {
        x[k] = s->values[FIRST_STATE + k];
    }
    return STATUS_OK;
}

static Status read_nominals(void *c, unsigned phases, double nominals[], size_t nx, const char *call)
{
    Instance *s = enter_to_read(c, phases, nominals, nx, N_STATES, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    for (size_t k = 0; k < nx; k++) {
        nominals[k] = 1.0;
    }
    return STATUS_OK;
}
#endif
