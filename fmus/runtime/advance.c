/* One communication step: a sampled block keeps its own clock, samples when a sample is due, and holds between.
   components/sampling.py says it in Python, in the same order of operations. */

#if IS_SAMPLED
/* How far, of a sample or of a communication step, whichever is shorter, a communication point may miss a sample: what a
   time that was summed up gathers in roundings. */
static const double NEAR_SAMPLE = 1e-3;

/* One sample: outputs with the old memory, then the next memory, tape row and re-initialised states. */
static Status sample(Instance *s, double period, double elapsed)
{
#if N_TAPE > 0
    if (tape_follow(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
#endif
    if (evaluate(s, elapsed, true) != STATUS_OK) {
        return STATUS_ERROR;
    }
    memcpy(s->held, s->values + FIRST_OUTPUT, N_OUTPUTS * sizeof(double));
    double *next = s->scratch, *row = next + N_MEMORY, *again = row + N_TAPE;
    s->step = period;
#if N_MEMORY + N_TAPE + N_REINITIALISED > 0
    call_equations(s, MODEL_UPDATE, next);
#endif
    if (check_results(s, "update", FIRST_MEMORY, N_MEMORY, next) != STATUS_OK) {
        return STATUS_ERROR;
    }
    for (int k = 0; k < N_TAPE; k++) {
        if (!isfinite(row[k])) {
            return fail(s, "update: column %d of the tape is %g at t = %.17g s", k + 1, row[k], s->time);
        }
    }
#if N_TAPE > 0
    tape_record(s, row);
#endif
    for (int k = 0; k < N_REINITIALISED; k++) {
        int target = model_reinitialised[k];
        if (check_results(s, "update", target, 1, again + k) != STATUS_OK) {
            return STATUS_ERROR;
        }
        s->values[target] = again[k];
    }
    memcpy(s->values + FIRST_MEMORY, next, N_MEMORY * sizeof(double));
    return STATUS_OK;
}

/* When the sample of this number is due: counted, never summed up. */
static double sample_due(const Instance *s, double number)
{
    return s->start_time + number * s->values[SAMPLE_TIME];
}

#if N_STATES > 0
/* Note what integration between two samples starts from. */
static void keep_base(Instance *s, double time)
{
    s->based = true;
    s->base_time = time;
    memcpy(s->base, s->values, sizeof s->base);
}

/* Where integration goes on. Between samples it begins anew from where it began, unless something was set since, so that
   it does not matter in how many parts it is asked for; tape and random numbers are those of the sample under way. */
static double resume(Instance *s)
{
    if (!s->based) {
        return s->reached;
    }
    s->based = false;
    memcpy(s->values + FIRST_TAPE, s->base + FIRST_TAPE, (N_VALUES - FIRST_TAPE) * sizeof(double));
    bool same = !s->moving;
    for (int n = 0; n < N_GIVEN; n++) {
        same = same && s->base[n] == s->values[n];
    }
    if (!same) {
        return s->reached;
    }
    memcpy(s->values + FIRST_STATE, s->base + FIRST_STATE, N_STATES * sizeof(double));
    return s->base_time;
}

/* The states from one time to another; from sample to sample that is the period, whatever the roundings of the two. */
static Status move_states(Instance *s, double begin, double from, double to)
{
    double length = to - from;
    if (from == sample_due(s, s->taken - 1.0) && to == sample_due(s, s->taken)) {
        length = s->values[SAMPLE_TIME];
    }
    return length > 0.0 ? integrate(s, from, from - begin, length) : STATUS_OK;
}
#endif

/* A communication step on the sample clock. */
static Status follow_clock(Instance *s, double begin, double length)
{
    double period = s->values[SAMPLE_TIME], end = begin + length;
    double near = NEAR_SAMPLE * (length < period ? length : period);
    double due = sample_due(s, s->taken);
    if (!((end - due) / period < 2147483647.0)) {
        return fail(s, "sample_time = %g s is too short for a step of %g s", period, length);
    }
#if N_STATES > 0
    double from = resume(s);
#endif
    for (; due < end - near; due = sample_due(s, s->taken)) {
        double elapsed = due > begin + near ? due - begin : 0.0;
#if N_STATES > 0
        if (move_states(s, begin, from, due) != STATUS_OK) {
            return STATUS_ERROR;
        }
        from = due;
#endif
        s->time = due;
        move_inputs(s, elapsed);
        if (sample(s, period, elapsed) != STATUS_OK) {
            return STATUS_ERROR;
        }
        s->taken += 1.0;
    }
    double reached = due <= end + near ? due : end;
#if N_STATES > 0
    bool between = reached != due, moving = s->moving;
    if (between && !moving) {
        keep_base(s, from);
    }
    if (move_states(s, begin, from, reached) != STATUS_OK) {
        return STATUS_ERROR;
    }
    reached = reached > from ? reached : from;
    if (between && moving) {
        keep_base(s, reached);
    }
#endif
    s->reached = s->time = reached;
    return STATUS_OK;
}
#endif

/* One communication step from `begin`. */
static Status advance(Instance *s, double begin, double length)
{
    s->time = begin;
    if (start_inputs(s, length) != STATUS_OK) {
        return STATUS_ERROR;
    }
#if IS_SAMPLED
    bool clocked = s->values[SAMPLE_TIME] > 0.0;
    if (clocked && follow_clock(s, begin, length) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (!clocked && sample(s, length, 0.0) != STATUS_OK) {
        return STATUS_ERROR;
    }
#else
    bool clocked = false;
#endif
    if (!clocked) {
        if (integrate(s, begin, 0.0, length) != STATUS_OK) {
            return STATUS_ERROR;
        }
        s->time = begin + length;
    }
    move_inputs(s, length);
    stop_inputs(s);
    s->fresh = false;
#if HAS_HELD
    if (refresh(s) != STATUS_OK) {
        return STATUS_ERROR;
    }
    for (int k = 0; k < N_OUTPUTS; k++) {
        if (model_held[k]) {
            s->values[FIRST_OUTPUT + k] = s->held[k];
        }
    }
#endif
    return STATUS_OK;
}
