/* Integration of the states: classical Runge-Kutta in sub-steps, and onto a standstill. components/methods.py says it in
   Python, in the same order of operations. */

#if N_STATES > 0
/* How finely a standstill is located, and what stands for just before it: it has a sign, and no size. */
enum { HALVINGS = 40 };
static const double ALMOST_ZERO = 1e-300;

static inline void slope(Instance *s, bool moving, double time, double elapsed, double *result)
{
    s->time = time;
    if (moving) {
        move_inputs(s, elapsed);
    }
    call_equations(s, MODEL_DERIVATIVES, result);
}

/* Whether a state that does not stand reaches or passes zero. */
static inline bool passes(double start, double end)
{
    return (start > 0.0 && end <= 0.0) || (start < 0.0 && end >= 0.0);
}

/* The states at a stage: not beyond a standstill but just before it, where the rates are those of the same motion. */
static inline void stay_near(const double *start, double *stage)
{
    for (int k = 0; k < N_STANDSTILL; k++) {
        int n = model_standstill[k];
        if (passes(start[n], stage[n])) {
            stage[n] = start[n] > 0.0 ? ALMOST_ZERO : -ALMOST_ZERO;
        }
    }
}

/* Whether a state passes its standstill from `start` to `end`. */
static inline bool passing(const double *start, const double *end)
{
    bool any = false;
    for (int k = 0; k < N_STANDSTILL; k++) {
        any = any || passes(start[model_standstill[k]], end[model_standstill[k]]);
    }
    return any;
}

/* One Runge-Kutta step of length h, from the states in `start`, which are those among the values. */
ALWAYS_INLINE void runge_kutta_step(Instance *s, bool moving, double t, double u, double h)
{
    double half = 0.5 * h, sixth = h / 6.0;
    double *x = s->values + FIRST_STATE, *start = s->states;
    double *k1 = s->slopes[0], *k2 = s->slopes[1], *k3 = s->slopes[2], *k4 = s->slopes[3];
    slope(s, moving, t, u, k1);
    for (int n = 0; n < N_STATES; n++) {
        x[n] = start[n] + half * k1[n];
    }
    stay_near(start, x);
    slope(s, moving, t + half, u + half, k2);
    for (int n = 0; n < N_STATES; n++) {
        x[n] = start[n] + half * k2[n];
    }
    stay_near(start, x);
    slope(s, moving, t + half, u + half, k3);
    for (int n = 0; n < N_STATES; n++) {
        x[n] = start[n] + h * k3[n];
    }
    stay_near(start, x);
    slope(s, moving, t + h, u + h, k4);
    for (int n = 0; n < N_STATES; n++) {
        x[n] = start[n] + sixth * (((k1[n] + 2.0 * k2[n]) + 2.0 * k3[n]) + k4[n]);
    }
}

/* A step from the states in `start` once more, with a length of its own. */
NEVER_INLINE void try_step(Instance *s, double t, double u, double h)
{
    memcpy(s->values + FIRST_STATE, s->states, N_STATES * sizeof(double));
    runge_kutta_step(s, s->moving, t, u, h);
}

/* The step again from its beginning, in parts that each end where a state comes to a standstill. They are counted:
   states that keep one another moving could go on for ever. What would pass in the last part stands at its end. */
NEVER_INLINE void step_to_standstill(Instance *s, double t, double u, double h)
{
    const size_t size = N_STATES * sizeof(double);
    double *x = s->values + FIRST_STATE, *start = s->states, before[N_STATES], after[N_STATES], done = 0.0;
    for (int stops = 0;; stops++) {
        bool last = stops == 2 * N_STANDSTILL;
        double low = 0.0, high = h - done;
        try_step(s, t + done, u + done, high);
        if (!passing(start, x)) {
            return;
        }
        memcpy(before, last ? x : start, size);
        memcpy(after, x, size);
        for (int k = 0; k < HALVINGS && !last; k++) {
            double middle = 0.5 * (low + high);
            try_step(s, t + done, u + done, middle);
            bool passed = passing(start, x);
            *(passed ? &high : &low) = middle;
            memcpy(passed ? after : before, x, size);
        }
        for (int k = 0; k < N_STANDSTILL; k++) {
            int n = model_standstill[k];
            before[n] = passes(start[n], after[n]) ? 0.0 : before[n];
        }
        memcpy(x, before, size);
        if (last) {
            return;
        }
        memcpy(start, x, size);
        done = done + low;
    }
}

/* Classical Runge-Kutta in `count` sub-steps of length h, memory held. Inputs rarely move. In one copy for both cases the
   values could not stay in registers, and a step of the point-mass train took twice its time. */
ALWAYS_INLINE void runge_kutta(Instance *s, bool moving, double begin, double elapsed, double h, int count)
{
    double *x = s->values + FIRST_STATE;
    for (int part = 0; part < count; part++) {
        double t = begin + (double)part * h, u = elapsed + (double)part * h;
        memcpy(s->states, x, N_STATES * sizeof(double));
        runge_kutta_step(s, moving, t, u, h);
        if (passing(s->states, x)) {
            step_to_standstill(s, t, u, h);
        }
    }
}
#endif
