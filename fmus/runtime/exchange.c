/* Model exchange: somebody else's solver integrates. Between events the equations are smooth: every choice in them is a
   mode that stays as it is (fmus/native/relations.py), so that a solver which tries a step beyond an event sees the same
   motion go on. An event indicator is positive while a comparison holds; it passes zero a hair later than the comparison
   changes, so that it is never zero when integration begins again. Samples are taken when they are due, at time events.
   A state that has a standstill and reaches it stands there exactly, and sets off with a sign and no size. */

#if MODEL_EXCHANGE
/* How far, of the size of what is compared, a comparison may be passed before it is told; for a time event, how far from
   it an importer may come that sums up or multiplies times. */
static const double HYSTERESIS = 1e-12;

#if IS_SAMPLED
/* How far, of a period, an event may come before the sample that it is for. */
static const double NEAR_EVENT = 1e-6;

static bool sample_is_due(const Instance *s)
{
    return s->time >= sample_due(s, s->taken) - NEAR_EVENT * s->values[SAMPLE_TIME];
}
#endif

/* ------------------------------------------------------------------------------------------------------------ modes */

#if N_MODES > 0
static void relate(Instance *s)
{
    const double clock[2] = {s->time, s->step};
    MODEL_RELATIONS(clock, s->values, s->modes, s->relations);
}

/* The time that comparisons with it see. */
static double time_seen(const Instance *s)
{
    return s->time + HYSTERESIS * (1.0 + fabs(s->time));
}

/* What a mode is at the present values. */
static double present_mode(const Instance *s, int k)
{
    double first = s->relations[2 * k], second = s->relations[2 * k + 1];
    switch (model_modes[k]) {
    case MODE_LESS: return first > 0.0 ? 1.0 : 0.0;
    case MODE_NOT_ABOVE: return first >= 0.0 ? 1.0 : 0.0;
    case MODE_BEFORE: return time_seen(s) < first ? 1.0 : 0.0;
    case MODE_AFTER: return time_seen(s) >= first ? 1.0 : 0.0;
    default: return second; /* the place of a piece */
    }
}
#endif

/* Bring the modes up to date. What is compared may depend on other modes, which were found before it. */
static void settle(Instance *s)
{
#if N_MODES > 0
    bool changed = true;
    for (int pass = 0; pass <= N_MODES && changed; pass++) {
        changed = false;
        relate(s);
        for (int k = 0; k < N_MODES; k++) {
            double mode = present_mode(s, k);
            changed = changed || mode != s->modes[k];
            s->modes[k] = mode;
        }
    }
#else
    (void)s;
#endif
}

#if N_MODES > 0
static bool all_finite(const double *numbers, int count)
{
    bool finite = true;
    for (int k = 0; k < count; k++) {
        finite = finite && isfinite(numbers[k]);
    }
    return finite;
}
#endif

#if N_STATES > 0
/* Rates in the present modes. Where they have no value, because a solver looks far beyond an event, those as they stand. */
static void frozen_rates(Instance *s, double *result)
{
#if N_MODES > 0
    const double clock[2] = {s->time, s->step};
    MODEL_FROZEN_DERIVATIVES(clock, s->values, s->modes, result);
    if (all_finite(result, N_STATES)) {
        return;
    }
#endif
    call_equations(s, MODEL_DERIVATIVES, result);
}
#endif

/* What is looked at in the course of an event: modes, and where a sample is due its outputs and random numbers. */
static Status look(Instance *s)
{
#if IS_SAMPLED
    if (sample_is_due(s) && evaluate(s, 0.0, false) != STATUS_OK) {
        return STATUS_ERROR;
    }
#endif
    settle(s);
    return STATUS_OK;
}

/* Outputs in the present modes; those that are held are the last sample's. */
static Status evaluate_frozen(Instance *s)
{
    if (s->regime == REGIME_EVENT && look(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
#if IS_SAMPLED
    if (s->regime == REGIME_EVENT && sample_is_due(s)) {
        return STATUS_OK;
    }
#endif
#if N_OUTPUTS > 0
#if N_MODES > 0
    const double clock[2] = {s->time, s->step};
    MODEL_FROZEN_OUTPUTS(clock, s->values, s->modes, s->scratch);
    if (!all_finite(s->scratch, N_OUTPUTS)) {
        call_equations(s, MODEL_OUTPUTS, s->scratch);
    }
#else
    call_equations(s, MODEL_OUTPUTS, s->scratch);
#endif
#if HAS_HELD
    for (int k = 0; k < N_OUTPUTS; k++) {
        s->scratch[k] = model_held[k] ? s->held[k] : s->scratch[k];
    }
#endif
    if (check_results(s, "outputs", FIRST_OUTPUT, N_OUTPUTS, s->scratch) != STATUS_OK) {
        return STATUS_ERROR;
    }
    memcpy(s->values + FIRST_OUTPUT, s->scratch, N_OUTPUTS * sizeof(double));
#endif
    return STATUS_OK;
}

#if N_OUTPUTS + N_STATES > 0
/* How outputs and rates move along the direction, into the scratch space: each as its value is found, in the present modes,
   as it stands, or held and therefore not at all. */
static void move_frozen_results(Instance *s)
{
    const double clock[2] = {s->time, s->step};
    bool samples = false;
#if IS_SAMPLED
    samples = s->regime == REGIME_EVENT && sample_is_due(s);
#endif
#if N_MODES > 0
    bool outputs = !samples, rates = true;
#if N_OUTPUTS > 0
    MODEL_FROZEN_OUTPUTS(clock, s->values, s->modes, s->looked);
    outputs = outputs && all_finite(s->looked, N_OUTPUTS);
#endif
#if N_STATES > 0
    MODEL_FROZEN_DERIVATIVES(clock, s->values, s->modes, s->looked);
    rates = all_finite(s->looked, N_STATES);
#endif
    MODEL_FROZEN_DIRECTIONAL(clock, s->values, s->modes, s->direction, s->scratch);
    if (!outputs || !rates) {
        MODEL_DIRECTIONAL(clock, s->values, s->direction, s->looked);
        for (int k = 0; k < N_OUTPUTS + N_STATES; k++) {
            bool kept = k < N_OUTPUTS ? outputs : rates;
            s->scratch[k] = kept ? s->scratch[k] : s->looked[k];
        }
    }
#else
    MODEL_DIRECTIONAL(clock, s->values, s->direction, s->scratch);
#endif
#if HAS_HELD
    for (int k = 0; k < N_OUTPUTS; k++) {
        s->scratch[k] = model_held[k] && !samples ? 0.0 : s->scratch[k];
    }
#else
    (void)samples;
#endif
}
#endif

/* ----------------------------------------------------------------------------------------------------------- events */

#if N_STANDSTILL > 0
static int side_of(double x)
{
    return (x > 0.0) - (x < 0.0);
}

/* On which sides states are. */
static void find_sides(Instance *s)
{
    for (int k = 0; k < N_STANDSTILL; k++) {
        s->sides[k] = side_of(s->values[FIRST_STATE + model_standstill[k]]);
    }
}

/* Whether a state sets off that stands. */
static bool set_off(Instance *s)
{
    bool any = false;
    frozen_rates(s, s->slopes[0]);
    for (int k = 0; k < N_STANDSTILL; k++) {
        double rate = s->slopes[0][model_standstill[k]];
        if (s->sides[k] == 0 && rate != 0.0) {
            s->sides[k] = side_of(rate);
            s->values[FIRST_STATE + model_standstill[k]] = s->sides[k] * ALMOST_ZERO;
            any = true;
        }
    }
    return any;
}

/* States that have passed their standstill stand. */
static void stop(Instance *s)
{
    for (int k = 0; k < N_STANDSTILL; k++) {
        double *x = &s->values[FIRST_STATE + model_standstill[k]];
        if (s->sides[k] != 0 && side_of(*x) != s->sides[k]) {
            *x = 0.0;
        }
    }
    find_sides(s);
}
#endif

/* Begin with the modes and sides of the initial state. */
static void begin_exchange(Instance *s)
{
    s->regime = REGIME_EVENT;
#if IS_SAMPLED
    if (!(s->values[SAMPLE_TIME] > 0.0)) {
        s->values[SAMPLE_TIME] = MODEL_STEP; /* there are no communication steps */
    }
#endif
#if N_STANDSTILL > 0
    find_sides(s);
#endif
    settle(s);
}

#if IS_SAMPLED
/* The samples that are due, each at its own time. */
static Status take_samples(Instance *s)
{
    double time = s->time, period = s->values[SAMPLE_TIME];
    /* Where they are nearer to one another than times are told apart, the time itself is a number of them. */
    double overdue = (time - sample_due(s, s->taken) + DBL_EPSILON * fabs(time)) / period;
    if (!(overdue < 2147483647.0)) {
        return fail(s, "sample_time = %g s is too short for an event at t = %.17g s", period, time);
    }
    for (; sample_is_due(s); s->taken += 1.0) {
        s->time = sample_due(s, s->taken);
        if (sample(s, period, 0.0) != STATUS_OK) {
            return STATUS_ERROR;
        }
        s->time = time;
    }
#if N_STANDSTILL > 0
    find_sides(s);
#endif
    return STATUS_OK;
}
#endif

/* When something happens next that depends on time alone; infinity if nothing does. */
static double next_time_event(const Instance *s)
{
    double next = INFINITY;
#if IS_SAMPLED
    next = sample_due(s, s->taken);
#endif
#if N_MODES > 0
    for (int k = 0; k < N_MODES; k++) {
        bool timed = model_modes[k] == MODE_BEFORE || model_modes[k] == MODE_AFTER || model_modes[k] == MODE_TIME_PIECE;
        double when = s->relations[2 * k];
        next = timed && when > time_seen(s) && when < next ? when : next;
    }
#endif
    for (int n = 0; n < N_NOISES; n++) {
        double hold = s->values[model_noises[n].hold], when = (floor(s->time / hold + 1e-6) + 1.0) * hold;
        next = when < next ? when : next;
    }
    return next < 1e300 ? next : INFINITY;
}

/* What an event changes; whether states are among it, and when the next one is known to be. */
static Status update_discrete(Instance *s, bool *states_changed, double *next)
{
    memcpy(s->states, s->values + FIRST_STATE, N_STATES * sizeof(double));
#if N_STANDSTILL > 0
    stop(s); /* before a sample, which as in co-simulation sees nothing beyond a standstill */
#endif
#if IS_SAMPLED
    if (take_samples(s) != STATUS_OK || draw(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
#endif
    settle(s);
#if N_STANDSTILL > 0
    while (set_off(s)) {
        settle(s);
    }
#endif
    int changed = 0;
    for (int k = 0; k < N_STATES; k++) {
        changed += s->values[FIRST_STATE + k] != s->states[k];
    }
    *states_changed = changed > 0;
    s->fresh = false;
    *next = next_time_event(s);
    return STATUS_OK;
}

/* The event indicators: of modes that have one, then of standstills; discarded where one has no value. */
static Status find_indicators(Instance *s, double *result)
{
    int n = 0;
#if N_STANDSTILL > 0
    if (s->phase == PHASE_INITIALIZATION) {
        find_sides(s);
    }
#endif
    if (s->regime == REGIME_EVENT) {
        settle(s);
    }
#if N_MODES > 0
    relate(s);
    for (int k = 0; k < N_MODES; k++) {
        if (model_indicated[k]) {
            double first = s->relations[2 * k], size = 1.0 + fabs(s->relations[2 * k + 1]);
            first = isinf(first) ? copysign(1.0, first) : first / size; /* nothing comes near to infinity */
            result[n++] = first + (model_modes[k] == MODE_PIECE || s->modes[k] != 0.0 ? HYSTERESIS : -HYSTERESIS);
        }
    }
#endif
#if N_STANDSTILL > 0
    for (int k = 0; k < N_STANDSTILL; k++) {
        double x = s->values[FIRST_STATE + model_standstill[k]];
        result[n++] = s->sides[k] != 0 ? x : HYSTERESIS - fabs(x);
    }
#endif
    for (int k = 0; k < n; k++) {
        if (!isfinite(result[k])) {
            fail(s, "event indicator %d is %g at t = %.17g s", k + 1, result[k], s->time);
            return STATUS_DISCARD;
        }
    }
    (void)result;
    return STATUS_OK;
}
#endif
