/* The functions of FMI 3.0 that every binary has to export and these FMUs have no use for: other types of variables, clocks,
   event mode, configuration mode, other kinds of FMUs. Each says so. */

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

static fmi3Status absent(fmi3Instance instance, const char *call, const char *what)
{
    Instance *s = enter(instance, ANY_PHASE, call);
    return s == NULL ? fmi3Error : fail(s, "%s: this FMU has no %s", call, what);
}

/* Of no variables it is had. */
static fmi3Status absent_type(fmi3Instance instance, size_t count, const char *call)
{
    return instance != NULL && count == 0 ? fmi3OK : absent(instance, call, "variable of this type");
}

#define ABSENT(what, name, parameters)                                                                                \
    fmi3Status name parameters                                                                                        \
    {                                                                                                                 \
        return absent(instance, #name, what);                                                                         \
    }
#define REFERENCES fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences
#define ABSENT_TYPE(name, ...)                                                                                        \
    fmi3Status name(REFERENCES, __VA_ARGS__)                                                                          \
    {                                                                                                                 \
        return absent_type(instance, nValueReferences, #name);                                                        \
    }

ABSENT_TYPE(fmi3GetFloat32, fmi3Float32 values[], size_t nValues)
ABSENT_TYPE(fmi3GetInt8, fmi3Int8 values[], size_t nValues)
ABSENT_TYPE(fmi3GetUInt8, fmi3UInt8 values[], size_t nValues)
ABSENT_TYPE(fmi3GetInt16, fmi3Int16 values[], size_t nValues)
ABSENT_TYPE(fmi3GetUInt16, fmi3UInt16 values[], size_t nValues)
ABSENT_TYPE(fmi3GetUInt32, fmi3UInt32 values[], size_t nValues)
ABSENT_TYPE(fmi3GetInt64, fmi3Int64 values[], size_t nValues)
ABSENT_TYPE(fmi3GetUInt64, fmi3UInt64 values[], size_t nValues)
ABSENT_TYPE(fmi3GetBinary, size_t valueSizes[], fmi3Binary values[], size_t nValues)
ABSENT_TYPE(fmi3GetClock, fmi3Clock values[])
ABSENT_TYPE(fmi3SetFloat32, const fmi3Float32 values[], size_t nValues)
ABSENT_TYPE(fmi3SetInt8, const fmi3Int8 values[], size_t nValues)
ABSENT_TYPE(fmi3SetUInt8, const fmi3UInt8 values[], size_t nValues)
ABSENT_TYPE(fmi3SetInt16, const fmi3Int16 values[], size_t nValues)
ABSENT_TYPE(fmi3SetUInt16, const fmi3UInt16 values[], size_t nValues)
ABSENT_TYPE(fmi3SetUInt32, const fmi3UInt32 values[], size_t nValues)
ABSENT_TYPE(fmi3SetInt64, const fmi3Int64 values[], size_t nValues)
ABSENT_TYPE(fmi3SetUInt64, const fmi3UInt64 values[], size_t nValues)
ABSENT_TYPE(fmi3SetBinary, const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
ABSENT_TYPE(fmi3SetClock, const fmi3Clock values[])

#define CLOCK "clock"
ABSENT(CLOCK, fmi3GetIntervalDecimal, (REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]))
ABSENT(CLOCK, fmi3GetIntervalFraction,
       (REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]))
ABSENT(CLOCK, fmi3GetShiftDecimal, (REFERENCES, fmi3Float64 shifts[]))
ABSENT(CLOCK, fmi3GetShiftFraction, (REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[]))
ABSENT(CLOCK, fmi3SetIntervalDecimal, (REFERENCES, const fmi3Float64 intervals[]))
ABSENT(CLOCK, fmi3SetIntervalFraction, (REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
ABSENT(CLOCK, fmi3SetShiftDecimal, (REFERENCES, const fmi3Float64 shifts[]))
ABSENT(CLOCK, fmi3SetShiftFraction, (REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
ABSENT(CLOCK, fmi3ActivateModelPartition,
       (fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime))

/* Those of model exchange are in exchange3.c where they are. */
#if MODEL_EXCHANGE
#define KINDS "an FMU for co-simulation and model exchange"
#define EVENTS "event mode in co-simulation"
#define EVALUATION "evaluation of discrete states apart from their update"
#else
#define KINDS "a co-simulation FMU"
#define EVENTS "event mode"
#define EVALUATION EVENTS
ABSENT(EVENTS, fmi3EnterEventMode, (fmi3Instance instance))
#endif
ABSENT(EVENTS, fmi3EnterStepMode, (fmi3Instance instance))
ABSENT(EVALUATION, fmi3EvaluateDiscreteStates, (fmi3Instance instance))
#if !MODEL_EXCHANGE
ABSENT(EVENTS, fmi3UpdateDiscreteStates,
       (fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
        fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
        fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime))
#endif

#define STRUCTURE "structural parameter: its sizes are those that it was built with"
ABSENT(STRUCTURE, fmi3EnterConfigurationMode, (fmi3Instance instance))
ABSENT(STRUCTURE, fmi3ExitConfigurationMode, (fmi3Instance instance))

ABSENT("derivatives of outputs over time", fmi3GetOutputDerivatives,
       (REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues))
ABSENT("adjoint derivatives", fmi3GetAdjointDerivative,
       (fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns, const fmi3ValueReference knowns[],
        size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity))

#define DEPENDENCIES "dependencies of elements: its description has those of variables"
ABSENT(DEPENDENCIES, fmi3GetNumberOfVariableDependencies,
       (fmi3Instance instance, fmi3ValueReference valueReference, size_t *nDependencies))
ABSENT(DEPENDENCIES, fmi3GetVariableDependencies,
       (fmi3Instance instance, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
        fmi3ValueReference independents[], size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
        size_t nDependencies))

/* --------------------------------------------------------------------------------------------------- model exchange */

#if !MODEL_EXCHANGE
fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                          fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage)
{
    const Listener listener = {logMessage, instanceEnvironment};
    return refuse_instance(listener, instanceName, MODEL_NAME ": this is a co-simulation FMU");
}

#define INTEGRATOR "model exchange"
ABSENT(INTEGRATOR, fmi3EnterContinuousTimeMode, (fmi3Instance instance))
ABSENT(INTEGRATOR, fmi3CompletedIntegratorStep,
       (fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *enterEventMode,
        fmi3Boolean *terminateSimulation))
ABSENT(INTEGRATOR, fmi3SetTime, (fmi3Instance instance, fmi3Float64 time))
ABSENT(INTEGRATOR, fmi3SetContinuousStates,
       (fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates))
ABSENT(INTEGRATOR, fmi3GetContinuousStateDerivatives,
       (fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates))
ABSENT(INTEGRATOR, fmi3GetEventIndicators,
       (fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators))
ABSENT(INTEGRATOR, fmi3GetContinuousStates,
       (fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates))
ABSENT(INTEGRATOR, fmi3GetNominalsOfContinuousStates,
       (fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates))
ABSENT(INTEGRATOR, fmi3GetNumberOfEventIndicators, (fmi3Instance instance, size_t *nEventIndicators))
ABSENT(INTEGRATOR, fmi3GetNumberOfContinuousStates, (fmi3Instance instance, size_t *nContinuousStates))
#endif

/* ----------------------------------------------------------------------------------------------- scheduled execution */

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    const Listener listener = {logMessage, instanceEnvironment};
    return refuse_instance(listener, instanceName, MODEL_NAME ": this is " KINDS);
}

#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif
