/* The floor of benchmarks/ring.py: the loop that a master cannot beat, with no checks and one memcpy to record. */

#include <stddef.h>
#include <string.h>

void ring(void **fmus, int (*set)(void *, const unsigned *, size_t, const double *),
          int (*step)(void *, double, double, int), int (*get)(void *, const unsigned *, size_t, double *), unsigned u,
          unsigned x, size_t count, size_t first, size_t steps, double h, double *values, double *rows)
{
    for (size_t k = 0; k < steps; k++) {
        for (size_t i = 0; i < count; i++) {
            set(fmus[i], &u, 1, &values[i ? i - 1 : count - 1]);
        }
        for (size_t i = 0; i < count; i++) {
            step(fmus[i], (double)(first + k) * h, h, 1);
        }
        for (size_t i = 0; i < count; i++) {
            get(fmus[i], &x, 1, &values[i]);
        }
        memcpy(rows + k * count, values, count * sizeof(double));
    }
}
