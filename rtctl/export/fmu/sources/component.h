/* A plant between the calls of a simulator: its variables by their value references, its mode, its state. */
#ifndef COMPONENT_H
#define COMPONENT_H

#include <stddef.h>

#include "plant.h"

#define FIRST_INPUT 1 /* value reference of the first input: the time has 0 */

typedef enum { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED } component_mode;

/* What is saved and restored: the plant is all doubles, so its bytes are the serialised state. */
typedef struct {
    plant m;
    double origin; /* simulator's time at the start [s] */
    double mode;
} component_state;

#define COPY_BYTES sizeof(component_state)

typedef struct {
    component_state s;
    int stale;         /* whether an input or a parameter changed since outputs were computed */
    char problem[240]; /* the last message */
} component;

/* These return 0, or a text that says what is wrong; it lives as long as the component. */
const char *component_get(component *c, const unsigned *references, size_t count, double *values);
const char *component_set(component *c, const unsigned *references, size_t count, const double *values);
const char *component_initialize(component *c, double start);
const char *component_begin(component *c);
const char *component_step(component *c, double now, double h);

/* A copy of the state: made where *copy is 0, else overwritten; put back; freed; to and from COPY_BYTES bytes. */
const char *component_copy(const component *c, void **copy);
const char *component_restore(component *c, const void *copy);
void component_free_copy(void **copy);
const char *component_serialize(const void *copy, void *bytes, size_t size);
const char *component_deserialize(void **copy, const void *bytes, size_t size);

/* Sets all variables to their start values. */
void component_reset(component *c);

#endif
