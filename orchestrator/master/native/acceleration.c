/* From what was tried to what is tried next: acceleration.py in C, with every operation in the same sequence. */

#include "kernel.h"

#include <math.h>
#include <string.h>

enum { DEPTH = 5 }; /* former iterates that Anderson's method combines */

static const double dependent = 1e-14; /* part of a column that is left of one which depends on others */

/* Of one number or more. The first product is not added to zero: a sum of one number is that number, its sign included. */
static double dot(const double *a, const double *b, size_t count)
{
    double sum = a[0] * b[0];
    for (size_t k = 1; k < count; k++) {
        sum += a[k] * b[k];
    }
    return sum;
}

static void subtract(double *from, double factor, const double *what, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        from[k] -= factor * what[k];
    }
}

static void relax(double relaxation, size_t count, double *guess, const double *reached)
{
    for (size_t k = 0; k < count; k++) {
        guess[k] = guess[k] + relaxation * (reached[k] - guess[k]);
    }
}

/* Work space: the factor, the residual before. */
static void follow_aitken(double relaxation, size_t count, int is_first, double *guess, double *reached, double *work)
{
    double *before = work + 1, *residual = reached;
    for (size_t k = 0; k < count; k++) {
        residual[k] = reached[k] - guess[k];
    }
    if (is_first) {
        work[0] = relaxation;
    } else {
        double size = 0.0, part = 0.0;
        for (size_t k = 0; k < count; k++) {
            double change = residual[k] - before[k];
            size = k > 0 ? size + change * change : change * change;
            part = k > 0 ? part + before[k] * change : before[k] * change;
        }
        if (size > 0.0) {
            work[0] *= -part / size;
        }
    }
    memcpy(before, residual, count * sizeof(double));
    for (size_t k = 0; k < count; k++) {
        guess[k] = guess[k] + work[0] * residual[k];
    }
}

/* The combination of columns, of which the last is the newest, that comes nearest to `rest`, which is used up: by
   modified Gram-Schmidt, as `_nearest` in acceleration.py. `column` and `basis` are room. */
static void find_weights(double *const *columns, int column_count, size_t count, double *rest, double *column, double *basis,
                         double *weights)
{
    double upper[DEPTH][DEPTH] = {{0.0}}, right[DEPTH];
    int kept[DEPTH], rank = 0;
    for (int j = column_count - 1; j >= 0; j--) {
        weights[j] = 0.0;
        if ((size_t)rank == count) {
            continue;
        }
        memcpy(column, columns[j], count * sizeof(double));
        double whole = sqrt(dot(column, column, count));
        for (int n = 0; n < rank; n++) {
            upper[n][rank] = 0.0;
        }
        for (int pass = 0; pass < 2; pass++) { /* the second takes away what rounding has left of the first */
            for (int n = 0; n < rank; n++) {
                double part = dot(basis + (size_t)n * count, column, count);
                subtract(column, part, basis + (size_t)n * count, count);
                upper[n][rank] += part;
            }
        }
        double left = sqrt(dot(column, column, count));
        if (!(left > dependent * whole)) {
            continue;
        }
        double *own = basis + (size_t)rank * count;
        for (size_t k = 0; k < count; k++) {
            own[k] = column[k] / left;
        }
        upper[rank][rank] = left;
        right[rank] = dot(own, rest, count);
        subtract(rest, right[rank], own, count);
        kept[rank++] = j;
    }
    for (int n = rank - 1; n >= 0; n--) {
        double value = right[n];
        for (int m = n + 1; m < rank; m++) {
            value -= upper[n][m] * weights[kept[m]];
        }
        weights[kept[n]] = value / upper[n][n];
    }
}

/* Work space: how many iterates there are, their guesses and residuals, steps and changes between them, and room. */
static int follow_anderson(double relaxation, size_t count, int is_first, double *guess, const double *reached, double *work)
{
    int known = is_first ? 0 : (int)work[0];
    double *guesses = work + 1, *residuals = guesses + (DEPTH + 1) * count, *changes = residuals + (DEPTH + 1) * count;
    double *basis = changes + DEPTH * count, *rest = basis + DEPTH * count, *column = rest + count;
    if (known == DEPTH + 1) {
        memmove(guesses, guesses + count, DEPTH * count * sizeof(double));
        memmove(residuals, residuals + count, DEPTH * count * sizeof(double));
        known--;
    }
    double *residual = residuals + (size_t)known * count;
    for (size_t k = 0; k < count; k++) {
        guesses[(size_t)known * count + k] = guess[k];
        residual[k] = reached[k] - guess[k];
    }
    work[0] = ++known;
    double *columns[DEPTH], weights[DEPTH];
    int is_finite = 1;
    for (int j = 0; j + 1 < known; j++) {
        columns[j] = changes + (size_t)j * count;
        for (size_t k = 0; k < count; k++) {
            columns[j][k] = residuals[(size_t)(j + 1) * count + k] - residuals[(size_t)j * count + k];
            is_finite &= isfinite(columns[j][k]) != 0;
        }
    }
    if (!is_finite) {
        return 0;
    }
    memcpy(rest, residual, count * sizeof(double));
    find_weights(columns, known - 1, count, rest, column, basis, weights);
    for (size_t k = 0; k < count; k++) {
        double move = 0.0;
        for (int j = 0; j + 1 < known; j++) {
            double step = guesses[(size_t)(j + 1) * count + k] - guesses[(size_t)j * count + k];
            move += weights[j] * (step + relaxation * columns[j][k]);
        }
        guess[k] = guess[k] + relaxation * residual[k] - move;
    }
    return 1;
}

size_t work_of_acceleration(int64_t method, size_t count)
{
    size_t own = method == ANDERSON ? 1 + (4 * DEPTH + 4) * count : method == AITKEN ? 1 + count : 0;
    return 2 * count + own; /* the guess, and what it led to */
}

int accelerate(int64_t method, double relaxation, size_t count, int is_first, double *guess, double *reached, double *work)
{
    if (method == ANDERSON) {
        return follow_anderson(relaxation, count, is_first, guess, reached, work);
    }
    if (method == AITKEN) {
        follow_aitken(relaxation, count, is_first, guess, reached, work);
    } else {
        relax(relaxation, count, guess, reached);
    }
    return 1;
}
