/* Messages to the importer. Errors and warnings are always sent; debug messages only when logging is on. */

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const log_categories[] = {"logStatusError", "logStatusWarning", "logEvents"};

/* The importer reads a message as a printf format, and #r12# in it as a reference to a variable: double both signs. */
static void escape(const char *from, char *to, size_t size)
{
    size_t used = 0;
    for (; *from != '\0' && used + 2 < size; from++) {
        if (*from == '%' || *from == '#') {
            to[used++] = *from;
        }
        to[used++] = *from;
    }
    to[used] = '\0';
}

static void send(const Instance *s, fmi2Status status, const char *category, const char *text)
{
    char escaped[2 * MAX_MESSAGE];
    if (s->callbacks == NULL || s->callbacks->logger == NULL) {
        return;
    }
    escape(text, escaped, sizeof escaped);
    s->callbacks->logger(s->callbacks->componentEnvironment, s->name, status, category, escaped);
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
    send(s, fmi2Error, log_categories[0], s->message);
    return fmi2Error;
}

static void tell_event(const Instance *s, const char *text)
{
    if (s->debug) {
        send(s, fmi2OK, log_categories[2], text);
    }
}
