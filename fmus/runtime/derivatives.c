/* The FMI 2.0 function for directional derivatives: of real outputs and rates, and in initialization mode of what the
   initial equations compute. */

/* Where a real unknown stands among the results of the equations: outputs first, then rates; -1 if it is neither. */
static int unknown_place(fmi2ValueReference reference)
{
    int place = (int)reference - FIRST_OUTPUT;
    if (place >= 0 && place < N_OUTPUTS && model_variables[reference].type == TYPE_REAL) {
        return place;
    }
    return is_rate(reference, TYPE_REAL) ? (int)(N_OUTPUTS + (reference - N_VARIABLES)) : -1;
}

/* A state or memory that is shown as an output depends on itself alone. */
static bool is_kept(fmi2ValueReference reference)
{
    int state = (int)reference - FIRST_STATE, memory = (int)reference - FIRST_MEMORY;
    bool kept = (state >= 0 && state < N_STATES) || (memory >= 0 && memory < N_MEMORY);
    return kept && model_variables[reference].type == TYPE_REAL;
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

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[])
{
    Instance *s = enter(c, READABLE, "fmi2GetDirectionalDerivative");
    if (s == NULL) {
        return fmi2Error;
    }
    if ((nUnknown > 0 && (vUnknown_ref == NULL || dvUnknown == NULL)) ||
        (nKnown > 0 && (vKnown_ref == NULL || dvKnown == NULL))) {
        return fail(s, "fmi2GetDirectionalDerivative: NULL for an array");
    }
    if (refresh(s) != fmi2OK) {
        return fmi2Error;
    }
    memset(s->direction, 0, sizeof s->direction);
    for (size_t k = 0; k < nKnown; k++) {
        const Variable *known = find(s, vKnown_ref[k], TYPE_REAL, "fmi2GetDirectionalDerivative");
        if (known == NULL) {
            return fmi2Error;
        }
        if (known->role == ROLE_OUTPUT || (known->role == ROLE_KEPT && s->phase == PHASE_INITIALIZATION)) {
            return fail(s, "fmi2GetDirectionalDerivative: %s is computed; it is no known", known->name);
        }
        s->direction[vKnown_ref[k]] = dvKnown[k];
    }
    complete_direction(s);
#if N_OUTPUTS + N_STATES > 0
    const double clock[2] = {s->time, s->step};
    MODEL_DIRECTIONAL(clock, s->values, s->direction, s->scratch);
#endif
    for (size_t k = 0; k < nUnknown; k++) {
        int place = unknown_place(vUnknown_ref[k]);
        if (place >= 0) {
            dvUnknown[k] = s->scratch[place];
        } else if (is_kept(vUnknown_ref[k])) {
            dvUnknown[k] = s->direction[vUnknown_ref[k]];
        } else {
            return fail(s, "fmi2GetDirectionalDerivative: value reference %u is neither a real output nor a rate",
                        vUnknown_ref[k]);
        }
    }
    return fmi2OK;
}
