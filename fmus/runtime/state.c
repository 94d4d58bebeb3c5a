/* Saved states: one flat block that can be copied, compared and moved to another process. Each function is called as
   `call` by the importer. */

#if REAL_TIME
static Status no_state(void *c, const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    return s == NULL ? STATUS_ERROR : fail(s, "%s: a real-time FMU saves no states: they take memory", call);
}

static Status get_state(void *c, void **state, const char *call)
{
    (void)state;
    return no_state(c, call);
}

static Status set_state(void *c, const void *state, const char *call)
{
    (void)state;
    return no_state(c, call);
}

static Status free_state(void *c, void **state, const char *call)
{
    (void)state;
    return no_state(c, call);
}

static Status size_of_state(void *c, const void *state, size_t *size, const char *call)
{
    (void)state;
    (void)size;
    return no_state(c, call);
}

static Status serialize(void *c, const void *state, void *bytes, size_t size, const char *call)
{
    (void)state;
    (void)bytes;
    (void)size;
    return no_state(c, call);
}

static Status deserialize(void *c, const void *bytes, size_t size, void **state, const char *call)
{
    (void)bytes;
    (void)size;
    (void)state;
    return no_state(c, call);
}
#else

enum { STATE_VERSION = 4 };

/* What tells a block from any other; small enough to be copied to the stack and looked at. */
typedef struct {
    char guid[64];
    size_t size;
    int version;
    int tape_rows;
} StateHead;

/* The block's fixed part; the tape's two buffers follow it. */
typedef struct {
    StateHead head;
    Phase phase;
    double time;
    double start_time;
    double stop_time;
    double last_successful_time;
    bool has_stop_time;
    bool fresh;
    bool prepared;
    bool moving;
    bool based;
    bool tape_has_trip;
    int tape_trip;
    int tape_first;
    int tape_last;
    double taken;
    double reached;
    double base_time;
#if MODEL_EXCHANGE
    bool exchanges;
    Regime regime;
    double modes[AT_LEAST_ONE(N_MODES)];
    int sides[AT_LEAST_ONE(N_STANDSTILL)];
#endif
    double values[N_VALUES];
    double held[AT_LEAST_ONE(N_OUTPUTS)];
    double base[N_BASE];
    double input_derivatives[AT_LEAST_ONE(N_REAL_INPUTS)][MAX_ORDER];
    char texts[AT_LEAST_ONE(N_TEXTS)][MAX_TEXT];
} State;

static size_t tape_bytes(int rows)
{
    return 2 * (size_t)rows * (size_t)N_TAPE * sizeof(double);
}

static size_t state_size(const Instance *s)
{
    return sizeof(State) + tape_bytes(s->tape.rows);
}

static bool is_ours(const StateHead *head, size_t size)
{
    return head->version == STATE_VERSION && strncmp(head->guid, MODEL_GUID, sizeof head->guid) == 0 &&
           head->tape_rows >= 0 && head->size == sizeof(State) + tape_bytes(head->tape_rows) && head->size <= size;
}

/* Fill a block of state_size() bytes, padding included, so that equal states are equal bytes. */
static void save_state(const Instance *s, State *state)
{
    memset(state, 0, sizeof *state);
    strncpy(state->head.guid, MODEL_GUID, sizeof state->head.guid - 1);
    state->head.size = state_size(s);
    state->head.version = STATE_VERSION;
    state->head.tape_rows = s->tape.rows;
    state->phase = s->phase;
    state->time = s->time;
    state->start_time = s->start_time;
    state->stop_time = s->stop_time;
    state->last_successful_time = s->last_successful_time;
    state->has_stop_time = s->has_stop_time;
    state->fresh = s->fresh;
    state->prepared = s->prepared;
    state->moving = s->moving;
    state->based = s->based;
    state->taken = s->taken;
    state->reached = s->reached;
    state->base_time = s->base_time;
    state->tape_has_trip = s->tape.has_trip;
    state->tape_trip = s->tape.trip;
    state->tape_first = s->tape.first;
    state->tape_last = s->tape.last;
#if MODEL_EXCHANGE
    state->exchanges = s->exchanges;
    state->regime = s->regime;
    memcpy(state->modes, s->modes, sizeof state->modes);
    memcpy(state->sides, s->sides, sizeof state->sides);
#endif
    memcpy(state->values, s->values, sizeof state->values);
    memcpy(state->held, s->held, sizeof state->held);
    if (s->based) {
        memcpy(state->base, s->base, sizeof state->base);
    }
    memcpy(state->input_derivatives, s->input_derivatives, sizeof state->input_derivatives);
    memcpy(state->texts, s->texts, sizeof state->texts);
    if (s->tape.rows > 0) {
        memcpy(state + 1, s->tape.committed, tape_bytes(s->tape.rows));
    }
}

static Status restore_state(Instance *s, const State *state)
{
    if (!is_ours(&state->head, state->head.size)) {
        return fail(s, "the saved state belongs to another model");
    }
#if MODEL_EXCHANGE
    if (state->exchanges != s->exchanges) {
        return fail(s, "the saved state is of an instance for %s", s->exchanges ? "co-simulation" : "model exchange");
    }
    s->regime = state->regime;
    memcpy(s->modes, state->modes, sizeof s->modes);
    memcpy(s->sides, state->sides, sizeof s->sides);
#endif
    memcpy(s->values, state->values, sizeof s->values);
    memcpy(s->held, state->held, sizeof s->held);
    memcpy(s->base, state->base, sizeof s->base);
    memcpy(s->input_derivatives, state->input_derivatives, sizeof s->input_derivatives);
    memcpy(s->texts, state->texts, sizeof s->texts);
#if N_TAPE > 0
    if (state->head.tape_rows == 0) {
        tape_free(&s->tape);
    } else if (tape_allocate(s, state->head.tape_rows) != STATUS_OK) {
        return broken(s); /* half of it is restored: nothing of that may be written at the end */
    }
    if (state->head.tape_rows > 0) {
        memcpy(s->tape.committed, state + 1, tape_bytes(state->head.tape_rows));
    }
#endif
    s->phase = state->phase;
    s->time = state->time;
    s->start_time = state->start_time;
    s->stop_time = state->stop_time;
    s->last_successful_time = state->last_successful_time;
    s->has_stop_time = state->has_stop_time;
    s->fresh = state->fresh;
    s->prepared = state->prepared;
    s->moving = state->moving;
    s->based = state->based;
    s->taken = state->taken;
    s->reached = state->reached;
    s->base_time = state->base_time;
    s->tape.has_trip = state->tape_has_trip;
    s->tape.trip = state->tape_trip;
    s->tape.first = state->tape_first;
    s->tape.last = state->tape_last;
    return STATUS_OK;
}

static Status get_state(void *c, void **state, const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (state == NULL) {
        return fail(s, "%s: NULL instead of a place for the state", call);
    }
    /* A state handed in is overwritten, and its memory reused where it fits. */
    State *block = (State *)*state;
    if (block == NULL || block->head.size != state_size(s)) {
        free(block);
        *state = block = (State *)malloc(state_size(s));
        if (block == NULL) {
            return fail(s, "out of memory for a saved state");
        }
    }
    save_state(s, block);
    return STATUS_OK;
}

static Status set_state(void *c, const void *state, const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    return state == NULL ? fail(s, "%s: NULL is no state", call) : restore_state(s, (const State *)state);
}

static Status free_state(void *c, void **state, const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return STATUS_OK;
}

static Status size_of_state(void *c, const void *state, size_t *size, const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (state == NULL || size == NULL) {
        return fail(s, "%s: NULL is no state", call);
    }
    *size = ((const State *)state)->head.size;
    return STATUS_OK;
}

static Status serialize(void *c, const void *state, void *bytes, size_t size, const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (state == NULL || bytes == NULL) {
        return fail(s, "%s: NULL is no state", call);
    }
    size_t needed = ((const State *)state)->head.size;
    if (size < needed) {
        return fail(s, "%s: the state has %lu bytes, there is room for %lu", call, (unsigned long)needed,
                    (unsigned long)size);
    }
    memcpy(bytes, state, needed);
    return STATUS_OK;
}

static Status deserialize(void *c, const void *bytes, size_t size, void **state, const char *call)
{
    Instance *s = enter(c, ANY_PHASE, call);
    StateHead head;
    if (s == NULL) {
        return STATUS_ERROR;
    }
    if (bytes == NULL || state == NULL || size < sizeof head) {
        return fail(s, "%s: %lu bytes are no saved state", call, (unsigned long)size);
    }
    memcpy(&head, bytes, sizeof head);
    if (!is_ours(&head, size)) {
        return fail(s, "%s: the bytes are no saved state of this model", call);
    }
    State *block = (State *)malloc(head.size);
    if (block == NULL) {
        return fail(s, "out of memory for a saved state");
    }
    memcpy(block, bytes, head.size);
    *state = block;
    return STATUS_OK;
}
#endif
