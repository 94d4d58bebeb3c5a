/* Counter-based random numbers: SplitMix64 of seed, stream and index; normals by algorithm AS 241 (Wichura 1988) with a
   logarithm of our own, so that the bits do not depend on a C library. components/noise.py is the same in Python. */

static uint64_t scramble(uint64_t x)
{
    x += UINT64_C(0x9E3779B97F4A7C15);
    x = (x ^ (x >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94D049BB133111EB);
    return x ^ (x >> 31);
}

static uint64_t random_bits(uint64_t seed, uint64_t stream, uint64_t index)
{
    return scramble(scramble(scramble(seed) ^ stream) ^ index);
}

static double noise_logarithm(double x)
{
    int exponent;
    double mantissa = frexp(x, &exponent);
    if (mantissa < 0.70710678118654752440) {
        mantissa = 2.0 * mantissa;
        exponent -= 1;
    }
    double s = (mantissa - 1.0) / (mantissa + 1.0);
    double z = s * s;
    double series = 0.0;
    for (int odd = 21; odd >= 3; odd -= 2) {
        series = (series + 1.0 / (double)odd) * z;
    }
    return (double)exponent * 0.693147180369123816490 +
           ((double)exponent * 1.90821492927058770002e-10 + (2.0 * s + 2.0 * s * series));
}

static double ratio(const double numerator[8], const double denominator[8], double r)
{
    double above = 0.0, below = 0.0;
    for (int k = 0; k < 8; k++) {
        above = above * r + numerator[k];
        below = below * r + denominator[k];
    }
    return above / below;
}

/* Coefficients of AS 241, routine PPND16, highest power first. */
static double quantile(double p)
{
    static const double centre[2][8] = {
        {2509.0809287301226727, 33430.575583588128105, 67265.770927008700853, 45921.953931549871457,
         13731.693765509461125, 1971.5909503065514427, 133.14166789178437745, 3.387132872796366608},
        {5226.495278852854561, 28729.085735721942674, 39307.89580009271061, 21213.794301586595867,
         5394.1960214247511077, 687.1870074920579083, 42.313330701600911252, 1.0}};
    static const double middle[2][8] = {
        {7.7454501427834140764e-4, 0.0227238449892691845833, 0.24178072517745061177, 1.27045825245236838258,
         3.64784832476320460504, 5.7694972214606914055, 4.6303378461565452959, 1.42343711074968357734},
        {1.05075007164441684324e-9, 5.475938084995344946e-4, 0.0151986665636164571966, 0.14810397642748007459,
         0.68976733498510000455, 1.6763848301838038494, 2.05319162663775882187, 1.0}};
    static const double tail[2][8] = {
        {2.01033439929228813265e-7, 2.71155556874348757815e-5, 0.0012426609473880784386, 0.026532189526576123093,
         0.29656057182850489123, 1.7848265399172913358, 5.4637849111641143699, 6.6579046435011037772},
        {2.04426310338993978564e-15, 1.4215117583164458887e-7, 1.8463183175100546818e-5, 7.868691311456132591e-4,
         0.0148753612908506148525, 0.13692988092273580531, 0.59983220655588793769, 1.0}};
    double q = p - 0.5;
    if (fabs(q) <= 0.425) {
        return q * ratio(centre[0], centre[1], 0.180625 - q * q);
    }
    double r = sqrt(-noise_logarithm(q < 0.0 ? p : 1.0 - p));
    double value = r <= 5.0 ? ratio(middle[0], middle[1], r - 1.6) : ratio(tail[0], tail[1], r - 5.0);
    return q < 0.0 ? -value : value;
}

static double random_number(bool normal, uint64_t seed, uint64_t stream, uint64_t index)
{
    uint64_t word = random_bits(seed, stream, index);
    if (normal) {
        return quantile(((double)(word >> 12) + 0.5) * 2.220446049250313e-16);
    }
    return (double)(word >> 11) * 1.1102230246251565e-16;
}

/* Put the random numbers of the present time among the values. */
static Status draw(Instance *s)
{
    for (int n = 0; n < N_NOISES; n++) {
        const Noise *noise = &model_noises[n];
        double hold = s->values[noise->hold];
        if (!(hold > 0.0)) {
            return fail(s, "%s must be positive: a random number is held that long", model_variables[noise->hold].name);
        }
        /* A time that is a whole number of holds belongs to the new one whatever the rounding of k * step. */
        double interval = floor(s->time / hold + 1e-6);
        if (!(fabs(interval) < 9223372036854775808.0)) {
            return fail(s, "%s = %g s is too short: a random number is held that long",
                        model_variables[noise->hold].name, hold);
        }
        uint64_t seed = (uint64_t)(int64_t)s->values[SEED], index = (uint64_t)(int64_t)interval;
        for (int k = 0; k < noise->count; k++) {
            uint64_t stream = noise->stream + ((uint64_t)k << 32);
            s->values[noise->first + k] = random_number(noise->normal, seed, stream, index);
        }
    }
    return STATUS_OK;
}
