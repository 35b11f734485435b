/* A VO2 film on a heated cantilever: current -> temperature -> relays -> resistance and deflection -> instruments.
 *
 * Its constants and tables come from the file of a simulated device (`rtctl firmware`, film_tables.c), so that the film
 * is the one that plant_sim/vo2 computes in double precision. Not here: the 1/f noise of the resistance.
 */
#ifndef FILM_H
#define FILM_H

#include <stdint.h>

enum { FILM_ELECTRICAL, FILM_STRUCTURAL, FILM_TRANSITIONS };
enum { FILM_LOGARITHMIC, FILM_BRUGGEMAN, FILM_SERIES }; /* mixing laws, in the order of plant_sim.vo2.resistance.Mixing */

typedef struct { /* domains of one transition */
    const float *t_up, *t_down;      /* switching temperatures [degC], ascending; domain j has the j-th t_up */
    const uint16_t *by_t_down;       /* domain that has the j-th t_down */
    uint8_t *is_up;                  /* one bit a domain: has switched to the metal, or to its structure */
} film_domains;

typedef struct {
    float ambient_degC, time_constant_s, gain_K_per_mA2;
    uint32_t count;                  /* of domains */
    float coupling_K;                /* rise of the field from none switched to all */
    film_domains domains[FILM_TRANSITIONS];
    int mixing;
    float ln_prefactor, activation_K, ln_metal, dimension; /* ln of ohm */
    float rest_um, stroke_um, expansion_um_per_K;
    float sense_A, white_V, converter_V, converter_counts, reference_um; /* counts to either side; 0: no converter */
} film_constants;

extern const film_constants film;

void film_reset(void);                              /* cold, as a full cooling leaves it */
void film_hold(float current_mA, uint32_t duration_us);
float film_read_resistance(void);                   /* [ohm], with noise, rounded by the converter */
float film_read_deflection(void);                   /* [um], with noise */

#endif
