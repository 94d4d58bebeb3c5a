/* The floor of benchmarks/iterations.py for algebraic loops: one step of each FMU of a ring, and its loop solved by the same
   method (roots.c of the kernel) with the FMUs' own directional derivatives; no status looked at, one memcpy to record. */

#include "../orchestrator/master/native/algebraic/roots.c"

typedef struct {
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*step)(void *, double, double, int);
    int (*get)(void *, const unsigned *, size_t, double *);
    int (*derive)(void *, const unsigned *, size_t, const unsigned *, size_t, const double *, double *);
} Functions;

typedef struct {
    void **fmus;
    const Functions *call;
    unsigned u, y;
    size_t count, evaluations;
    double *reached;
} Ring;

static size_t before(const Ring *ring, size_t i)
{
    return i ? i - 1 : ring->count - 1;
}

static int evaluate(void *context, const double *values, double *mismatch)
{
    Ring *ring = context;
    ring->evaluations++;
    for (size_t i = 0; i < ring->count; i++) {
        ring->call->set(ring->fmus[i], &ring->u, 1, &values[before(ring, i)]);
    }
    for (size_t i = 0; i < ring->count; i++) {
        ring->call->get(ring->fmus[i], &ring->y, 1, &ring->reached[i]);
        mismatch[i] = ring->reached[i] - values[i];
    }
    return 1;
}

static int derive(void *context, const double *values, double *slopes)
{
    Ring *ring = context;
    double one = 1.0, found;
    (void)values;
    for (size_t k = 0; k < ring->count * ring->count; k++) {
        slopes[k] = k % (ring->count + 1) == 0 ? -1.0 : 0.0;
    }
    for (size_t i = 0; i < ring->count; i++) {
        ring->call->derive(ring->fmus[i], &ring->y, 1, &ring->u, 1, &one, &found);
        slopes[i * ring->count + before(ring, i)] += found;
    }
    return 1;
}

size_t room_of_ring(size_t count)
{
    return room_of_root(count) + 2 * count;
}

size_t solve_ring(void **fmus, const Functions *call, unsigned u, unsigned y, size_t count, size_t first, size_t steps, double h,
                  double *values, double *room, double *rows)
{
    Ring ring = {fmus, call, u, y, count, 0, room};
    Equations of = {&ring, count, evaluate, derive, room + 2 * count};
    double *mismatch = room + count, left;
    for (size_t k = 0; k < steps; k++) {
        for (size_t i = 0; i < count; i++) {
            call->set(fmus[i], &u, 1, &values[before(&ring, i)]);
            call->step(fmus[i], (double)(first + k) * h, h, 1);
            call->get(fmus[i], &y, 1, &values[i]);
        }
        int is_shown = 1;
        evaluate(&ring, values, mismatch);
        if (relative(mismatch, ring.reached, count) > settled) {
            find_root(&of, values, mismatch, &left, &is_shown);
            if (!is_shown) {
                evaluate(&ring, values, mismatch);
            }
        }
        memcpy(values, ring.reached, count * sizeof(double));
        memcpy(rows + k * count, values, count * sizeof(double));
    }
    return ring.evaluations;
}
