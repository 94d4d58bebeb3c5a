/* How the real inputs move within a communication step: as the polynomials of time whose derivatives the importer gave,

       u(t) = u0 + u1 (t - t0) + u2 / 2 (t - t0)^2 + u3 / 6 (t - t0)^3,

   with the values u0 that were set and t0 the beginning of the step. Derivatives serve one step. After it an input has
   the value that it has reached, to which the outputs belong, and is held there until it is set or given derivatives. */

/* Horner's rule; how far a polynomial with these derivatives goes in `elapsed` seconds. */
static double rise(const double *derivatives, double elapsed)
{
    double sum = 0.0;
    for (int order = MAX_ORDER; order > 0; order--) {
        sum = (derivatives[order - 1] + sum) * (elapsed / (double)order);
    }
    return sum;
}

/* Note where the inputs start, and that none leaves the range of numbers on its way. */
static Status start_inputs(Instance *s, double length)
{
    if (!s->moving) {
        return STATUS_OK;
    }
    for (int n = 0; n < N_REAL_INPUTS; n++) {
        double bounds[MAX_ORDER];
        for (int k = 0; k < MAX_ORDER; k++) {
            bounds[k] = fabs(s->input_derivatives[n][k]);
        }
        s->input_starts[n] = s->values[model_real_inputs[n]];
        if (!isfinite(fabs(s->input_starts[n]) + rise(bounds, length))) {
            return fail(s, "the derivatives given for %s take it beyond all numbers in a step of %g s",
                        model_variables[model_real_inputs[n]].name, length);
        }
    }
    return STATUS_OK;
}

/* The inputs that move as they are `elapsed` seconds after the beginning of the communication step. */
static void move_inputs(Instance *s, double elapsed)
{
    for (int n = 0; n < N_REAL_INPUTS && s->moving; n++) {
        s->values[model_real_inputs[n]] = s->input_starts[n] + rise(s->input_derivatives[n], elapsed);
    }
}

/* Hold the inputs where they are. */
static void stop_inputs(Instance *s)
{
    if (s->moving) {
        memset(s->input_derivatives, 0, sizeof s->input_derivatives);
        s->moving = false;
    }
}
