/* Roots of systems of equations: roots.py in C, with every operation in the same sequence. */

#include "roots.h"

#include <math.h>
#include <string.h>

const double settled = 1e-13, solved = 1e-9; /* `SETTLED`, `SOLVED`, and what follows there */
static const int most = 100;
static const double wide = 100.0, narrow = 1e-14, accepted = 1e-4, poor = 0.25, good = 0.75;

/* Room for a system, by its parts. */
typedef struct {
    double *scale, *scaled, *newton, *step, *trial, *reached, *spare, *along;
    double *slopes, *factors;
    double *order;
} Room;

size_t room_of_root(size_t count)
{
    return count * (9 + 2 * count);
}

static Room room_of(const Equations *of)
{
    double *at = of->room;
    size_t n = of->count;
    return (Room){at,         at + n,     at + 2 * n, at + 3 * n, at + 4 * n,         at + 5 * n,
                  at + 6 * n, at + 7 * n, at + 8 * n, at + 8 * n + n * n, at + 8 * n + 2 * n * n};
}

static double lesser(double a, double b)
{
    return b < a ? b : a;
}

static double greater(double a, double b)
{
    return b > a ? b : a;
}

double relative(const double *difference, const double *values, size_t count)
{
    double largest = 0.0;
    for (size_t k = 0; k < count; k++) {
        double size = fabs(values[k]), part = fabs(difference[k]) / (size <= 1.0 ? 1.0 : size);
        if (!isfinite(part)) {
            return INFINITY;
        }
        largest = greater(largest, part);
    }
    return largest;
}

static double norm(const double *vector, size_t count)
{
    double largest = 0.0, sum = 0.0;
    for (size_t k = 0; k < count; k++) {
        double size = fabs(vector[k]);
        if (!isfinite(size)) {
            return INFINITY;
        }
        largest = greater(largest, size);
    }
    if (!(largest > 0.0)) {
        return largest;
    }
    for (size_t k = 0; k < count; k++) {
        double part = vector[k] / largest;
        sum = k > 0 ? sum + part * part : part * part;
    }
    return largest * sqrt(sum);
}

static int are_finite(const double *numbers, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        if (!isfinite(numbers[k])) {
            return 0;
        }
    }
    return 1;
}

/* Of a matrix and a vector, or of the transposed one: one column after the other. */
static void multiply(const double *matrix, const double *vector, size_t count, int is_transposed, double *found)
{
    for (size_t i = 0; i < count; i++) {
        found[i] = 0.0;
        for (size_t k = 0; k < count; k++) {
            found[i] = found[i] + vector[k] * (is_transposed ? matrix[k * count + i] : matrix[i * count + k]);
        }
    }
}

/* LU factors in the place of a matrix, and which row came first each time. */
static void factor(double *matrix, size_t count, double *order)
{
    for (size_t k = 0; k < count; k++) {
        size_t first = k;
        for (size_t i = k + 1; i < count; i++) {
            if (!(fabs(matrix[i * count + k]) <= fabs(matrix[first * count + k])) && !isnan(matrix[first * count + k])) {
                first = i;
            }
        }
        order[k] = (double)first;
        double *own = matrix + k * count, *other = matrix + first * count;
        for (size_t j = 0; j < count; j++) {
            double kept = own[j];
            own[j] = other[j];
            other[j] = kept;
        }
        if (own[k] == 0.0) {
            continue;
        }
        for (size_t i = k + 1; i < count; i++) {
            double *row = matrix + i * count;
            row[k] /= own[k];
            for (size_t j = k + 1; j < count; j++) {
                row[j] -= row[k] * own[j];
            }
        }
    }
}

/* Newton's step, which cancels a mismatch; not finite where the matrix is singular. */
static void cancel(const double *factors, const double *order, const double *mismatch, size_t count, double *found)
{
    for (size_t k = 0; k < count; k++) {
        found[k] = -mismatch[k];
    }
    for (size_t k = 0; k < count; k++) {
        size_t first = (size_t)order[k];
        double kept = found[k];
        found[k] = found[first];
        found[first] = kept;
    }
    for (size_t k = 0; k < count; k++) {
        for (size_t i = k + 1; i < count; i++) {
            found[i] -= found[k] * factors[i * count + k];
        }
    }
    for (size_t k = count; k-- > 0;) {
        found[k] /= factors[k * count + k];
        for (size_t i = 0; i < k; i++) {
            found[i] -= found[k] * factors[i * count + k];
        }
    }
}

static double left_of(const Room *room, const double *mismatch, const double *here, const double *correction, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        room->spare[k] = correction[k] * room->scale[k];
    }
    return greater(relative(mismatch, here, count), relative(room->spare, here, count));
}

static void go(const double *direction, double length, size_t count, double *step)
{
    for (size_t k = 0; k < count; k++) {
        step[k] = direction[k] * length;
    }
}

/* Newton's step, if it is not too long; else one that goes steepest downhill first, and then towards it. */
static void follow_dog_leg(const Room *room, double radius, size_t count)
{
    double *newton = room->newton, *step = room->step, *down = room->spare;
    double size = norm(newton, count);
    if (size <= radius) {
        memcpy(step, newton, count * sizeof(double));
        return;
    }
    int is_finite = are_finite(newton, count);
    multiply(room->slopes, room->scaled, count, 1, down);
    double steep = norm(down, count), along = 0.0;
    if (steep > 0.0) {
        for (size_t k = 0; k < count; k++) {
            down[k] = down[k] / steep;
        }
        multiply(room->slopes, down, count, 0, room->along);
        along = norm(room->along, count);
    }
    if (!(along > 0.0)) {
        for (size_t k = 0; k < count; k++) {
            step[k] = is_finite ? newton[k] * (radius / size) : 0.0;
        }
        return;
    }
    double lowest = steep / along / along;
    if (lowest >= radius || !is_finite) {
        go(down, -lesser(lowest, radius), count, step);
        return;
    }
    go(down, -lowest, count, step); /* the corner */
    double *way = room->along, base = 0.0;
    for (size_t k = 0; k < count; k++) {
        way[k] = newton[k] - step[k];
    }
    double length = norm(way, count);
    for (size_t k = 0; k < count; k++) {
        base += step[k] * (way[k] / length);
    }
    double space = (radius - lowest) * (radius + lowest), root = sqrt(base * base + space);
    double part = lesser(base < 0.0 ? root - base : space / (root + base), length) / length;
    for (size_t k = 0; k < count; k++) {
        step[k] = step[k] + way[k] * part;
    }
}

/* Slopes at values, and Newton's step there; 0 where they are no numbers, -1 where something failed. */
static int linearize(const Equations *of, const Room *room, const double *here, const double *mismatch)
{
    size_t n = of->count;
    for (size_t k = 0; k < n; k++) {
        room->scale[k] = greater(room->scale[k], fabs(here[k]));
    }
    if (!of->derive(of->context, here, room->slopes)) {
        return -1;
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < n; k++) {
            room->slopes[i * n + k] = room->slopes[i * n + k] * room->scale[k] / room->scale[i];
        }
        room->scaled[i] = mismatch[i] / room->scale[i];
    }
    if (!are_finite(room->slopes, n * n) || !are_finite(room->scaled, n)) {
        return 0;
    }
    memcpy(room->factors, room->slopes, n * n * sizeof(double));
    factor(room->factors, n, room->order);
    cancel(room->factors, room->order, room->scaled, n, room->newton);
    return 1;
}

/* A step that makes the mismatch smaller, to `trial` and `reached`; 0 where none does, -1 where something failed. */
static int advance(const Equations *of, const Room *room, const double *here, double left, double *radius)
{
    size_t n = of->count;
    for (size_t k = 0; k < n; k++) {
        room->spare[k] = here[k] / room->scale[k];
    }
    double size = greater(1.0, norm(room->spare, n)), before = norm(room->scaled, n);
    *radius = *radius < 0.0 ? wide * size : *radius;
    for (;;) {
        follow_dog_leg(room, *radius, n);
        double length = norm(room->step, n);
        multiply(room->slopes, room->step, n, 0, room->along);
        for (size_t k = 0; k < n; k++) {
            room->along[k] = room->scaled[k] + room->along[k];
            room->trial[k] = here[k] + room->scale[k] * room->step[k];
        }
        double hoped = before - norm(room->along, n);
        if (!of->evaluate(of->context, room->trial, room->reached)) {
            return -1;
        }
        for (size_t k = 0; k < n; k++) {
            room->spare[k] = room->reached[k] / room->scale[k];
        }
        double gain = before - norm(room->spare, n);
        int is_step = gain > 0.0 && gain >= accepted * hoped;
        if (!is_step || !(gain >= poor * hoped)) {
            *radius = poor * lesser(*radius, length);
        } else if (gain >= good * hoped) {
            *radius = greater(*radius, 2.0 * length);
        }
        if (is_step) {
            return 1;
        }
        if (left <= solved || !(*radius > narrow * size)) {
            return 0;
        }
    }
}

int find_root(const Equations *of, double *here, double *mismatch, double *left, int *is_shown)
{
    size_t n = of->count;
    Room room = room_of(of);
    double radius = -1.0;
    *left = INFINITY;
    for (size_t k = 0; k < n; k++) {
        room.scale[k] = 1.0;
    }
    for (int steps = 0; steps < most; steps++) {
        *is_shown = 0;
        int found = linearize(of, &room, here, mismatch);
        if (found <= 0) {
            *left = INFINITY;
            return found == 0;
        }
        *left = left_of(&room, mismatch, here, room.newton, n);
        if (*left <= settled) {
            return 1;
        }
        found = advance(of, &room, here, *left, &radius);
        if (found <= 0) {
            return found == 0;
        }
        *is_shown = 1;
        memcpy(here, room.trial, n * sizeof(double));
        memcpy(mismatch, room.reached, n * sizeof(double));
        cancel(room.factors, room.order, memcpy(room.scaled, room.spare, n * sizeof(double)), n, room.newton);
        double last = *left;
        *left = left_of(&room, mismatch, here, room.newton, n);
        if (*left <= settled || (*left <= solved && !(*left <= 0.5 * last))) {
            return 1;
        }
    }
    return 1;
}
