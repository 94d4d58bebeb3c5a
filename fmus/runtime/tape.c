/* The tape: memory along one trip that the next trip reads at the same sample. components/tape.py says it in Python;
   the file format is the same, so that a file written by either kind of FMU is read by the other. */

#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if N_TAPE > 0

static bool waiting(const Instance *s, double trip_time)
{
    return trip_time < -0.01 * s->tape.sample_time;
}

/* The sample along the trip into *index; -1 while waiting. */
static void call_equations(const Instance *s, Equations function, double *result);

static fmi2Status tape_index(Instance *s, double trip_time, int *index)
{
    const Tape *tape = &s->tape;
    *index = -1;
    if (waiting(s, trip_time)) {
        return fmi2OK;
    }
    double n = rint(trip_time / tape->sample_time);
    if (fabs(trip_time - n * tape->sample_time) > 0.01 * tape->sample_time) {
        return fail(s, "trip_time = %.17g s is not a multiple of sample_time = %.17g s", trip_time, tape->sample_time);
    }
    if (n >= (double)tape->rows) {
        return fail(s, "trip_time = %.17g s is past the end of the tape; raise tape_duration", trip_time);
    }
    *index = (int)n;
    return fmi2OK;
}

static fmi2Status tape_read(Instance *s, double trip_time)
{
    int n;
    if (tape_index(s, trip_time, &n) != fmi2OK) {
        return fmi2Error;
    }
    const double *row = n < 0 ? model_tape_start : s->tape.committed + (size_t)n * N_TAPE;
    memcpy(s->values + FIRST_TAPE, row, N_TAPE * sizeof(double));
    return fmi2OK;
}

static fmi2Status tape_record(Instance *s, double trip_time, const double *row)
{
    Tape *tape = &s->tape;
    int n;
    if (tape_index(s, trip_time, &n) != fmi2OK) {
        return fmi2Error;
    }
    if (n >= 0) {
        memcpy(tape->recording + (size_t)n * N_TAPE, row, N_TAPE * sizeof(double));
        tape->first = tape->first < 0 || n < tape->first ? n : tape->first;
        tape->last = n > tape->last ? n : tape->last;
    }
    return fmi2OK;
}

/* A sample of one column continued beyond its ends by odd reflection. */
static double reflected(const double *column, int count, int n)
{
    double shift = 0.0, sign = 1.0;
    while (n < 0 || n >= count) {
        int edge = n < 0 ? 0 : count - 1;
        shift += sign * 2.0 * column[(size_t)edge * N_TAPE];
        sign = -sign;
        n = 2 * edge - n;
    }
    return shift + sign * column[(size_t)n * N_TAPE];
}

/* First-order low-pass run forward and backward over each column of the trip's samples. */
static fmi2Status smooth(Instance *s, const double *from, double *to, int count)
{
    double cutoff = s->values[TAPE_CUTOFF];
    if (cutoff <= 0.0 || count < 2) {
        memmove(to, from, (size_t)count * N_TAPE * sizeof(double));
        return fmi2OK;
    }
    double gain = 1.0 - exp(-2.0 * 3.14159265358979323846 * cutoff * s->tape.sample_time);
    int pad = (int)ceil(10.0 / gain);
    int length = count + 2 * pad;
    double *line = malloc((size_t)length * sizeof(double));
    if (line == NULL) {
        return fail(s, "out of memory while filtering the tape");
    }
    for (int column = 0; column < N_TAPE; column++) {
        for (int n = 0; n < length; n++) {
            line[n] = reflected(from + column, count, n - pad);
        }
        double value = line[0];
        for (int n = 0; n < length; n++) {
            value = value + gain * (line[n] - value);
            line[n] = value;
        }
        value = line[length - 1];
        for (int n = length - 1; n >= 0; n--) {
            value = value + gain * (line[n] - value);
            line[n] = value;
        }
        for (int n = 0; n < count; n++) {
            to[(size_t)n * N_TAPE + (size_t)column] = line[n + pad];
        }
    }
    free(line);
    return fmi2OK;
}

static bool keep_trip(Instance *s)
{
    double keep = 1.0;
    call_equations(s, MODEL_KEEP, &keep);
    return keep != 0.0;
}

/* End a trip: if anything was recorded and is to be kept, the filtered rows become the ones that are read. */
static fmi2Status tape_commit(Instance *s)
{
    Tape *tape = &s->tape;
    size_t size = (size_t)tape->rows * N_TAPE * sizeof(double);
    if (tape->first >= 0 && keep_trip(s)) {
        size_t offset = (size_t)tape->first * N_TAPE;
        memcpy(tape->committed, tape->recording, size);
        if (smooth(s, tape->recording + offset, tape->committed + offset, tape->last - tape->first + 1) != fmi2OK) {
            return fmi2Error;
        }
    }
    memcpy(tape->recording, tape->committed, size);
    tape->first = tape->last = -1;
    return fmi2OK;
}

/* Notice a new trip. */
static fmi2Status tape_follow(Instance *s)
{
    Tape *tape = &s->tape;
    int trip = (int)s->values[TRIP];
    double trip_time = s->values[TRIP_TIME];
    if (!tape->has_trip) {
        tape->has_trip = true;
        tape->trip = trip;
    }
    if (trip == tape->trip) {
        return fmi2OK;
    }
    if (!waiting(s, trip_time)) {
        return fail(s, "the trip number changed from %d to %d at trip_time = %.17g s; it may change only while "
                       "trip_time is negative (the wait before a departure)", tape->trip, trip, trip_time);
    }
    tape->trip = trip;
    return tape_commit(s);
}

/* -------------------------------------------------------------------------------------------------------- the file */

static char decimal_point(void)
{
    const struct lconv *convention = localeconv();
    return convention != NULL && convention->decimal_point != NULL ? convention->decimal_point[0] : '.';
}

/* The shortest decimal text that reads back to the same bits, with a decimal point whatever the host's locale. */
static void format_real(double value, char *text, size_t size)
{
    int precision = 1;
    do {
        snprintf(text, size, "%.*g", precision, value);
    } while (strtod(text, NULL) != value && ++precision <= 17);
    char *point = strchr(text, decimal_point());
    if (point != NULL) {
        *point = '.';
    }
    if (strpbrk(text, ".en") == NULL && strlen(text) + 3 < size) {
        strcat(text, ".0");
    }
}

static bool read_real(char *text, char **end, double *value)
{
    size_t length = strcspn(text, " \n");
    for (size_t k = 0; k < length; k++) {
        if (text[k] == '.') {
            text[k] = decimal_point();
        }
    }
    *value = strtod(text, end);
    return *end == text + length && length > 0 && isfinite(*value);
}

static void tape_header(const Instance *s, char *text, size_t size)
{
    char sample_time[32];
    format_real(s->tape.sample_time, sample_time, sizeof sample_time);
    snprintf(text, size, "railcosim tape 1 component=%s sample_time=%s rows=%d columns=%d", MODEL_NAME, sample_time,
             s->tape.rows, N_TAPE);
}

static bool tape_rows(FILE *file, Tape *tape)
{
    enum { LINE = 32 * N_TAPE + 64 };
    char line[LINE];
    for (int n = 0; n < tape->rows; n++) {
        if (fgets(line, LINE, file) == NULL) {
            return false;
        }
        char *at = line;
        for (int column = 0; column < N_TAPE; column++) {
            if (!read_real(at, &at, &tape->committed[(size_t)n * N_TAPE + (size_t)column])) {
                return false;
            }
            if (*at == ' ') {
                at++;
            }
        }
        if (*at != '\n') {
            return false;
        }
    }
    return fgets(line, LINE, file) != NULL && strcmp(line, "end\n") == 0 && fgetc(file) == EOF;
}

static fmi2Status tape_load(Instance *s, const char *path)
{
    char expected[MAX_MESSAGE / 2], found[MAX_MESSAGE / 2];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return fmi2OK; /* nothing learned yet */
    }
    tape_header(s, expected, sizeof expected);
    if (fgets(found, sizeof found, file) == NULL || strncmp(found, "railcosim tape 1", 16) != 0) {
        fclose(file);
        return fail(s, "tape_file: %.300s is not a tape file; remove it to start anew", path);
    }
    found[strcspn(found, "\n")] = '\0';
    if (strcmp(found, expected) != 0) {
        fclose(file);
        return fail(s, "tape_file: %.200s does not fit this instance: it says '%.250s', expected '%.250s'", path, found,
                    expected);
    }
    bool whole = tape_rows(file, &s->tape);
    fclose(file);
    if (!whole) {
        return fail(s, "tape_file: %.300s is corrupt: a row is incomplete, missing or not finite; remove it to start anew",
                    path);
    }
    memcpy(s->tape.recording, s->tape.committed, (size_t)s->tape.rows * N_TAPE * sizeof(double));
    return fmi2OK;
}

/* Write the file, whole or not at all. */
static fmi2Status tape_save(Instance *s, const char *path)
{
    char part[MAX_TEXT + 8], text[MAX_MESSAGE / 2];
    snprintf(part, sizeof part, "%s.part", path);
    FILE *file = fopen(part, "wb");
    if (file == NULL) {
        return fail(s, "tape_file: %.300s cannot be written", path);
    }
    tape_header(s, text, sizeof text);
    bool good = fprintf(file, "%s\n", text) > 0;
    for (int n = 0; n < s->tape.rows && good; n++) {
        for (int column = 0; column < N_TAPE && good; column++) {
            format_real(s->tape.committed[(size_t)n * N_TAPE + (size_t)column], text, sizeof text);
            good = fprintf(file, "%s%c", text, column + 1 < N_TAPE ? ' ' : '\n') > 0;
        }
    }
    good = good && fprintf(file, "end\n") > 0;
    good = fclose(file) == 0 && good;
#if defined(_WIN32)
    remove(path); /* rename does not replace there */
#endif
    if (!good || rename(part, path) != 0) {
        remove(part);
        return fail(s, "tape_file: %.300s cannot be written", path);
    }
    return fmi2OK;
}

static void tape_free(Tape *tape)
{
    free(tape->committed);
    memset(tape, 0, sizeof *tape);
    tape->first = tape->last = -1;
}

static fmi2Status tape_allocate(Instance *s, int rows)
{
    Tape *tape = &s->tape;
    if (tape->rows != rows) {
        double sample_time = tape->sample_time;
        tape_free(tape);
        tape->sample_time = sample_time;
        tape->committed = malloc(2 * (size_t)rows * N_TAPE * sizeof(double));
        if (tape->committed == NULL) {
            return fail(s, "out of memory for a tape of %d samples", rows);
        }
        tape->rows = rows;
        tape->recording = tape->committed + (size_t)rows * N_TAPE;
    }
    return fmi2OK;
}

/* A tape as it is before the first sample: the start row everywhere, or what the tape file holds. */
static fmi2Status tape_prepare(Instance *s)
{
    Tape *tape = &s->tape;
    double sample_time = s->values[SAMPLE_TIME];
    if (!(sample_time > 0.0)) {
        return fail(s, "sample_time must be set: a tape is recorded on a fixed grid");
    }
    double rows = rint(s->values[TAPE_DURATION] / sample_time) + 1.0;
    if (!(rows * N_TAPE < 1e9)) {
        return fail(s, "a tape of %g samples is too long; check tape_duration and sample_time", rows);
    }
    tape->sample_time = sample_time;
    if (tape_allocate(s, (int)rows) != fmi2OK) {
        return fmi2Error;
    }
    tape->has_trip = false;
    tape->first = tape->last = -1;
    for (int n = 0; n < 2 * tape->rows; n++) {
        memcpy(tape->committed + (size_t)n * N_TAPE, model_tape_start, N_TAPE * sizeof(double));
    }
    const char *path = s->texts[model_variables[TAPE_FILE].text];
    return path[0] == '\0' ? fmi2OK : tape_load(s, path);
}

#endif
