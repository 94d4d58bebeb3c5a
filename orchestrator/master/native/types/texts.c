/* Texts among the values, which are numbers: each text has one, by which all that is asked of it can be done (it is passed
   on, compared, kept for later), and Python has the text again when a block is over. 0 is that of the empty one.

   What an FMU gives is what Python would make of it: no UTF-8 is replaced as it is there. Others than ASCII go to Python,
   where it is not known yet. */

#include "../plan.h"

#include <stdlib.h>
#include <string.h>

struct Texts {
    char **items; /* by number */
    size_t count, room;
    size_t *slots; /* by hash: numbers from 1, or 0; more than twice as many as there is room for */
    size_t slot_count;
    int is_full; /* there was no memory for one */
};

enum { FIRST_ROOM = 64 };

static const char *const capsule_name = "railcosim.texts";

/* Where a text is, or would be: FNV-1a. */
static size_t *slot_of(const Texts *texts, const char *text)
{
    uint64_t hash = 0xcbf29ce484222325U;
    for (const char *c = text; *c != '\0'; c++) {
        hash = (hash ^ (unsigned char)*c) * 0x100000001b3U;
    }
    size_t n = (size_t)(hash % texts->slot_count);
    while (texts->slots[n] != 0 && strcmp(texts->items[texts->slots[n] - 1], text) != 0) {
        n = (n + 1) % texts->slot_count;
    }
    return &texts->slots[n];
}

/* Room for twice as many; 0 without memory. */
static int grow(Texts *texts)
{
    size_t room = texts->room > 0 ? 2 * texts->room : FIRST_ROOM;
    char **items = malloc(room * sizeof *items);
    size_t *slots = calloc(2 * room + 1, sizeof *slots);
    if (items == NULL || slots == NULL) {
        free(items);
        free(slots);
        return 0;
    }
    for (size_t n = 0; n < texts->count; n++) {
        items[n] = texts->items[n];
    }
    free(texts->items);
    free(texts->slots);
    *texts = (Texts){.items = items, .count = texts->count, .room = room, .slots = slots, .slot_count = 2 * room + 1};
    for (size_t n = 0; n < texts->count; n++) {
        *slot_of(texts, items[n]) = n + 1;
    }
    return 1;
}

/* The number of a text, from 1; 0 without memory. */
static size_t number_from_1(Texts *texts, const char *text)
{
    size_t *slot = slot_of(texts, text);
    if (*slot != 0) {
        return *slot;
    }
    if (texts->count == texts->room) {
        if (!grow(texts)) {
            return 0;
        }
        slot = slot_of(texts, text);
    }
    char *copy = malloc(strlen(text) + 1);
    if (copy == NULL) {
        return 0;
    }
    strcpy(copy, text);
    texts->items[texts->count] = copy;
    return *slot = ++texts->count;
}

static int is_ascii(const char *text)
{
    const unsigned char *c = (const unsigned char *)text; /* char has no sign on Arm */
    while (*c != 0 && *c < 0x80) {
        c++;
    }
    return *c == 0;
}

/* The same for a text as an FMU gives it. */
static size_t number_of_given(Texts *texts, const char *given)
{
    size_t known = *slot_of(texts, given);
    if (known != 0 || is_ascii(given)) {
        return known != 0 ? known : number_from_1(texts, given);
    }
    PyGILState_STATE state = PyGILState_Ensure();
    PyObject *text = PyUnicode_DecodeUTF8(given, (Py_ssize_t)strlen(given), "replace");
    PyObject *bytes = text == NULL ? NULL : PyUnicode_AsUTF8String(text); /* uncovered: memory of Python's */
    size_t number = bytes == NULL ? 0 : number_from_1(texts, PyBytes_AsString(bytes)); /* uncovered: memory of Python's */
    Py_XDECREF(bytes);
    Py_XDECREF(text);
    PyErr_Clear();
    PyGILState_Release(state);
    return number;
}

/* The text of a number, whatever that is. */
static const char *text_of(const Texts *texts, double number)
{
    return number >= 0.0 && number < (double)texts->count ? texts->items[(size_t)number] : "";
}

const Call *set_texts(const Hand *hand, const Group *group, double time, int *status)
{
    typedef int (*Set)(void *component, const unsigned int *references, size_t count, const char *const *values);
    typedef int (*Set3)(void *component, const unsigned int *references, size_t count, const char *const *values,
                        size_t value_count);
    const char **values = (const char **)hand->reals;
    for (const Call *call = group->begin; call < group->end; call++) {
        for (size_t k = 0; k < group->count; k++) {
            values[k] = text_of(hand->plan->texts, read_entry(hand->plan, &call->entries[k], time));
        }
        note_call(hand, call);
        *status = group->type == TYPE_TEXT
                      ? ((Set)group->function)(call->component, group->references, group->count, values)
                      : ((Set3)group->function)(call->component, group->references, group->reference_count, values, group->count);
        if (is_failure(*status)) {
            return call;
        }
    }
    return group->end;
}

const Call *get_texts(const Hand *hand, const Group *group, int *status)
{
    typedef int (*Get)(void *component, const unsigned int *references, size_t count, const char **values);
    typedef int (*Get3)(void *component, const unsigned int *references, size_t count, const char **values, size_t value_count);
    const char **values = (const char **)hand->reals;
    Texts *texts = hand->plan->texts;
    for (const Call *call = group->begin; call < group->end; call++) {
        memset(values, 0, group->count * sizeof *values);
        note_call(hand, call);
        *status = group->type == TYPE_TEXT
                      ? ((Get)group->function)(call->component, group->references, group->count, values)
                      : ((Get3)group->function)(call->component, group->references, group->reference_count, values, group->count);
        if (is_failure(*status)) {
            return call;
        }
        for (size_t k = 0; k < group->count; k++) {
            size_t number = number_of_given(texts, values[k] == NULL ? "" : values[k]);
            texts->is_full |= number == 0;
            hand->plan->values[call->entries[k].place] = number == 0 ? 0.0 : (double)(number - 1);
        }
        if (texts->is_full) {
            return call;
        }
    }
    return group->end;
}

int texts_are_full(const Texts *texts)
{
    return texts != NULL && texts->is_full;
}

/* ------------------------------------------------------------------------------------------------ for Python */

static void free_texts(Texts *texts)
{
    for (size_t n = 0; n < texts->count; n++) {
        free(texts->items[n]);
    }
    free(texts->items);
    free(texts->slots);
    free(texts);
}

static void free_capsule(PyObject *capsule)
{
    free_texts(PyCapsule_GetPointer(capsule, capsule_name));
}

int find_texts(PyObject *object, Texts **texts)
{
    *texts = object == Py_None ? NULL : PyCapsule_GetPointer(object, capsule_name);
    if (*texts != NULL) {
        (*texts)->is_full = 0;
    }
    return object == Py_None || *texts != NULL;
}

PyObject *make_texts(PyObject *module, PyObject *nothing)
{
    Texts *texts = calloc(1, sizeof *texts);
    (void)module;
    (void)nothing;
    if (texts == NULL || !grow(texts) || number_from_1(texts, "") == 0) {
        if (texts != NULL) {
            free_texts(texts);
        }
        return PyErr_NoMemory();
    }
    PyObject *capsule = PyCapsule_New(texts, capsule_name, free_capsule);
    if (capsule == NULL) {   /* uncovered: memory of Python's */
        free_texts(texts); /* uncovered: memory of Python's */
    }
    return capsule;
}

PyObject *number_of_text(PyObject *module, PyObject *arguments)
{
    PyObject *capsule;
    const char *text;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "Oy:number", &capsule, &text)) {
        return NULL;
    }
    Texts *texts = PyCapsule_GetPointer(capsule, capsule_name);
    if (texts == NULL) {
        return NULL;
    }
    size_t number = number_from_1(texts, text);
    return number == 0 ? PyErr_NoMemory() : PyLong_FromSize_t(number - 1);
}

PyObject *text_of_number(PyObject *module, PyObject *arguments)
{
    PyObject *capsule;
    double number;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "Od:text", &capsule, &number)) {
        return NULL;
    }
    const Texts *texts = PyCapsule_GetPointer(capsule, capsule_name);
    return texts == NULL ? NULL : PyBytes_FromString(text_of(texts, number));
}

PyObject *count_texts(PyObject *module, PyObject *capsule)
{
    const Texts *texts = PyCapsule_GetPointer(capsule, capsule_name);
    (void)module;
    return texts == NULL ? NULL : PyLong_FromSize_t(texts->count);
}
