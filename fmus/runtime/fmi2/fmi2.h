/* FMI 2.0 under the names that the runtime has for any version. */

#ifndef RAILCOSIM_FMI2_H
#define RAILCOSIM_FMI2_H

#include "fmi2Functions.h"

/* FMPy's copy of the headers leaves the prefix out, because it makes shared libraries: one that is chosen is put back. */
#if defined(PREFIX_IS_CHOSEN)
#undef fmi2FullName
#define JOINED(prefix, name) prefix##name
#define PREFIXED(prefix, name) JOINED(prefix, name)
#define fmi2FullName(name) PREFIXED(FMI2_FUNCTION_PREFIX, name)
#endif

#define TOKEN_NAME "GUID"
#define STATUS_OK fmi2OK
#define STATUS_DISCARD fmi2Discard
#define STATUS_ERROR fmi2Error

/* Whether a value reference may mean a whole array, and whether the time and the event indicators have one. */
#define HAS_ARRAYS 0
#define HAS_TIME 0
#define HAS_INDICATORS 0

typedef fmi2Status Status;
typedef fmi2ValueReference Reference;
typedef fmi2Boolean Truth;

/* Who is told what happens. */
typedef struct {
    fmi2CallbackLogger log;
    fmi2ComponentEnvironment environment;
} Listener;

#endif
