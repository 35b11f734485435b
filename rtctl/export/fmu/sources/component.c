#include "component.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "variables.h" /* places, kinds, names, starts: written for this plant */

static const char *problem(component *c, unsigned reference, const char *text)
{
    const char *name = reference < VARIABLES ? names[reference] : "?";
    snprintf(c->problem, sizeof c->problem, "variable %u (%s): %s", reference, name, text);
    return c->problem;
}

static double *place(component *c, unsigned reference)
{
    return (double *)&c->s.m + places[reference];
}

/* Brings states and outputs up to date; while initializing, the plant starts anew from what was set. */
static const char *refresh(component *c)
{
    if (!c->stale) return 0;
    const char *wrong = c->s.mode != STEPPING ? plant_start(&c->s.m) : plant_read(&c->s.m);
    c->stale = wrong != 0;
    return wrong;
}

const char *component_get(component *c, const unsigned *references, size_t count, double *values)
{
    const char *wrong = refresh(c);
    if (wrong) return wrong;
    for (size_t k = 0; k < count; k++) {
        if (references[k] >= VARIABLES) return problem(c, references[k], "there is no such variable");
        values[k] = *place(c, references[k]);
        if (references[k] == TIME_REFERENCE) values[k] += c->s.origin;
    }
    return 0;
}

const char *component_set(component *c, const unsigned *references, size_t count, const double *values)
{
    for (size_t k = 0; k < count; k++) {
        const unsigned at = references[k];
        if (at >= VARIABLES) return problem(c, at, "there is no such variable");
        if (kinds[at] == COMPUTED) return problem(c, at, "is computed by the model and cannot be set");
        if (kinds[at] == START && c->s.mode == STEPPING) {
            return problem(c, at, "is the value at the start and can be set before the simulation alone");
        }
        if (!(fabs(values[k]) < 1e300)) return problem(c, at, "must be a finite number");
        if (kinds[at] == STEP_LENGTH && !(values[k] > 0.0)) return problem(c, at, "must be above 0 s");
        if (kinds[at] == TUNABLE && !(values[k] >= lows[at] && values[k] <= highs[at])) {
            return problem(c, at, "is beyond its limits, min and max in the description");
        }
    }
    for (size_t k = 0; k < count; k++) {
        *place(c, references[k]) = values[k];
        if (kinds[references[k]] == INPUT) {
            c->s.m.level[references[k] - FIRST_INPUT] = values[k];
        }
    }
    c->stale = 1;
    return 0;
}

void component_reset(component *c)
{
    memset(c, 0, sizeof *c);
    for (unsigned k = 0; k < VARIABLES; k++) *place(c, k) = starts[k];
    memcpy(c->s.m.level, c->s.m.input, sizeof c->s.m.level);
    c->s.mode = INSTANTIATED;
    c->stale = 1;
}

const char *component_initialize(component *c, double start)
{
    c->s.origin = start;
    c->s.mode = INITIALIZING;
    c->stale = 1;
    return 0;
}

const char *component_begin(component *c)
{
    const char *wrong = plant_start(&c->s.m);
    c->s.mode = STEPPING;
    c->stale = 0;
    return wrong;
}

const char *component_step(component *c, double now, double h)
{
    if (c->s.mode != STEPPING) return "a step was asked for before the initialization was left";
    if (!(h > 0.0) || !(h < 1e300)) return "the communication step must be above 0 s and finite";
    if (!(fabs(now) < 1e300)) return "the communication point must be finite";
    c->s.m.time = now - c->s.origin;
    c->stale = 0;
    return plant_advance(&c->s.m, h);
}

static const char *filled(void **copy, const void *bytes)
{
    if (!*copy) *copy = malloc(COPY_BYTES);
    if (!*copy) return "there is no memory for a copy of the state";
    memcpy(*copy, bytes, COPY_BYTES);
    return 0;
}

const char *component_copy(const component *c, void **copy) { return filled(copy, &c->s); }

const char *component_restore(component *c, const void *copy)
{
    if (!copy) return "there is no state to restore";
    memcpy(&c->s, copy, COPY_BYTES);
    c->stale = 1; /* inputs may have been set between the last outputs and the copy */
    return 0;
}

void component_free_copy(void **copy)
{
    if (!copy) return;
    free(*copy);
    *copy = 0;
}

const char *component_serialize(const void *copy, void *bytes, size_t size)
{
    if (size < COPY_BYTES) return "the array for the serialised state is too short";
    memcpy(bytes, copy, COPY_BYTES);
    return 0;
}

const char *component_deserialize(void **copy, const void *bytes, size_t size)
{
    if (size != COPY_BYTES) return "a serialised state of another size is not of this FMU";
    return filled(copy, bytes);
}
