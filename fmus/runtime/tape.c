/* The tape: memory along one trip that the next trip reads at the same sample. components/tape.py says it in Python;
   the file format is the same, so that a file written by either kind of FMU is read by the other. */

#if N_TAPE > 0

static bool waiting(const Instance *s, double trip_time)
{
    return trip_time < -0.01 * s->tape.sample_time;
}

/* The sample along the trip into *index; -1 while waiting. Between samples it is the last one. */
static Status tape_index(Instance *s, double trip_time, bool at_sample, int *index)
{
    const Tape *tape = &s->tape;
    *index = -1;
    if (waiting(s, trip_time)) {
        return STATUS_OK;
    }
    double place = trip_time / tape->sample_time;
    double n = at_sample ? rint(place) : floor(place + 0.01);
    if (at_sample && fabs(trip_time - n * tape->sample_time) > 0.01 * tape->sample_time) {
        return fail(s, "trip_time = %.17g s is not a multiple of sample_time = %.17g s", trip_time, tape->sample_time);
    }
    if (n >= (double)tape->rows) {
        return fail(s, "trip_time = %.17g s is past the end of the tape; raise tape_duration", trip_time);
    }
    *index = (int)n;
    return STATUS_OK;
}

static Status tape_read(Instance *s, double trip_time, bool at_sample)
{
    if (tape_index(s, trip_time, at_sample, &s->tape.row) != STATUS_OK) {
        return STATUS_ERROR;
    }
    const double *row = s->tape.row < 0 ? model_tape_start : s->tape.committed + (size_t)s->tape.row * N_TAPE;
    memcpy(s->values + FIRST_TAPE, row, N_TAPE * sizeof(double));
    return STATUS_OK;
}

/* The row of the sample whose outputs have just been computed. */
static void tape_record(Instance *s, const double *row)
{
    Tape *tape = &s->tape;
    int n = tape->row;
    if (n >= 0) {
        memcpy(tape->recording + (size_t)n * N_TAPE, row, N_TAPE * sizeof(double));
        tape->first = tape->first < 0 || n < tape->first ? n : tape->first;
        tape->last = n > tape->last ? n : tape->last;
    }
}

/* A sample of one column of `count` > 1, continued beyond its ends by odd reflection as often as it takes. */
static double continued(const double *column, int count, int n)
{
    int period = count - 1;
    int turn = n >= 0 ? n / period : -((period - 1 - n) / period);
    int place = n - turn * period;
    double last = column[(size_t)period * N_TAPE];
    double rise = last - column[0];
    if (turn % 2 == 0) {
        return column[(size_t)place * N_TAPE] + (double)turn * rise;
    }
    return (2.0 * last - column[(size_t)(period - place) * N_TAPE]) + (double)(turn - 1) * rise;
}

/* First-order low-pass run forward and backward over each column of the trip's samples. */
static void smooth(const Tape *tape, const double *from, double *to, int count)
{
    double gain = tape->gain, *line = tape->line;
    int length = count + 2 * tape->pad;
    if (gain <= 0.0 || count < 2) {
        return; /* the samples are in place already */
    }
    for (int column = 0; column < N_TAPE; column++) {
        for (int n = 0; n < length; n++) {
            line[n] = continued(from + column, count, n - tape->pad);
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
            to[(size_t)n * N_TAPE + (size_t)column] = line[n + tape->pad];
        }
    }
}

static bool keep_trip(Instance *s)
{
    double keep = 1.0;
    call_equations(s, MODEL_KEEP, &keep);
    return keep != 0.0;
}

/* End a trip: if anything was recorded and is to be kept, the filtered rows become the ones that are read. */
static Status tape_commit(Instance *s)
{
    Tape *tape = &s->tape;
    size_t size = (size_t)tape->rows * N_TAPE * sizeof(double);
    if (tape->first >= 0 && keep_trip(s)) {
        size_t offset = (size_t)tape->first * N_TAPE;
        memcpy(tape->committed, tape->recording, size);
        smooth(tape, tape->recording + offset, tape->committed + offset, tape->last - tape->first + 1);
    }
    memcpy(tape->recording, tape->committed, size);
    tape->first = tape->last = -1;
    for (size_t n = 0; n < (size_t)tape->rows * N_TAPE; n++) {
        if (!isfinite(tape->committed[n])) {
            return fail(s, "tape_cutoff: the filter takes what was recorded beyond all numbers");
        }
    }
    return STATUS_OK;
}

/* Notice a new trip. */
static Status tape_follow(Instance *s)
{
    Tape *tape = &s->tape;
    int trip = (int)s->values[TRIP];
    double trip_time = s->values[TRIP_TIME];
    if (!tape->has_trip) {
        tape->has_trip = true;
        tape->trip = trip;
    }
    if (trip == tape->trip) {
        return STATUS_OK;
    }
    if (!waiting(s, trip_time)) {
        return fail(s, "the trip number changed from %d to %d at trip_time = %.17g s; it may change only while "
                       "trip_time is negative (the wait before a departure)", tape->trip, trip, trip_time);
    }
    tape->trip = trip;
    return tape_commit(s);
}

#if !REAL_TIME
/* -------------------------------------------------------------------------------------------------------- the file */

enum { REAL_TEXT = 40 };

/* What the host's locale writes for the decimal point; it may have several bytes. */
static void decimal_point(char point[REAL_TEXT])
{
    snprintf(point, REAL_TEXT, "%.1f", 0.5);
    size_t length = strlen(point) - 2;
    memmove(point, point + 1, length);
    point[length] = '\0';
}

/* The shortest decimal text of a finite number that reads back to the same bits, in the form and with the point that Python writes. */
static void format_real(double value, char text[REAL_TEXT])
{
    /* A decimal of up to 15 digits survives the way to a double and back, behind it then stand zeros; and a double the
       way to 17 digits and back. */
    int decimals = 14;
    snprintf(text, REAL_TEXT, "%.*e", decimals, value);
    while (strtod(text, NULL) != value) {
        snprintf(text, REAL_TEXT, "%.*e", ++decimals, value);
    }
    const char *end = strchr(text, 'e');
    int exponent = atoi(end + 1);
    while (decimals > 0 && *--end == '0') {
        decimals--;
    }
    if (exponent >= -4 && exponent < 16) {
        snprintf(text, REAL_TEXT, "%.*f", decimals - exponent > 1 ? decimals - exponent : 1, value);
    } else {
        snprintf(text, REAL_TEXT, "%.*e", decimals, value);
    }
    char point[REAL_TEXT];
    decimal_point(point);
    char *found = strstr(text, point);
    if (found != NULL) {
        *found = '.';
        memmove(found + 1, found + strlen(point), strlen(found + strlen(point)) + 1);
    }
}

/* The next number of a row. It must be followed by `separator`, and be finite. */
static bool read_real(FILE *file, char separator, double *value)
{
    char text[2 * REAL_TEXT], point[REAL_TEXT], *end;
    size_t used = 0;
    int c = fgetc(file);
    decimal_point(point);
    for (; c != ' ' && c != '\r' && c != '\n' && c != EOF; c = fgetc(file)) {
        if (used >= REAL_TEXT) {
            return false;
        }
        if (c == '.') {
            strcpy(text + used, point);
            used += strlen(point);
        } else {
            text[used++] = (char)c;
        }
    }
    text[used] = '\0';
    if (c == '\r') {
        c = fgetc(file);
    }
    *value = strtod(text, &end);
    return c == separator && used > 0 && *end == '\0' && isfinite(*value);
}

static void tape_header(const Instance *s, char *text, size_t size)
{
    char sample_time[REAL_TEXT];
    format_real(s->tape.sample_time, sample_time);
    snprintf(text, size, "railcosim tape 1 component=%s sample_time=%s rows=%d columns=%d", MODEL_NAME, sample_time,
             s->tape.rows, N_TAPE);
}

static bool read_rows(FILE *file, const Tape *tape)
{
    char line[8];
    for (int n = 0; n < tape->rows * N_TAPE; n++) {
        if (!read_real(file, (n + 1) % N_TAPE == 0 ? '\n' : ' ', &tape->committed[n])) {
            return false;
        }
    }
    return fgets(line, sizeof line, file) != NULL && (strcmp(line, "end\n") == 0 || strcmp(line, "end\r\n") == 0) &&
           fgetc(file) == EOF;
}

static Status tape_load(Instance *s, const char *path)
{
    char expected[MAX_MESSAGE / 2], found[MAX_MESSAGE / 2];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return errno == ENOENT ? STATUS_OK /* nothing learned yet */ : fail(s, "tape_file: %.300s cannot be read", path);
    }
    tape_header(s, expected, sizeof expected);
    if (fgets(found, sizeof found, file) == NULL || strncmp(found, "railcosim tape 1", 16) != 0) {
        fclose(file);
        return fail(s, "tape_file: %.300s is not a tape file; remove it to start anew", path);
    }
    found[strcspn(found, "\r\n")] = '\0';
    if (strcmp(found, expected) != 0) {
        fclose(file);
        return fail(s, "tape_file: %.200s does not fit this instance: it says '%.250s', expected '%.250s'", path, found,
                    expected);
    }
    bool whole = read_rows(file, &s->tape);
    fclose(file);
    if (!whole) {
        return fail(s, "tape_file: %.300s is corrupt: a row is incomplete, missing or not finite; remove it to start anew",
                    path);
    }
    memcpy(s->tape.recording, s->tape.committed, (size_t)s->tape.rows * N_TAPE * sizeof(double));
    return STATUS_OK;
}

/* Write the file, whole or not at all. */
static Status tape_save(Instance *s, const char *path)
{
    char part[MAX_TEXT + 8], text[MAX_MESSAGE / 2];
    snprintf(part, sizeof part, "%s.part", path);
    FILE *file = fopen(part, "wb");
    if (file == NULL) {
        return fail(s, "tape_file: %.300s cannot be written", path);
    }
    tape_header(s, text, sizeof text);
    fprintf(file, "%s\n", text);
    for (int n = 0; n < s->tape.rows; n++) {
        for (int column = 0; column < N_TAPE; column++) {
            format_real(s->tape.committed[(size_t)n * N_TAPE + (size_t)column], text);
            fprintf(file, "%s%c", text, column + 1 < N_TAPE ? ' ' : '\n');
        }
    }
    fprintf(file, "end\n");
    int wrong = ferror(file); /* which remembers what could not be written */
    wrong |= fclose(file);
#if defined(_WIN32)
    remove(path); /* rename does not replace there */
#endif
    if (wrong != 0 || rename(part, path) != 0) {
        remove(part);
        return fail(s, "tape_file: %.300s cannot be written", path);
    }
    return STATUS_OK;
}

#endif

static void tape_free(Tape *tape)
{
#if !REAL_TIME
    free(tape->committed);
#endif
    memset(tape, 0, sizeof *tape);
    tape->first = tape->last = -1;
}

/* Room for `rows` samples, and for the filter that the parameters ask for; the same memory again if it fits. */
static Status tape_allocate(Instance *s, int rows)
{
    Tape *tape = &s->tape;
    double sample_time = s->values[SAMPLE_TIME], cutoff = s->values[TAPE_CUTOFF];
    double gain = cutoff > 0.0 ? 1.0 - exp(-2.0 * 3.14159265358979323846 * cutoff * sample_time) : 0.0;
    /* Ten time constants of run-in leave less than 5e-5 of the start value in the result. */
    double pad = cutoff > 0.0 ? ceil(10.0 / gain) : 0.0;
    if (!(pad < 1e8)) {
        return fail(s, "tape_cutoff = %g Hz is too low to filter samples %g s apart", cutoff, sample_time);
    }
    if (tape->rows != rows || tape->pad != (int)pad) {
        size_t cells = (size_t)rows * N_TAPE;
        tape_free(tape);
#if REAL_TIME
        if (rows > TAPE_ROWS || pad > TAPE_PAD) {
            return fail(s, "this real-time FMU has room for a tape of %d samples and %d of run-in, not %d and %d; lower "
                           "tape_duration, or compile its sources with larger TAPE_ROWS and TAPE_PAD", TAPE_ROWS, TAPE_PAD, rows,
                        (int)pad);
        }
        tape->committed = s->tape_cells;
#else
        tape->committed = (double *)malloc((2 * cells + (size_t)rows + 2 * (size_t)pad) * sizeof(double));
        if (tape->committed == NULL) {
            return fail(s, "out of memory for a tape of %d samples", rows);
        }
#endif
        tape->recording = tape->committed + cells;
        tape->line = tape->recording + cells;
        tape->rows = rows;
        tape->pad = (int)pad;
    }
    tape->sample_time = sample_time;
    tape->gain = gain;
    return STATUS_OK;
}

/* A tape as it is before the first sample: the start row everywhere, or what the tape file holds. */
static Status tape_prepare(Instance *s)
{
    Tape *tape = &s->tape;
    if (!(s->values[SAMPLE_TIME] > 0.0)) {
        return fail(s, "sample_time must be set: a tape is recorded on a fixed grid");
    }
    double rows = rint(s->values[TAPE_DURATION] / s->values[SAMPLE_TIME]) + 1.0;
    if (!(rows >= 1.0 && rows * N_TAPE < 1e9)) {
        return fail(s, "a tape of %g samples cannot be; check tape_duration and sample_time", rows);
    }
    if (tape_allocate(s, (int)rows) != STATUS_OK) {
        return STATUS_ERROR;
    }
    tape->has_trip = false;
    tape->first = tape->last = -1;
    for (int n = 0; n < 2 * tape->rows; n++) {
        memcpy(tape->committed + (size_t)n * N_TAPE, model_tape_start, N_TAPE * sizeof(double));
    }
    const char *path = s->texts[model_variables[TAPE_FILE].text];
#if REAL_TIME
    return path[0] == '\0' ? STATUS_OK : fail(s, "tape_file: a real-time FMU reads and writes no files; leave it empty");
#else
    return path[0] == '\0' ? STATUS_OK : tape_load(s, path);
#endif
}

#endif
