/* Messages to the importer. Errors and warnings are always sent; debug messages only when logging is on. */

enum { LOG_ALL, LOG_ERROR, LOG_WARNING, LOG_EVENTS, N_LOG_CATEGORIES };
static const char *const log_categories[N_LOG_CATEGORIES] = {"logAll", "logStatusError", "logStatusWarning", "logEvents"};

/* Give a message to the importer, as its version of FMI wants it. */
static void tell(const Listener *listener, const char *name, Status status, const char *category, const char *text);

static void send(const Instance *s, Status status, int category, const char *text)
{
    tell(&s->listener, s->name, status, log_categories[category], text);
}

#if REAL_TIME
/* printf's texts without printf, which may lock or allocate. Of its formats those that this runtime uses: %s, %.Ns, %d,
   %u, %lu, and %g, whatever its precision with six digits and an exponent. */
static char *put(char *to, const char *end, const char *text, size_t most)
{
    for (size_t n = 0; n < most && text[n] != '\0' && to < end; n++) {
        *to++ = text[n];
    }
    return to;
}

static char *put_whole(char *to, const char *end, unsigned long value)
{
    char digits[24];
    size_t place = sizeof digits - 1;
    digits[place] = '\0';
    do {
        digits[--place] = (char)('0' + value % 10);
        value /= 10;
    } while (value > 0);
    return put(to, end, digits + place, sizeof digits);
}

static char *put_signed(char *to, const char *end, long value)
{
    if (value < 0) {
        to = put(to, end, "-", 1);
    }
    return put_whole(to, end, value < 0 ? 0UL - (unsigned long)value : (unsigned long)value);
}

static char *put_real(char *to, const char *end, double value)
{
    if (isnan(value)) {
        return put(to, end, "nan", 3);
    }
    if (signbit(value)) {
        to = put(to, end, "-", 1);
        value = -value;
    }
    if (isinf(value)) {
        return put(to, end, "inf", 3);
    }
    int exponent = value > 0.0 ? (int)floor(log10(value)) : 0;
    /* In two factors: the power of a subnormal number is none that can be written. */
    double scaled = rint(value * pow(10.0, -(exponent / 2)) * pow(10.0, 5 - exponent + exponent / 2));
    exponent += scaled >= 1e6;
    unsigned long digits = (unsigned long)(scaled >= 1e6 ? 1e5 : scaled);
    to = put_whole(to, end, digits / 100000);
    unsigned long part = digits % 100000;
    to = put(to, end, ".", part > 0);
    for (unsigned long unit = 10000; part > 0; part %= unit, unit /= 10) {
        to = put_whole(to, end, part / unit);
    }
    return exponent == 0 ? to : put_signed(put(to, end, "e", 1), end, exponent);
}

static void write_message(char *to, const char *end, const char *format, va_list arguments)
{
    while (*format != '\0') {
        if (*format != '%') {
            to = put(to, end, format++, 1);
            continue;
        }
        size_t most = MAX_MESSAGE;
        format++;
        if (*format == '.') {
            for (most = 0, format++; *format <= '9'; format++) {
                most = 10 * most + (size_t)(*format - '0');
            }
        }
        if (*format == 'l') {
            to = put_whole(to, end, va_arg(arguments, unsigned long));
            format++;
        } else if (*format == 's') {
            to = put(to, end, va_arg(arguments, const char *), most);
        } else if (*format == 'g') {
            to = put_real(to, end, va_arg(arguments, double));
        } else if (*format == 'u') {
            to = put_whole(to, end, va_arg(arguments, unsigned));
        } else {
            to = put_signed(to, end, va_arg(arguments, int));
        }
        format++;
    }
    *to = '\0';
}
#endif

/* Say what is wrong; the result is STATUS_ERROR, for the caller to return. The remedy belongs into the message. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
static Status fail(Instance *s, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
#if REAL_TIME
    char *end = s->message + sizeof s->message - 1;
    write_message(put(s->message, end, MODEL_NAME ": ", MAX_MESSAGE), end, format, arguments);
#else
    int used = snprintf(s->message, sizeof s->message, "%s: ", MODEL_NAME);
    vsnprintf(s->message + used, sizeof s->message - (size_t)used, format, arguments);
#endif
    va_end(arguments);
    send(s, STATUS_ERROR, LOG_ERROR, s->message);
    return STATUS_ERROR;
}

static void tell_event(const Instance *s, const char *text)
{
    if (s->debug) {
        send(s, STATUS_OK, LOG_EVENTS, text);
    }
}
