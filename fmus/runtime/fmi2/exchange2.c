/* The functions of FMI 2.0 for model exchange, by those of the runtime. */

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

/* NULL unless something of an instance for model exchange may be read, of which there are `count` numbers. */
static Instance *enter_to_read(void *c, const double *numbers, size_t given, int count, const char *call)
{
    Instance *s = enter(c, READABLE, call);
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
    return refresh(s) == STATUS_OK ? s : NULL;
}

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    Instance *s = enter_regime(c, REGIME_CONTINUOUS, "fmi2EnterEventMode");
    if (s == NULL) {
        return fmi2Error;
    }
    s->regime = REGIME_EVENT;
    s->fresh = false;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    Instance *s = enter_regime(c, REGIME_EVENT, "fmi2NewDiscreteStates");
    bool states_changed = false;
    double next = INFINITY;
    if (s == NULL) {
        return fmi2Error;
    }
    if (info == NULL) {
        return fail(s, "fmi2NewDiscreteStates: NULL for what the event is told by");
    }
    if (update_discrete(s, &states_changed, &next) != STATUS_OK) {
        return broken(s);
    }
    info->newDiscreteStatesNeeded = fmi2False;
    info->terminateSimulation = fmi2False;
    info->nominalsOfContinuousStatesChanged = fmi2False;
    info->valuesOfContinuousStatesChanged = states_changed ? fmi2True : fmi2False;
    info->nextEventTimeDefined = isfinite(next) ? fmi2True : fmi2False;
    info->nextEventTime = isfinite(next) ? next : 0.0;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    Instance *s = enter_regime(c, REGIME_EVENT, "fmi2EnterContinuousTimeMode");
    if (s == NULL) {
        return fmi2Error;
    }
    s->regime = REGIME_CONTINUOUS;
    s->fresh = false;
    return fmi2OK;
}

/* No step needs to be told: what changes does so at events, which indicators and times tell. */
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    Instance *s = enter_regime(c, REGIME_CONTINUOUS, "fmi2CompletedIntegratorStep");
    (void)noSetFMUStatePriorToCurrentPoint;
    if (s == NULL) {
        return fmi2Error;
    }
    if (enterEventMode == NULL || terminateSimulation == NULL) {
        return fail(s, "fmi2CompletedIntegratorStep: NULL for an answer");
    }
    *enterEventMode = *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    Instance *s = enter_regime(c, REGIME_EVENT | REGIME_CONTINUOUS, "fmi2SetTime");
    if (s == NULL) {
        return fmi2Error;
    }
    if (!isfinite(time)) {
        return fail(s, "fmi2SetTime: %g is no time", time);
    }
    s->time = s->last_successful_time = time;
    s->fresh = false;
    return fmi2OK;
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    Instance *s = enter_regime(c, REGIME_CONTINUOUS, "fmi2SetContinuousStates");
    if (s == NULL) {
        return fmi2Error;
    }
    if (nx != N_STATES || (nx > 0 && x == NULL)) {
        return fail(s, "fmi2SetContinuousStates: there are %d numbers, not %lu", N_STATES, (unsigned long)nx);
    }
    for (size_t k = 0; k < nx; k++) {
        if (!isfinite(x[k])) {
            return fail(s, "fmi2SetContinuousStates: %s takes a finite number, not %g",
                        model_variables[FIRST_STATE + k].name, x[k]);
        }
    }
    for (size_t k = 0; k < nx; k++) {
        s->values[FIRST_STATE + k] = x[k];
    }
    s->fresh = false;
    return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    Instance *s = enter_to_read(c, derivatives, nx, N_STATES, "fmi2GetDerivatives");
    if (s == NULL || rates(s) != STATUS_OK) {
        return fmi2Error;
    }
    for (size_t k = 0; k < nx; k++) {
        derivatives[k] = s->slopes[0][k];
    }
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    Instance *s = enter_to_read(c, eventIndicators, ni, N_INDICATORS, "fmi2GetEventIndicators");
    if (s == NULL) {
        return fmi2Error;
    }
    find_indicators(s, eventIndicators);
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    Instance *s = enter_to_read(c, x, nx, N_STATES, "fmi2GetContinuousStates");
    if (s == NULL) {
        return fmi2Error;
    }
    for (size_t k = 0; k < nx; k++) {
        x[k] = s->values[FIRST_STATE + k];
    }
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx)
{
    Instance *s = enter_to_read(c, x_nominal, nx, N_STATES, "fmi2GetNominalsOfContinuousStates");
    if (s == NULL) {
        return fmi2Error;
    }
    for (size_t k = 0; k < nx; k++) {
        x_nominal[k] = 1.0;
    }
    return fmi2OK;
}
#endif
