/* Directional derivatives: of real outputs and rates, and in initialization mode of what the initial equations compute. */

/* Where a real unknown stands among the results of the equations: outputs first, then rates; -1 if it is neither. */
static int unknown_place(Reference reference)
{
    int place = (int)reference - FIRST_OUTPUT;
    if (place >= 0 && place < N_OUTPUTS && model_variables[reference].type == TYPE_REAL && elements(reference) > 0) {
        return place;
    }
    return is_rate(reference, TYPE_REAL) ? (int)(N_OUTPUTS + (reference - N_VARIABLES)) : -1;
}

/* A state or memory that is shown as an output depends on itself alone. */
static bool is_kept(Reference reference)
{
    int state = (int)reference - FIRST_STATE, memory = (int)reference - FIRST_MEMORY;
    bool kept = (state >= 0 && state < N_STATES) || (memory >= 0 && memory < N_MEMORY);
    return kept && model_variables[reference].type == TYPE_REAL && elements(reference) > 0;
}

/* The direction at the present values. In initialization mode states and memory move with their starts, and one that is
   computed with what it follows from: that is found where it was computed, at the values before. */
static void complete_direction(Instance *s)
{
    if (s->phase == PHASE_INITIALIZATION) {
        take_starts(s->direction);
#if N_INITIAL > 0
        const double clock[2] = {s->time, s->step};
        double computed[N_INITIAL];
        for (int k = 0; k < N_INITIAL; k++) {
            computed[k] = s->values[model_initial_targets[k]];
        }
        forget_computed_starts(s);
        MODEL_INITIAL_DIRECTIONAL(clock, s->values, s->direction, s->scratch);
        for (int k = 0; k < N_INITIAL; k++) {
            s->direction[model_initial_targets[k]] = s->scratch[k];
            s->values[model_initial_targets[k]] = computed[k];
        }
#endif
    }
}

/* The direction of the knowns into the instance. */
static Status take_direction(Instance *s, const Reference knowns[], size_t n_knowns, const double seed[], size_t n_seed,
                             const char *call)
{
    size_t used = 0;
    memset(s->direction, 0, sizeof s->direction);
    for (size_t k = 0; k < n_knowns; k++) {
        const Variable *known = find(s, knowns[k], TYPE_REAL, call);
        if (known == NULL) {
            return STATUS_ERROR;
        }
        if (known->role == ROLE_OUTPUT || (known->role == ROLE_KEPT && s->phase == PHASE_INITIALIZATION)) {
            return fail(s, "%s: %s is computed; it is no known", call, known->name);
        }
        if (HAS_ARRAYS && elements(knowns[k]) > n_seed - used) {
            return miscounted(s, n_seed, call);
        }
        for (size_t n = 0; n < elements(knowns[k]); n++) {
            s->direction[knowns[k] + n] = seed[used++];
        }
    }
    return HAS_ARRAYS && used != n_seed ? miscounted(s, n_seed, call) : STATUS_OK;
}

#if N_OUTPUTS + N_STATES > 0
/* How outputs and rates move along the direction, into the scratch space. */
static void move_results(Instance *s)
{
#if MODEL_EXCHANGE
    if (s->exchanges && s->phase != PHASE_INITIALIZATION) {
        move_frozen_results(s);
        return;
    }
#endif
    const double clock[2] = {s->time, s->step};
    MODEL_DIRECTIONAL(clock, s->values, s->direction, s->scratch);
}
#endif

/* What the unknowns follow from, up to date. A solver is told of a rate without a value, and of no output it does not ask
   for. */
static Status refresh_unknowns(Instance *s, const Reference unknowns[], size_t count)
{
#if MODEL_EXCHANGE
    if (s->exchanges) {
        bool outputs = false, rated = false;
        for (size_t k = 0; k < count; k++) {
            int place = unknown_place(unknowns[k]);
            rated = rated || place >= N_OUTPUTS;
            outputs = outputs || (place >= 0 && place < N_OUTPUTS);
        }
        Status status = outputs ? refresh(s) : refresh_all_but_outputs(s);
        return status == STATUS_OK && rated && rates(s) != STATUS_OK ? STATUS_DISCARD : status;
    }
#else
    (void)unknowns;
    (void)count;
#endif
    return refresh(s);
}

/* A solver is told of a derivative without a value as of a rate. */
static Status check_sensitivity(Instance *s, const double sensitivity[], size_t count, const char *call)
{
#if MODEL_EXCHANGE
    for (size_t k = 0; k < count && s->exchanges; k++) {
        if (!isfinite(sensitivity[k])) {
            fail(s, "%s: derivative %lu is %g at t = %.17g s", call, (unsigned long)k + 1, sensitivity[k], s->time);
            return STATUS_DISCARD;
        }
    }
#else
    (void)s;
    (void)sensitivity;
    (void)count;
    (void)call;
#endif
    return STATUS_OK;
}

/* How the unknowns move when the knowns move along the seed. */
static Status directional_derivative(void *c, const Reference unknowns[], size_t n_unknowns, const Reference knowns[],
                                     size_t n_knowns, const double seed[], size_t n_seed, double sensitivity[],
                                     size_t n_sensitivity, const char *call)
{
    Instance *s = enter(c, READABLE, call);
    size_t used = 0;
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if ((n_unknowns > 0 && (unknowns == NULL || sensitivity == NULL)) ||
        (n_knowns > 0 && (knowns == NULL || seed == NULL))) {
        return fail(s, "%s: NULL for an array", call);
    }
    Status status = refresh_unknowns(s, unknowns, n_unknowns);
    if (status != STATUS_OK) {
        return status;
    }
    if (take_direction(s, knowns, n_knowns, seed, n_seed, call) != STATUS_OK) {
        return STATUS_ERROR;
    }
    complete_direction(s);
#if N_OUTPUTS + N_STATES > 0
    move_results(s);
#endif
    for (size_t k = 0; k < n_unknowns; k++) {
        int place = unknown_place(unknowns[k]);
        if (place < 0 && !is_kept(unknowns[k])) {
            return fail(s, "%s: value reference %u is neither a real output nor a rate", call, unknowns[k]);
        }
        const double *from = place < 0 ? s->direction + unknowns[k] : s->scratch + place;
        size_t count = elements(place < N_OUTPUTS ? unknowns[k] : (Reference)(FIRST_STATE + (place - N_OUTPUTS)));
        if (HAS_ARRAYS && count > n_sensitivity - used) {
            return miscounted(s, n_sensitivity, call);
        }
        for (size_t n = 0; n < count; n++) {
            sensitivity[used++] = from[n];
        }
    }
    if (HAS_ARRAYS && used != n_sensitivity) {
        return miscounted(s, n_sensitivity, call);
    }
    return check_sensitivity(s, sensitivity, used, call);
}
