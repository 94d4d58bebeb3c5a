/* Saved states: one flat block that can be copied, compared and moved to another process. */

#include <stdlib.h>
#include <string.h>

enum { STATE_VERSION = 1 };

/* The block's fixed part; the tape's two buffers follow it. */
typedef struct {
    char guid[64];
    size_t size;
    int version;
    Phase phase;
    double time;
    double start_time;
    double stop_time;
    double last_successful_time;
    bool has_stop_time;
    bool fresh;
    bool prepared;
    double values[N_VALUES];
    char texts[AT_LEAST_ONE(N_TEXTS)][MAX_TEXT];
    int tape_rows;
    int tape_first;
    int tape_last;
    bool tape_has_trip;
    int tape_trip;
    double tape_sample_time;
} State;

static size_t tape_bytes(int rows)
{
    return 2 * (size_t)rows * (size_t)N_TAPE * sizeof(double);
}

static size_t state_size(const Instance *s)
{
    return sizeof(State) + tape_bytes(s->tape.rows);
}

/* Fill a block of state_size() bytes, padding included, so that equal states are equal bytes. */
static void save_state(const Instance *s, State *state)
{
    memset(state, 0, sizeof *state);
    strncpy(state->guid, MODEL_GUID, sizeof state->guid - 1);
    state->size = state_size(s);
    state->version = STATE_VERSION;
    state->phase = s->phase;
    state->time = s->time;
    state->start_time = s->start_time;
    state->stop_time = s->stop_time;
    state->last_successful_time = s->last_successful_time;
    state->has_stop_time = s->has_stop_time;
    state->fresh = s->fresh;
    state->prepared = s->prepared;
    memcpy(state->values, s->values, sizeof state->values);
    memcpy(state->texts, s->texts, sizeof state->texts);
    state->tape_rows = s->tape.rows;
    state->tape_first = s->tape.first;
    state->tape_last = s->tape.last;
    state->tape_has_trip = s->tape.has_trip;
    state->tape_trip = s->tape.trip;
    state->tape_sample_time = s->tape.sample_time;
    if (s->tape.rows > 0) {
        memcpy(state + 1, s->tape.committed, tape_bytes(s->tape.rows));
    }
}

static fmi2Status restore_state(Instance *s, const State *state)
{
    if (strcmp(state->guid, MODEL_GUID) != 0 || state->version != STATE_VERSION) {
        return fail(s, "the saved state belongs to another model");
    }
#if N_TAPE > 0
    if (state->tape_rows == 0) {
        tape_free(&s->tape);
    } else if (tape_allocate(s, state->tape_rows) != fmi2OK) {
        return fmi2Error;
    }
    if (state->tape_rows > 0) {
        memcpy(s->tape.committed, state + 1, tape_bytes(state->tape_rows));
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
    memcpy(s->values, state->values, sizeof s->values);
    memcpy(s->texts, state->texts, sizeof s->texts);
    s->tape.first = state->tape_first;
    s->tape.last = state->tape_last;
    s->tape.has_trip = state->tape_has_trip;
    s->tape.trip = state->tape_trip;
    s->tape.sample_time = state->tape_sample_time;
    return fmi2OK;
}
