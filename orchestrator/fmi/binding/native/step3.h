/* A step of FMI 3.0, as it is taken in C: by the compiled step loop, and by the process of isolated instances. */

#ifndef STEP3_H
#define STEP3_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* How it went, beside its status; Python reads it (`Told` in fmi3.py). */
typedef struct {
    uint8_t waits, ends, early; /* C's bool, of which an FMU may set any bit */
    double reached;
} Told;

typedef int (*DoStep3)(void *component, double time, double step, bool no_set_state, bool *waits, bool *ends,
                       bool *early, double *reached);

/* Take it; 0 if it ended early or with the simulation, whatever its status. */
static inline int take_step_3(DoStep3 do_step, void *component, Told *told, double time, double step, int is_final,
                              int *status)
{
    told->ends = told->early = false;
    told->reached = NAN;
    *status = do_step(component, time, step, is_final != 0, (bool *)&told->waits, (bool *)&told->ends,
                      (bool *)&told->early, &told->reached);
    return !told->ends && !told->early;
}

#endif
