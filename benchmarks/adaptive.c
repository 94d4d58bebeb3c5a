/* The floor of benchmarks/iterations.py for steps that vary: Gauss-Seidel sweeps over a ring, each step whole and in halves,
   and with the inputs of its end before it is accepted; no status looked at, one memcpy to record. */

#include <math.h>
#include <stddef.h>
#include <string.h>

typedef struct {
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*step)(void *, double, double, int);
    int (*get)(void *, const unsigned *, size_t, double *);
    int (*save)(void *, void **);
    int (*restore)(void *, void *);
    int (*forget)(void *, void **);
} Functions;

typedef struct {
    void **fmus, **begin, **end; /* instances; their states at the begin and the end of a step */
    const Functions *call;
    unsigned u, x;
    size_t count;
    const size_t *sequence;
    double *values;
} Ring;

static void sweep(const Ring *ring, double time, double h)
{
    for (size_t n = 0; n < ring->count; n++) {
        size_t i = ring->sequence[n];
        ring->call->set(ring->fmus[i], &ring->u, 1, &ring->values[i ? i - 1 : ring->count - 1]);
        ring->call->step(ring->fmus[i], time, h, 0);
        ring->call->get(ring->fmus[i], &ring->x, 1, &ring->values[i]);
    }
}

static void save(const Ring *ring, void **states)
{
    for (size_t i = 0; i < ring->count; i++) {
        states[i] = NULL;
        ring->call->save(ring->fmus[i], &states[i]);
    }
}

static void restore(const Ring *ring, void **states)
{
    for (size_t i = 0; i < ring->count; i++) {
        ring->call->restore(ring->fmus[i], states[i]);
    }
}

static void forget(const Ring *ring, void **states)
{
    for (size_t i = 0; i < ring->count; i++) {
        ring->call->forget(ring->fmus[i], &states[i]);
    }
}

static double error_of(const double *coarse, const double *fine, size_t count, double times, double tolerance)
{
    double worst = 0.0;
    for (size_t i = 0; i < count; i++) {
        double bound = tolerance + tolerance * fmax(fabs(fine[i]), fabs(coarse[i]));
        worst = fmax(worst, fabs(fine[i] - coarse[i]) / times / bound);
    }
    return worst;
}

/* Steps until an end is passed, of a run that goes on until its last point; how many, the sweeps counted in `sweeps`. `room` is for three times all values. */
size_t adapt(void **fmus, const Functions *call, unsigned u, unsigned x, size_t count, const size_t *sequence, double *time,
             double *wanted, double end, double last, double longest, double tolerance, double *values, void **states, double *room,
             double *rows, size_t *sweeps)
{
    Ring ring = {fmus, states, states + count, call, u, x, count, sequence, values};
    double *begin = room, *whole = room + count, *halves = room + 2 * count;
    size_t size = count * sizeof(double), steps = 0;
    while (*time < end) {
        save(&ring, ring.begin);
        memcpy(begin, values, size);
        for (;;) {
            double left = last - *time, h = left <= *wanted * (1.0 + 1e-9) ? left : left < 2.0 * *wanted ? 0.5 * left : *wanted;
            double to = h == left ? last : *time + h, middle = 0.5 * (*time + to);
            h = to - *time;
            sweep(&ring, *time, h);
            memcpy(whole, values, size);
            restore(&ring, ring.begin);
            memcpy(values, begin, size);
            sweep(&ring, *time, middle - *time);
            sweep(&ring, middle, to - middle);
            memcpy(halves, values, size);
            *sweeps += 3;
            double error = error_of(whole, halves, count, 1.0, tolerance);
            int is_kept = error <= 1.0;
            if (is_kept) {
                save(&ring, ring.end);
                restore(&ring, ring.begin);
                sweep(&ring, *time, h);
                *sweeps += 1;
                error = fmax(error, error_of(values, halves, count, 3.0, tolerance));
                restore(&ring, ring.end);
                memcpy(values, halves, size);
            }
            double factor = error > 0.0 ? fmin(5.0, fmax(0.2, 0.9 * pow(error, -0.5))) : 5.0;
            if (is_kept) {
                forget(&ring, ring.end);
            }
            if (error <= 1.0) {
                *wanted = fmin(longest, fmax(h * factor, factor >= 1.0 ? *wanted : 0.0));
                *time = to;
                break;
            }
            restore(&ring, ring.begin);
            memcpy(values, begin, size);
            *wanted = h * fmin(factor, 0.9);
        }
        forget(&ring, ring.begin);
        memcpy(rows + steps++ * count, values, size);
    }
    return steps;
}
