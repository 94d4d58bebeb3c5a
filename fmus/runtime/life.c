/* The life of an instance, whatever the version of FMI: who may call what and when, a pool of instances, one step. Each
   function is called as `call` by the importer. */

enum { ANY_PHASE = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_RUNNING | PHASE_TERMINATED | PHASE_ERROR };
enum { SETTABLE = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_RUNNING };
enum { READABLE = PHASE_INITIALIZATION | PHASE_RUNNING | PHASE_TERMINATED | PHASE_ERROR };

static const char *phase_name(Phase phase)
{
    switch (phase) {
    case PHASE_INSTANTIATED: return "instantiated";
    case PHASE_INITIALIZATION: return "in initialization mode";
    case PHASE_RUNNING: return "running";
    case PHASE_TERMINATED: return "terminated";
    default: return "in error; it can be reset, restored to a saved state, or freed";
    }
}

/* NULL unless the call is allowed now. */
static Instance *enter(void *c, unsigned phases, const char *call)
{
    Instance *s = (Instance *)c;
    if (s == NULL) {
        return NULL;
    }
    if (!((unsigned)s->phase & phases)) {
        fail(s, "%s is not allowed while the instance is %s", call, phase_name(s->phase));
        return NULL;
    }
    return s;
}

/* A failure after which the instance can only be reset, restored or freed. */
static Status broken(Instance *s)
{
    s->phase = PHASE_ERROR;
    return STATUS_ERROR;
}

#if defined(MAX_INSTANCES)
/* A host without a heap says at compile time how many instances there are at once; one thread makes and frees them. */
#define NO_INSTANCE "all instances are taken; compile with a larger MAX_INSTANCES"
static Instance instances[MAX_INSTANCES];
static bool taken_instances[MAX_INSTANCES];

static Instance *take_instance(void)
{
    for (int n = 0; n < MAX_INSTANCES; n++) {
        if (!taken_instances[n]) {
            taken_instances[n] = true;
            memset(&instances[n], 0, sizeof instances[n]);
            return &instances[n];
        }
    }
    return NULL;
}

static void leave_instance(Instance *s)
{
    taken_instances[s - instances] = false;
}
#else
#define NO_INSTANCE "out of memory"

static Instance *take_instance(void)
{
    return (Instance *)calloc(1, sizeof(Instance));
}

static void leave_instance(Instance *s)
{
    free(s);
}
#endif

/* Why there is no instance. */
static Instance *refuse_instance(Listener listener, const char *name, const char *why)
{
    tell(&listener, name, STATUS_ERROR, log_categories[LOG_ERROR], why);
    return NULL;
}

static Instance *create(Listener listener, const char *name, const char *token, bool debug)
{
    if (name == NULL || name[0] == '\0') {
        return refuse_instance(listener, "?", MODEL_NAME ": an instance needs a name");
    }
    if (token == NULL || strcmp(token, MODEL_GUID) != 0) {
        return refuse_instance(listener, name, MODEL_NAME ": the " TOKEN_NAME " is not " MODEL_GUID
                                                          ": model description and binary differ");
    }
    Instance *s = take_instance();
    if (s == NULL) {
        return refuse_instance(listener, name, MODEL_NAME ": " NO_INSTANCE);
    }
    strncpy(s->name, name, sizeof s->name - 1);
    s->listener = listener;
    s->debug = debug;
    restart(s);
    tell_event(s, "instantiated");
    return s;
}

static void release(void *c)
{
    Instance *s = (Instance *)c;
    if (s == NULL) {
        return;
    }
#if !REAL_TIME
    free(s->tape.committed);
#endif
    leave_instance(s);
}

static Status set_logging(void *c, bool on, size_t count, const char *const categories[], const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (count > 0 && categories == NULL) {
        return fail(s, "%s: NULL for an array of %lu", call, (unsigned long)count);
    }
    bool events = count == 0;
    for (size_t k = 0; k < count; k++) {
        int known = -1;
        for (int n = 0; n < N_LOG_CATEGORIES && categories[k] != NULL; n++) {
            known = strcmp(categories[k], log_categories[n]) == 0 ? n : known;
        }
        if (known < 0) {
            return fail(s, "there is no log category %.100s", categories[k] == NULL ? "NULL" : categories[k]);
        }
        events = events || known == LOG_EVENTS || known == LOG_ALL;
    }
    s->debug = on && events;
    return STATUS_OK;
}

static Status set_experiment(void *c, double start, bool stop_is_given, double stop, const char *call)
{
    Instance *s = enter(c, PHASE_INSTANTIATED, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (!isfinite(start) || (stop_is_given && !(stop >= start))) {
        return fail(s, "%s: there is no experiment from %g s to %g s", call, start, stop);
    }
    s->time = s->start_time = s->last_successful_time = s->reached = start;
    s->has_stop_time = stop_is_given;
    s->stop_time = stop;
    return STATUS_OK;
}

static Status enter_initialization(void *c, const char *call)
{
    Instance *s = enter(c, PHASE_INSTANTIATED, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    s->phase = PHASE_INITIALIZATION;
    s->fresh = s->prepared = false;
    return STATUS_OK;
}

static Status exit_initialization(void *c, const char *call)
{
    Instance *s = enter(c, PHASE_INITIALIZATION, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    for (int n = 0; n < N_VARIABLES; n++) {
        Role role = model_variables[n].role;
        if ((role == ROLE_FIXED || role == ROLE_TUNABLE) &&
            check_bounds(s, &model_variables[n], s->values[n]) != STATUS_OK) {
            return broken(s);
        }
    }
    if (prepare(s) != STATUS_OK) {
        return broken(s);
    }
    s->phase = PHASE_RUNNING;
    s->fresh = false;
#if MODEL_EXCHANGE
    if (s->exchanges) {
        begin_exchange(s);
    }
#endif
    tell_event(s, "initialized");
    return STATUS_OK;
}

static Status terminate(void *c, const char *call)
{
    Instance *s = enter(c, PHASE_RUNNING, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    s->phase = PHASE_TERMINATED;
#if N_TAPE > 0 && !REAL_TIME
    const char *path = s->texts[model_variables[TAPE_FILE].text];
    if (path[0] != '\0') {
        if (tape_commit(s) != STATUS_OK || tape_save(s, path) != STATUS_OK) {
            return broken(s);
        }
    }
#endif
    return STATUS_OK;
}

static Status reset(void *c, const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    restart(s);
    return STATUS_OK;
}

/* One communication step of length h. */
static Status do_step(void *c, double point, double h, const char *call)
{
    Instance *s = enter(c, PHASE_RUNNING, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
#if MODEL_EXCHANGE
    if (s->exchanges) {
        return fail(s, "%s: this instance is for model exchange", call);
    }
#endif
    /* A communication point is told with a few roundings; the last step of a time that was summed up may end far more
       of them past the stop time. */
    double reached = s->last_successful_time, rounding = 1e-6 * h + 4.0 * DBL_EPSILON * fabs(reached);
    if (!(h > 0.0) || !isfinite(h)) {
        return fail(s, "%s: a communication step must be positive, not %g s", call, h);
    }
    if (!(fabs(point - reached) <= rounding)) {
        return fail(s, "%s: the communication point %.17g s does not continue the last one, %.17g s", call, point, reached);
    }
    if (s->has_stop_time && point + h > s->stop_time + 1e-3 * h + rounding) {
        return fail(s, "%s: the step to %.17g s goes past the stop time %.17g s", call, point + h, s->stop_time);
    }
    if (advance(s, point, h) != STATUS_OK) {
        return broken(s);
    }
    s->last_successful_time = point + h;
    return STATUS_OK;
}
