/* Messages to the importer. Errors and warnings are always sent; debug messages only when logging is on. */

enum { LOG_ALL, LOG_ERROR, LOG_WARNING, LOG_EVENTS, N_LOG_CATEGORIES };
static const char *const log_categories[N_LOG_CATEGORIES] = {"logAll", "logStatusError", "logStatusWarning", "logEvents"};

/* The importer reads a message as a printf format, and #r12# in it as a reference to a variable: double both signs.
   There is room for twice the longest message. */
static void escape(const char *from, char to[2 * MAX_MESSAGE])
{
    size_t used = 0;
    for (; *from != '\0'; from++) {
        if (*from == '%' || *from == '#') {
            to[used++] = *from;
        }
        to[used++] = *from;
    }
    to[used] = '\0';
}

static void send(const Instance *s, fmi2Status status, int category, const char *text)
{
    char escaped[2 * MAX_MESSAGE];
    if (s->logger == NULL) {
        return;
    }
    escape(text, escaped);
    s->logger(s->environment, s->name, status, log_categories[category], escaped);
}

/* Say what is wrong; the result is fmi2Error, for the caller to return. The remedy belongs into the message. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
static fmi2Status fail(Instance *s, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    int used = snprintf(s->message, sizeof s->message, "%s: ", MODEL_NAME);
    vsnprintf(s->message + used, sizeof s->message - (size_t)used, format, arguments);
    va_end(arguments);
    send(s, fmi2Error, LOG_ERROR, s->message);
    return fmi2Error;
}

/* The standard's answer to a question about the status that has none; nothing is wrong. */
static fmi2Status no_status(const Instance *s, const char *text)
{
    send(s, fmi2Discard, LOG_WARNING, text);
    return fmi2Discard;
}

static void tell_event(const Instance *s, const char *text)
{
    if (s->debug) {
        send(s, fmi2OK, LOG_EVENTS, text);
    }
}
