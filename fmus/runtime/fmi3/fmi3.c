/* The functions of FMI 3.0 for co-simulation, by those of the runtime. */

static void tell(const Listener *listener, const char *name, Status status, const char *category, const char *text)
{
    (void)name; /* the importer knows it by its environment */
    if (listener->log != NULL) {
        listener->log(listener->environment, status, category, text);
    }
}

/* ------------------------------------------------------------------------------------------------------- life cycle */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                         fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
    const Listener listener = {logMessage, instanceEnvironment};
    (void)resourcePath;
    (void)visible;
    (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables;
    (void)intermediateUpdate;
    if (eventModeUsed) {
        return refuse_instance(listener, instanceName, MODEL_NAME ": it has no event mode: its samples are its own");
    }
    return create(listener, instanceName, instantiationToken, loggingOn);
}

void fmi3FreeInstance(fmi3Instance instance)
{
    release(instance);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
    return set_logging(instance, loggingOn, nCategories, categories, "fmi3SetDebugLogging");
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    static const char call[] = "fmi3EnterInitializationMode";
    (void)toleranceDefined;
    (void)tolerance;
    Status status = set_experiment(instance, startTime, stopTimeDefined, stopTime, call);
    return status == STATUS_OK ? enter_initialization(instance, call) : status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return exit_initialization(instance, "fmi3ExitInitializationMode");
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return terminate(instance, "fmi3Terminate");
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    return reset(instance, "fmi3Reset");
}

/* --------------------------------------------------------------------------------------------------------- stepping */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    Status status = do_step(instance, currentCommunicationPoint, communicationStepSize, "fmi3DoStep");
    fmi3Boolean *const told[] = {eventHandlingNeeded, terminateSimulation, earlyReturn};
    for (int k = 0; k < 3; k++) {
        if (told[k] != NULL) {
            *told[k] = fmi3False; /* a step is whole, and nothing waits for the importer */
        }
    }
    if (lastSuccessfulTime != NULL && instance != NULL) {
        *lastSuccessfulTime = ((const Instance *)instance)->last_successful_time;
    }
    return status;
}

/* ----------------------------------------------------------------------------------------------------------- values */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    return get_numbers(instance, TYPE_REAL, valueReferences, nValueReferences, values, nValues, "fmi3GetFloat64");
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int32 values[], size_t nValues)
{
    return get_numbers(instance, TYPE_INTEGER, valueReferences, nValueReferences, values, nValues, "fmi3GetInt32");
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues)
{
    return get_numbers(instance, TYPE_BOOLEAN, valueReferences, nValueReferences, values, nValues, "fmi3GetBoolean");
}

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         fmi3String values[], size_t nValues)
{
    return get_texts(instance, valueReferences, nValueReferences, values, nValues, "fmi3GetString");
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    return set_numbers(instance, TYPE_REAL, valueReferences, nValueReferences, values, nValues, "fmi3SetFloat64");
}

fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Int32 values[], size_t nValues)
{
    return set_numbers(instance, TYPE_INTEGER, valueReferences, nValueReferences, values, nValues, "fmi3SetInt32");
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Boolean values[], size_t nValues)
{
    return set_numbers(instance, TYPE_BOOLEAN, valueReferences, nValueReferences, values, nValues, "fmi3SetBoolean");
}

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const fmi3String values[], size_t nValues)
{
    return set_texts(instance, valueReferences, nValueReferences, values, nValues, "fmi3SetString");
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    return directional_derivative(instance, unknowns, nUnknowns, knowns, nKnowns, seed, nSeed, sensitivity, nSensitivity,
                                  "fmi3GetDirectionalDerivative");
}

/* ----------------------------------------------------------------------------------------------------------- states */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    return get_state(instance, FMUState, "fmi3GetFMUState");
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    return set_state(instance, FMUState, "fmi3SetFMUState");
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    return free_state(instance, FMUState, "fmi3FreeFMUState");
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    return size_of_state(instance, FMUState, size, "fmi3SerializedFMUStateSize");
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    return serialize(instance, FMUState, serializedState, size, "fmi3SerializeFMUState");
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    return deserialize(instance, serializedState, size, FMUState, "fmi3DeserializeFMUState");
}
