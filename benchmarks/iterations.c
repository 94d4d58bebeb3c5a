/* The floor of benchmarks/iterations.py: Gauss-Seidel sweeps over a ring from saved states, repeated with Aitken's factor
   until all values agree with those of the sweep before; no status looked at, one memcpy to record. */

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

size_t iterate(void **fmus, const Functions *call, unsigned u, unsigned x, size_t count, size_t first, size_t steps, double h,
               double tolerance, double *values, double *guess, void **states, double *rows)
{
    size_t sweeps = 0;
    for (size_t k = 0; k < steps; k++) {
        double factor = 1.0, before = 0.0;
        for (size_t i = 0; i < count; i++) {
            states[i] = NULL;
            call->save(fmus[i], &states[i]);
        }
        for (int n = 0, agrees = 0; !agrees; n++) {
            for (size_t i = 0; n > 0 && i < count; i++) {
                call->restore(fmus[i], states[i]);
            }
            memcpy(guess, values, count * sizeof(double));
            for (size_t i = 0; i < count; i++) {
                call->set(fmus[i], &u, 1, &values[i ? i - 1 : count - 1]);
                call->step(fmus[i], (double)(first + k) * h, h, 0);
                call->get(fmus[i], &x, 1, &values[i]);
            }
            sweeps++;
            agrees = 1;
            for (size_t i = 0; i < count; i++) {
                agrees &= fabs(values[i] - guess[i]) <= tolerance * (1.0 + fmax(fabs(values[i]), fabs(guess[i])));
            }
            if (!agrees) {
                double residual = values[count - 1] - guess[count - 1], change = residual - before;
                factor *= n > 0 && change != 0.0 ? -before / change : 1.0;
                values[count - 1] = guess[count - 1] + factor * residual;
                before = residual;
            }
        }
        for (size_t i = 0; i < count; i++) {
            call->forget(fmus[i], &states[i]);
        }
        memcpy(rows + k * count, values, count * sizeof(double));
    }
    return sweeps;
}
