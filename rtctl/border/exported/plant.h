/* A plant: inputs, outputs, parameters and all that it remembers, in doubles. No heap, no globals. */
#ifndef PLANT_H
#define PLANT_H

/* plant_sizes.h: PLANT_INPUTS, PLANT_OUTPUTS, PLANT_STATES, PLANT_PARAMETERS, PLANT_MEMORY */
#include "plant_sizes.h"

#define PLANT_AT_LEAST_ONE(n) ((n) > 0 ? (n) : 1)

typedef struct {
    double time;         /* since the start [s] */
    double longest_step; /* of the integrator [s] */
    double input[PLANT_AT_LEAST_ONE(PLANT_INPUTS)];         /* in their units */
    double slope[PLANT_AT_LEAST_ONE(PLANT_INPUTS)];         /* of each input until the end of the step, per second */
    double level[PLANT_AT_LEAST_ONE(PLANT_INPUTS)];         /* of each input now */
    double parameter[PLANT_AT_LEAST_ONE(PLANT_PARAMETERS)]; /* in their units */
    double initial[PLANT_AT_LEAST_ONE(PLANT_STATES)];       /* states at the start, in their units */
    double state[PLANT_AT_LEAST_ONE(PLANT_STATES)];         /* states now, in their units */
    double output[PLANT_AT_LEAST_ONE(PLANT_OUTPUTS)];       /* in their units */
    double memory[PLANT_AT_LEAST_ONE(PLANT_MEMORY)];
} plant;

/* All return 0, or a text that says what is wrong. */
const char *plant_start(plant *m);               /* sets the memory from `initial`, `parameter` and `input` */
const char *plant_advance(plant *m, double h);   /* moves by h [s]; the inputs are input + slope * (time passed) */
const char *plant_read(plant *m);                /* sets `state` and `output` from the memory and `level` */

#endif
