/* Physics of the film; equations and names are those of plant_sim/vo2 (heating, relays, resistance, deflection). */
#include "film.h"
#include <string.h>

#define KELVIN 273.15f

static struct {
    float temperature_degC;
    float fraction[FILM_TRANSITIONS];           /* switched domains over all */
    uint32_t warmed[FILM_TRANSITIONS];          /* number of t_up at or below the field */
    uint32_t warm[FILM_TRANSITIONS];            /* number of t_down below the field */
    uint32_t switched[FILM_TRANSITIONS];
    uint32_t noise;                             /* state of the random numbers */
} state;

/* e^x: x = n ln 2 + r, and a polynomial of e^r (S. L. Moshier, Cephes library, expf). Not from libm: boards then give
 * the same bits. The relative error is below 2e-7; x is limited to what float32 holds. */
static float exponential(float x)
{
    x = x < -87.0f ? -87.0f : x > 88.0f ? 88.0f : x;
    int32_t n = (int32_t)(1.44269504f * x + (x < 0.0f ? -0.5f : 0.5f));
    float r = x - (float)n * 0.693359375f + (float)n * 2.12194440e-4f; /* ln 2 in two parts */
    float p = 1.9875691500e-4f;
    p = p * r + 1.3981999507e-3f;
    p = p * r + 8.3334519073e-3f;
    p = p * r + 4.1665795894e-2f;
    p = p * r + 1.6666665459e-1f;
    p = p * r + 5.0000001201e-1f;
    uint32_t bits = (uint32_t)(n + 127) << 23; /* 2^n as IEEE 754 */
    float power;
    memcpy(&power, &bits, sizeof power);
    return (p * r * r + r + 1.0f) * power;
}

/* Square root of x > 0 by Heron's iteration, from within 7 % (half of the exponent); each step squares the error. */
static float square_root(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    bits = (bits >> 1) + 0x1FC00000u;
    float root;
    memcpy(&root, &bits, sizeof root);
    for (int k = 0; k < 3; k++)
        root = 0.5f * (root + x / root);
    return root;
}

static int is_up(const film_domains *d, uint32_t domain)
{
    return d->is_up[domain / 8] >> domain % 8 & 1;
}

static void flip(const film_domains *d, uint32_t domain)
{
    d->is_up[domain / 8] ^= (uint8_t)(1u << domain % 8);
}

/* Switch the domains of one transition to the temperature: up where the field is at or above t_up, down where it is at
 * or below t_down. Neighbours pull each other along, so it is repeated until none switches. Only domains that the two
 * counters pass can switch. */
static void settle(int transition)
{
    const film_domains *d = &film.domains[transition];
    uint32_t warmed = state.warmed[transition], warm = state.warm[transition], switched = state.switched[transition];
    uint32_t before;
    do {
        before = switched;
        float field = state.temperature_degC + film.coupling_K * ((float)switched / (float)film.count - 0.5f);
        for (; warmed < film.count && d->t_up[warmed] <= field; warmed++)
            if (!is_up(d, warmed)) {
                flip(d, warmed);
                switched++;
            }
        while (warmed > 0 && d->t_up[warmed - 1] > field)
            warmed--;
        for (; warm > 0 && d->t_down[warm - 1] >= field; warm--)
            if (is_up(d, d->by_t_down[warm - 1])) {
                flip(d, d->by_t_down[warm - 1]);
                switched--;
            }
        while (warm < film.count && d->t_down[warm] < field)
            warm++;
    } while (switched != before);
    state.warmed[transition] = warmed;
    state.warm[transition] = warm;
    state.switched[transition] = switched;
    state.fraction[transition] = (float)switched / (float)film.count;
}

/* tau dT/dt = ambient + gain i^2 - T is solved exactly over a hold. The temperature is monotone within one, so the
 * domains are right at its end. */
void film_hold(float current_mA, uint32_t duration_us)
{
    float steady_degC = film.ambient_degC + film.gain_K_per_mA2 * current_mA * current_mA;
    float decay = exponential(-1e-6f * (float)duration_us / film.time_constant_s);
    state.temperature_degC = steady_degC + (state.temperature_degC - steady_degC) * decay;
    settle(FILM_ELECTRICAL);
    settle(FILM_STRUCTURAL);
}

void film_reset(void)
{
    memset(&state, 0, sizeof state);
    for (int transition = 0; transition < FILM_TRANSITIONS; transition++)
        memset(film.domains[transition].is_up, 0, (film.count + 7) / 8);
    state.temperature_degC = film.ambient_degC;
    state.noise = 2463534242u; /* any number but 0 */
    settle(FILM_ELECTRICAL);
    settle(FILM_STRUCTURAL);
}

/* True resistance [ohm]: a semiconductor R_s = R_0 exp(E_a / kT) mixed with a metal by the fraction that has switched. */
static float resistance(void)
{
    float metallic = state.fraction[FILM_ELECTRICAL];
    float ln_semiconductor = film.ln_prefactor + film.activation_K / (state.temperature_degC + KELVIN);
    if (film.mixing == FILM_LOGARITHMIC)
        return exponential((1.0f - metallic) * ln_semiconductor + metallic * film.ln_metal);
    float semiconductor = exponential(ln_semiconductor), metal = exponential(film.ln_metal), d = film.dimension;
    if (film.mixing == FILM_SERIES)
        return (1.0f - metallic) * semiconductor + metal;
    float g_s = 1.0f / semiconductor, g_m = 1.0f / metal; /* Bruggeman: the positive root of a quadratic */
    float b = (d * metallic - 1.0f) * g_m + (d * (1.0f - metallic) - 1.0f) * g_s;
    return 2.0f * (d - 1.0f) / (b + square_root(b * b + 4.0f * (d - 1.0f) * g_m * g_s));
}

/* A random number of mean 0 and standard deviation 1: the sum of four uniform ones (G. Marsaglia's xorshift, 2003). */
static float normal(void)
{
    int32_t sum = 0;
    for (int k = 0; k < 2; k++) {
        state.noise ^= state.noise << 13;
        state.noise ^= state.noise >> 17;
        state.noise ^= state.noise << 5;
        sum += (int32_t)(state.noise & 0xFFFFu) + (int32_t)(state.noise >> 16) - 0xFFFF;
    }
    return (float)sum * (1.7320508f / 65536.0f); /* four have the variance 4/12 */
}

float film_read_resistance(void)
{
    float voltage_V = resistance() * film.sense_A + film.white_V * normal();
    if (film.converter_counts > 0.0f) {
        float half = film.converter_counts, step_V = film.converter_V / half, counts = voltage_V / step_V;
        counts = counts < -half ? -half : counts > half - 1.0f ? half - 1.0f : counts;
        voltage_V = step_V * (float)(int32_t)(counts + (counts < 0.0f ? -0.5f : 0.5f));
    }
    return voltage_V / film.sense_A;
}

float film_read_deflection(void)
{
    float rise_K = state.temperature_degC - film.ambient_degC;
    return film.rest_um + film.stroke_um * state.fraction[FILM_STRUCTURAL] + film.expansion_um_per_K * rise_K
           + film.reference_um * normal();
}
