/* Whether what solves algebraic loops points into Python's arrays. */

#include "../plan.h"
#include "solving.h"

enum { MOST = 1 << 20 }; /* elements of an array */

/* What a term may be: of an input, of a value that is solved for, of what a function is asked for. */
static int is_term(const Term *term, int64_t limit, int64_t width)
{
    return term->of >= 0 && term->of < limit && term->count >= 1 && term->count <= MOST && term->element >= 0 &&
           term->element < width;
}

/* A party, but for its operations; and the room that its function is called with. */
static int is_party(Plan *plan, const Py_buffer *buffers, const Party *party, const Solver *of)
{
    size_t terms = length(buffers, TERMS), room = 0, whole = 0;
    if (!is_within(party->term, party->known_count, terms) || party->row_count < 0 ||
        party->whole_count < 0 || !is_within(party->term + party->known_count, party->row_count, terms) ||
        !is_within(party->term + party->known_count + party->row_count, party->whole_count, terms)) {
        return 0;
    }
    const Term *term = (const Term *)buffers[TERMS].buf + party->term;
    int64_t entries = (int64_t)length(buffers, ENTRIES);
    for (int64_t k = 0; k < party->known_count; k++, term++) {
        if (!is_term(term, entries, term->count) ||
            !is_entry(plan, &plan->entries[term->of], length(buffers, CHANGES))) {
            return 0;
        }
        room += (size_t)term->count;
    }
    for (int64_t k = 0; k < party->whole_count; k++) {
        if (!is_term(&term[party->row_count + k], 1, 1)) {
            return 0;
        }
        whole += (size_t)term[party->row_count + k].count;
    }
    for (int64_t k = 0; k < party->row_count; k++, term++) {
        if (!is_term(term, of->real_count, party->function == 0 ? MOST : (int64_t)whole)) {
            return 0;
        }
    }
    size_t integers = (size_t)(party->whole_count + 2 * party->known_count);
    room = room + whole > integers ? room + whole : integers;
    plan->largest = room > plan->largest ? room : plan->largest;
    return 1;
}

/* Whether a party's operations are among those that its solver does, and none of them leads elsewhere. */
static int are_its_own(const Operation *all, const Party *party, const Solver *of)
{
    return party->writing >= of->evaluating && party->writing <= party->written && party->written <= of->deriving &&
           party->reading >= of->evaluating && party->reading <= party->read && party->read <= of->deriving &&
           (party->function == 0 ||
            (party->ask >= of->deriving && party->ask < of->end && all[party->ask].kind == OPERATION_ASK));
}

int resolve_solver(Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    const Operation *all = buffers[OPERATIONS].buf;
    size_t passed = length(buffers, PASSED);
    if (plan->thread_count != 1 || !is_within(operation->index, 1, length(buffers, SOLVERS))) {
        return 0;
    }
    const Solver *of = &plan->solvers[operation->index];
    if (of->real_count < 0 || of->other_count < 0 || !is_within(of->begin, of->real_count, passed) ||
        !is_within(of->begin + of->real_count, of->other_count, passed) || of->party_count < 0 ||
        !is_within(of->party, of->party_count, length(buffers, PARTIES)) ||
        !is_within(of->work, (int64_t)work_of_solver(plan, of), length(buffers, WORK)) ||
        of->evaluating <= operation - all || of->deriving < of->evaluating || of->end < of->deriving ||
        (uint64_t)of->end > length(buffers, OPERATIONS)) {
        return 0;
    }
    for (int64_t k = 0; k < of->real_count + of->other_count; k++) {
        if (!is_within(plan->passed[of->begin + k], 1, plan->value_count)) {
            return 0;
        }
    }
    for (const Operation *own = operation + 1; own < all + of->end; own++) {
        if (own->kind == OPERATION_SOLVE || (own->kind >= OPERATION_BEGIN && own->kind <= OPERATION_END)) {
            return 0;
        }
    }
    for (int64_t k = 0; k < of->party_count; k++) {
        const Party *party = &plan->parties[of->party + k];
        if (!is_party(plan, buffers, party, of) || !are_its_own(all, party, of)) {
            return 0;
        }
    }
    group->kind = SOLVE;
    call->solver = of;
    plan->head = plan->work + of->work;
    return 1;
}

int resolve_ask(const Plan *plan, const Py_buffer *buffers, const Operation *operation, Group *group, Call *call)
{
    if (!is_within(operation->index, 1, length(buffers, PARTIES))) {
        return 0;
    }
    const Party *party = &plan->parties[operation->index];
    group->kind = ASK;
    group->function = (uintptr_t)party->function;
    call->component = (void *)(uintptr_t)party->component;
    return group->function != 0;
}
