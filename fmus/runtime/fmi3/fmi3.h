/* FMI 3.0 under the names that the runtime has for any version. */

#ifndef RAILCOSIM_FMI3_H
#define RAILCOSIM_FMI3_H

/* Those headers of the C library that the standard's would include as something declared as C. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include "fmi3Functions.h"

#define TOKEN_NAME "instantiation token"
#define STATUS_OK fmi3OK
#define STATUS_DISCARD fmi3Discard
#define STATUS_ERROR fmi3Error

/* Whether a value reference may mean a whole array, and whether the time and the event indicators have one. */
#define HAS_ARRAYS 1
#define HAS_TIME 1
#define HAS_INDICATORS 1

typedef fmi3Status Status;
typedef fmi3ValueReference Reference;
typedef fmi3Boolean Truth;

/* Who is told what happens. */
typedef struct {
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
} Listener;

#endif
