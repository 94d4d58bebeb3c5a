/* The point-mass train by hand: the same equations, force limits and Runge-Kutta step as PointMassTrain, behind the three
   calls of a step and with no checks at all. It is what the generated FMU is measured against. */

#include <stdlib.h>

#include "fmi2Functions.h"

typedef struct {
    double mass, c0, c1, c2, traction_limit, braking_limit, force, disturbance, line_resistance;
    double position, speed, acceleration;
    int limit_force;
} Train;

static double slope(const Train *s, double speed)
{
    double force = s->force;
    if (s->limit_force) {
        force = force > s->traction_limit ? s->traction_limit : force;
        force = force < -s->braking_limit ? -s->braking_limit : force;
    }
    return force / s->mass - (s->c0 + s->c1 * speed + s->c2 * speed * speed + s->line_resistance) + s->disturbance;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)name, (void)type, (void)guid, (void)resources, (void)functions, (void)visible, (void)loggingOn;
    Train *s = calloc(1, sizeof(Train));
    if (s != NULL) {
        *s = (Train){.mass = 400e3, .c0 = 0.01176, .c1 = 0.00077616, .c2 = 0.00016, .traction_limit = 600e3,
                     .braking_limit = 600e3};
    }
    return s;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real d, fmi2Boolean e, fmi2Real f)
{
    (void)c, (void)a, (void)b, (void)d, (void)e, (void)f;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    (void)vr, (void)n;
    ((Train *)c)->force = value[0];
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean b)
{
    Train *s = c;
    (void)t, (void)b;
    double v = s->speed, k1 = slope(s, v), v2 = v + 0.5 * h * k1, k2 = slope(s, v2), v3 = v + 0.5 * h * k2;
    double k3 = slope(s, v3), v4 = v + h * k3, k4 = slope(s, v4);
    s->position += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
    s->speed += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    s->acceleration = slope(s, s->speed);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    const Train *s = c;
    (void)vr, (void)n;
    value[0] = s->position;
    value[1] = s->speed;
    value[2] = s->acceleration;
    return fmi2OK;
}
