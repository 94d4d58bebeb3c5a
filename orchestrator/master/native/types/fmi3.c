/* Calls of FMI 3.0, which has a function for each width of number, counts values beside references, and says in four places
   how a step went.

   Values pass as the doubles that they are everywhere here; whole numbers of 64 bits, which doubles do not hold, as their
   bits (`Form`). Truth values of FMI 1.0, a byte each, pass here as well, by functions that do not count values. */

#include "../kernel.h"

#include <math.h>

typedef int (*Set)(void *component, const unsigned int *references, size_t count, const void *values, size_t value_count);
typedef int (*Get)(void *component, const unsigned int *references, size_t count, void *values, size_t value_count);
typedef int (*SetBytes)(void *component, const unsigned int *references, size_t count, const void *values);
typedef int (*GetBytes)(void *component, const unsigned int *references, size_t count, void *values);

/* By type, what is the least and the greatest number that it holds and a double is. */
static const double bounds[][2] = {
    [TYPE_INT8] = {INT8_MIN, INT8_MAX},    [TYPE_UINT8] = {0, UINT8_MAX},    [TYPE_INT16] = {INT16_MIN, INT16_MAX},
    [TYPE_UINT16] = {0, UINT16_MAX},       [TYPE_INT32] = {INT32_MIN, INT32_MAX}, [TYPE_UINT32] = {0, UINT32_MAX},
    [TYPE_INT64] = {-0x1p63, 0x1.fffffffffffffp62}, [TYPE_UINT64] = {0, 0x1.fffffffffffffp63},
};

double number_of(double value, int64_t form)
{
    Cell cell = {.number = value};
    return form == SIGNED_BITS ? (double)cell.whole : form == UNSIGNED_BITS ? (double)cell.natural : value;
}

/* The value an entry stands for goes where the FMU reads it; 0 if its type does not hold it. */
static int put(const Plan *plan, const Entry *entry, double time, int type, void *to, size_t k)
{
    if (entry->form != NUMBER && is_plain(entry) && (type == TYPE_INT64 || type == TYPE_UINT64)) {
        Cell cell = {.number = *value_of(plan, entry)};
        ((int64_t *)to)[k] = cell.whole;
        return (entry->form == SIGNED_BITS) == (type == TYPE_INT64) || cell.whole >= 0; /* the other's, which both hold */
    }
    double value = read_entry(plan, entry, time);
    switch (type) {
    case TYPE_FLOAT64: ((double *)to)[k] = value; return 1;
    case TYPE_FLOAT32: ((float *)to)[k] = (float)value; return 1;
    case TYPE_BOOLEAN: case TYPE_BYTE: ((uint8_t *)to)[k] = value != 0.0; return 1;
    default: break;
    }
    if (!(value >= bounds[type][0] && value <= bounds[type][1])) {
        return 0;
    }
    switch (type) {
    case TYPE_INT8: ((int8_t *)to)[k] = (int8_t)value; break;
    case TYPE_UINT8: ((uint8_t *)to)[k] = (uint8_t)value; break;
    case TYPE_INT16: ((int16_t *)to)[k] = (int16_t)value; break;
    case TYPE_UINT16: ((uint16_t *)to)[k] = (uint16_t)value; break;
    case TYPE_INT32: ((int32_t *)to)[k] = (int32_t)value; break;
    case TYPE_UINT32: ((uint32_t *)to)[k] = (uint32_t)value; break;
    case TYPE_INT64: ((int64_t *)to)[k] = (int64_t)value; break;
    default: ((uint64_t *)to)[k] = (uint64_t)value; break;
    }
    return 1;
}

/* A value that the FMU has given. */
static double taken(int type, const void *from, size_t k)
{
    switch (type) {
    case TYPE_FLOAT64: return ((const double *)from)[k];
    case TYPE_FLOAT32: return (double)((const float *)from)[k];
    case TYPE_BOOLEAN: case TYPE_BYTE: return ((const uint8_t *)from)[k] != 0; /* any bit is true */
    case TYPE_INT8: return ((const int8_t *)from)[k];
    case TYPE_UINT8: return ((const uint8_t *)from)[k];
    case TYPE_INT16: return ((const int16_t *)from)[k];
    case TYPE_UINT16: return ((const uint16_t *)from)[k];
    case TYPE_INT32: return ((const int32_t *)from)[k];
    case TYPE_UINT32: return ((const uint32_t *)from)[k];
    default: return ((const Cell *)from)[k].number; /* the bits, whatever the sign */
    }
}

const Call *take_steps_3(const Hand *hand, const Group *group, double time, double step, int *status)
{
    DoStep3 do_step = (DoStep3)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        int found;
        note_call(hand, call);
        if (!take_step_3(do_step, call->component, call->told, time, step, !group->is_late, &found) || is_failure(found)) {
            *status = found;
            return call;
        }
    }
    return group->end;
}

const Call *set_3(const Hand *hand, const Group *group, double time, int *status)
{
    Set set = (Set)group->function;
    for (const Call *call = group->begin; call < group->end; call++) {
        for (size_t k = 0; k < group->count; k++) {
            if (!put(hand->plan, &call->entries[k], time, group->type, hand->reals, k)) {
                *status = 0;
                return call;
            }
        }
        note_call(hand, call);
        *status = group->type == TYPE_BYTE
                      ? ((SetBytes)group->function)(call->component, group->references, group->count, hand->reals)
                      : set(call->component, group->references, group->reference_count, hand->reals, group->count);
        if (is_failure(*status)) {
            return call;
        }
    }
    return group->end;
}

const Call *get_3(const Hand *hand, const Group *group, int *status)
{
    Get get = (Get)group->function;
    int is_real = group->type == TYPE_FLOAT64 || group->type == TYPE_FLOAT32;
    for (const Call *call = group->begin; call < group->end; call++) {
        note_call(hand, call);
        *status = group->type == TYPE_BYTE
                      ? ((GetBytes)group->function)(call->component, group->references, group->count, hand->reals)
                      : get(call->component, group->references, group->reference_count, hand->reals, group->count);
        if (is_failure(*status)) {
            return call;
        }
        int finite = 1;
        for (size_t k = 0; k < group->count; k++) {
            double value = taken(group->type, hand->reals, k);
            hand->plan->values[call->entries[k].place] = value;
            finite &= group->is_unseen || !is_real || isfinite(value);
        }
        if (!finite) {
            return call;
        }
    }
    return group->end;
}
