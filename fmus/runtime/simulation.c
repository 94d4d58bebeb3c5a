/* An instance in time: the initial state, integration, outputs. components/simulate.py says it in Python, and the order of
   every floating-point operation here is the order there: the two agree to the last bit. */

/* What a variable of this type can hold: whole numbers of 32 bits, truth values. */
static bool fits(Type type, double value)
{
    switch (type) {
    case TYPE_INTEGER: return value == rint(value) && value >= -2147483648.0 && value <= 2147483647.0;
    case TYPE_BOOLEAN: return value == 0.0 || value == 1.0;
    default: return true;
    }
}

/* Every result must be finite, and one that its variable can hold. */
static Status check_results(Instance *s, const char *method, int first, int count, const double *result)
{
    for (int k = 0; k < count; k++) {
        const Variable *variable = &model_variables[first + k];
        if (!isfinite(result[k])) {
            return fail(s, "%s: '%s' is %g at t = %.17g s; guard the arguments it comes from", method, variable->name,
                        result[k], s->time);
        }
        if (!fits(variable->type, result[k])) {
            return fail(s, "%s: '%s' is %.17g at t = %.17g s, which is no %s", method, variable->name, result[k],
                        s->time, variable->type == TYPE_INTEGER ? "32-bit integer" : "boolean");
        }
    }
    return STATUS_OK;
}

#if N_TAPE > 0
/* Whether the importer says how the time along the trip moves. */
static bool trip_time_moves(const Instance *s)
{
    const double *derivatives = s->input_derivatives[model_variables[TRIP_TIME].input];
    bool moves = false;
    for (int k = 0; k < MAX_ORDER; k++) {
        moves = moves || derivatives[k] != 0.0;
    }
    return moves;
}

/* Time along the trip: within a communication step of several samples the tape runs on; a wait stays a wait. */
static double trip_time_after(const Instance *s, double elapsed)
{
    double trip_time = s->values[TRIP_TIME];
    return waiting(s, trip_time) || trip_time_moves(s) ? trip_time : trip_time + elapsed;
}
#endif

/* All outputs into the values, `elapsed` seconds after the inputs were read; at a sample the tape is at one of its own. */
static Status evaluate(Instance *s, double elapsed, bool at_sample)
{
    if (draw(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
#if N_TAPE > 0
    if (tape_read(s, trip_time_after(s, elapsed), at_sample) != STATUS_OK) {
        return STATUS_ERROR;
    }
#else
    (void)elapsed;
    (void)at_sample;
#endif
#if N_OUTPUTS > 0
    call_equations(s, MODEL_OUTPUTS, s->scratch);
    if (check_results(s, "outputs", FIRST_OUTPUT, N_OUTPUTS, s->scratch) != STATUS_OK) {
        return STATUS_ERROR;
    }
    memcpy(s->values + FIRST_OUTPUT, s->scratch, N_OUTPUTS * sizeof(double));
#endif
    return STATUS_OK;
}

/* States and memory to their start values, or their directions to those of their start values. */
static void take_starts(double *values)
{
    for (int k = 0; k < N_STARTS; k++) {
        values[model_started[k]] = values[FIRST_START + k];
    }
}

#if N_INITIAL > 0
static void forget_computed_starts(Instance *s)
{
    for (int k = 0; k < N_INITIAL; k++) {
        s->values[model_initial_targets[k]] = model_variables[model_initial_targets[k]].start;
    }
}

static Status compute_starts(Instance *s)
{
    forget_computed_starts(s);
    call_equations(s, MODEL_INITIAL, s->scratch);
    for (int k = 0; k < N_INITIAL; k++) {
        int target = model_initial_targets[k];
        if (check_results(s, "initial", target, 1, s->scratch + k) != STATUS_OK) {
            return STATUS_ERROR;
        }
        s->values[target] = s->scratch[k];
    }
    return STATUS_OK;
}
#endif

/* Bring what follows from parameters, start values and inputs up to date with them. */
static Status prepare(Instance *s)
{
    if (s->prepared) {
        return STATUS_OK;
    }
    take_starts(s->values);
    if (draw(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
#if N_INITIAL > 0
    if (compute_starts(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
#endif
#if N_TAPE > 0
    if (tape_prepare(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
#endif
    s->prepared = true;
    return STATUS_OK;
}

/* A parameter must lie within its declared bounds. */
static Status check_bounds(Instance *s, const Variable *variable, double value)
{
    if (variable->type != TYPE_STRING && (value < variable->minimum || value > variable->maximum)) {
        return fail(s, "%s = %g is outside [%g, %g]", variable->name, value, variable->minimum, variable->maximum);
    }
    return STATUS_OK;
}

#if N_STATES > 0
/* Equal sub-steps no longer than max_step; `elapsed` is the time from the beginning of the communication step to that of
   the integration. */
static Status integrate(Instance *s, double begin, double elapsed, double length)
{
    double longest = s->values[MAX_STEP];
    double parts = longest > 0.0 && length > longest ? ceil(length / longest - 1e-9) : 1.0;
    if (!(parts < 2147483647.0)) {
        return fail(s, "max_step = %g s is too short for a step of %g s", longest, length);
    }
    int count = parts > 1.0 ? (int)parts : 1;
    double h = length / (double)count;
    if (s->moving) {
        runge_kutta(s, true, begin, elapsed, h, count);
    } else {
        runge_kutta(s, false, begin, elapsed, h, count);
    }
    return check_results(s, "derivatives", FIRST_STATE, N_STATES, s->values + FIRST_STATE);
}
#else
static Status integrate(Instance *s, double begin, double elapsed, double length)
{
    (void)s;
    (void)begin;
    (void)elapsed;
    (void)length;
    return STATUS_OK;
}
#endif

#if MODEL_EXCHANGE
static Status evaluate_frozen(Instance *s);
#endif

/* Outputs at the present values. */
static Status evaluate_now(Instance *s)
{
#if MODEL_EXCHANGE
    if (s->exchanges && s->phase != PHASE_INITIALIZATION) {
        return evaluate_frozen(s);
    }
#endif
    return evaluate(s, 0.0, false);
}

/* Outputs as the present inputs make them; after an error the values stay as they are, to be looked at. */
static Status refresh(Instance *s)
{
    if (s->phase == PHASE_ERROR) {
        return STATUS_OK;
    }
    if (s->phase == PHASE_INITIALIZATION && prepare(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (!s->fresh && evaluate_now(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
    s->fresh = true;
    return STATUS_OK;
}

/* Back to the state after instantiation. */
static void restart(Instance *s)
{
    memset(s->values, 0, sizeof s->values);
    for (int n = 0; n < N_VARIABLES; n++) {
        s->values[n] = model_variables[n].start;
        if (model_variables[n].text >= 0) {
            /* It fills what is left with zeros. */
            strncpy(s->texts[model_variables[n].text], model_texts[model_variables[n].text], MAX_TEXT - 1);
        }
    }
#if N_TAPE > 0
    memcpy(s->values + FIRST_TAPE, model_tape_start, N_TAPE * sizeof(double));
    tape_free(&s->tape);
#endif
    s->phase = PHASE_INSTANTIATED;
    s->time = s->start_time = s->last_successful_time = s->reached = 0.0;
    s->has_stop_time = s->fresh = s->prepared = s->based = false;
    s->step = s->taken = s->stop_time = s->base_time = 0.0;
    memset(s->held, 0, sizeof s->held);
#if MODEL_EXCHANGE
    s->regime = REGIME_EVENT;
    memset(s->modes, 0, sizeof s->modes);
    memset(s->sides, 0, sizeof s->sides);
#endif
    stop_inputs(s);
}
