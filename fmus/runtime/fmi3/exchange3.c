/* The functions of FMI 3.0 for model exchange, by those of the runtime. */

#if MODEL_EXCHANGE
fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                          fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage)
{
    const Listener listener = {logMessage, instanceEnvironment};
    (void)resourcePath;
    (void)visible;
    Instance *s = create(listener, instanceName, instantiationToken, loggingOn);
    if (s != NULL) {
        s->exchanges = true;
    }
    return s;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return enter_event_mode(instance, REGIME_CONTINUOUS, "fmi3EnterEventMode");
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    fmi3Boolean *const told[] = {discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
                                 valuesOfContinuousStatesChanged, nextEventTimeDefined};
    bool has_room = nextEventTime != NULL, states_changed = false;
    double next = INFINITY;
    for (int k = 0; k < 5; k++) {
        has_room = has_room && told[k] != NULL;
    }
    if (handle_event(instance, has_room, &states_changed, &next, "fmi3UpdateDiscreteStates") != STATUS_OK) {
        return fmi3Error;
    }
    *discreteStatesNeedUpdate = *terminateSimulation = *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = states_changed;
    *nextEventTimeDefined = isfinite(next);
    *nextEventTime = isfinite(next) ? next : 0.0;
    return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    return enter_continuous_time(instance, "fmi3EnterContinuousTimeMode");
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return complete_step(instance, enterEventMode, terminateSimulation, "fmi3CompletedIntegratorStep");
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    return set_time(instance, time, "fmi3SetTime");
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    return set_continuous_states(instance, continuousStates, nContinuousStates, "fmi3SetContinuousStates");
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates)
{
    return read_rates(instance, derivatives, nContinuousStates, "fmi3GetContinuousStateDerivatives");
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
    return read_indicators(instance, eventIndicators, nEventIndicators, "fmi3GetEventIndicators");
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    return read_continuous_states(instance, continuousStates, nContinuousStates, "fmi3GetContinuousStates");
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates)
{
    return read_nominals(instance, READABLE, nominals, nContinuousStates, "fmi3GetNominalsOfContinuousStates");
}

/* How many numbers there are of a kind: as there are no structural parameters, always as many. */
static Status tell_number(fmi3Instance instance, int number, size_t *told, const char *call)
{
    Instance *s = enter(instance, ANY_PHASE, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (!s->exchanges) {
        return fail(s, "%s: this instance is for co-simulation", call);
    }
    if (told == NULL) {
        return fail(s, "%s: NULL for an answer", call);
    }
    *told = (size_t)number;
    return STATUS_OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    return tell_number(instance, N_INDICATORS, nEventIndicators, "fmi3GetNumberOfEventIndicators");
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    return tell_number(instance, N_STATES, nContinuousStates, "fmi3GetNumberOfContinuousStates");
}
#endif
