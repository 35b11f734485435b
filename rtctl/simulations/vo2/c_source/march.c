/* Heating by the current's square, tau s' = i^2 - s, exact for a current that is a straight line over the step; the
   film's resistance and the beam's deflection follow sqrt(s) with hysteresis. All that is remembered is doubles. */
typedef struct {
    double begun; /* 1 once a step was done */
    double s;     /* surrogate of the temperature: the square of the current that holds it [mA^2] */
    relays film, beam;
} memory;

typedef char memory_fits[sizeof(memory) <= sizeof(((plant *)0)->memory) ? 1 : -1];

static double corrected(double x, double middle, double gain, double offset)
{
    return gain == 1.0 && offset == 0.0 ? x : x + (gain - 1.0) * (x - middle) + offset;
}

#ifdef HAS_SENSOR_QUANTISATION
/* The nearest of levels that are a step apart; no step, no levels. */
static double nearest(double x, double step, double level)
{
    return step > 0.0 ? level + step * rint((x - level) / step) : x;
}
#endif

#if defined HAS_INPUT_GAIN_DRIFT || defined HAS_SENSOR_DRIFT
/* A drift over its first rate [s]; without a settling time it goes on and on. */
static double drifted(double time, double settling)
{
    return settling == 0.0 ? time : -settling * expm1(-time / settling);
}
#endif

#ifdef HAS_SENSOR_AGEING
/* A drift that slows down over its first rate [s]; without a slowing time it goes on and on. */
static double slowed(double time, double slowing)
{
    return slowing == 0.0 ? time : slowing * log1p(time / slowing);
}
#endif

static double heating_current(const plant *m, double passed)
{
    const double *value = m->parameter;
    double current = m->input[0] + m->slope[0] * passed;
#ifdef HAS_INPUT_GAIN_DRIFT
    current *= 1.0 + INPUT_GAIN_DRIFT_RATE * drifted(m->time + passed, INPUT_GAIN_DRIFT_SETTLING_TIME);
#endif
    return corrected(current, CURRENT_MIDDLE, CURRENT_GAIN, CURRENT_OFFSET);
}

static double relax(double s, double start, double middle, double end, double h, double tau)
{
    const double decay = exp(-h / tau), to_middle = middle - start, to_end = end - start;
    const double b = 4.0 * to_middle - to_end, c = 2.0 * to_end - 4.0 * to_middle;
    if (b == 0.0 && c == 0.0) return start + (s - start) * decay;
    const double r = tau / h, B = b - 2.0 * r * c, A = start - r * B;
    return A + B + c + (s - A) * decay;
}

static void settle(plant *m)
{
    memory *k = (memory *)m->memory;
    const double current = heating_current(m, 0.0);
    k->s = current * current;
    cool(&k->film, &film);
    cool(&k->beam, &beam);
    follow(&k->film, sqrt(k->s), &film);
    follow(&k->beam, sqrt(k->s), &beam);
}

const char *plant_start(plant *m)
{
    memset(m->memory, 0, sizeof m->memory);
    m->time = 0.0;
    settle(m);
    return plant_read(m);
}

const char *plant_advance(plant *m, double h)
{
    memory *k = (memory *)m->memory;
    const double *value = m->parameter;
    const double wanted = ceil(h / m->longest_step - 1e-9);
    const long steps = wanted > 1.0 ? (long)wanted : 1;
    const double step = h / steps;
    if (!(TIME_CONSTANT > 0.0)) return "time_constant must be above 0 s";
    if (k->begun == 0.0) settle(m); /* at rest in the current that the simulation begins with */
    k->begun = 1.0;
    for (long i = 0; i < steps; i++) {
        const double first = heating_current(m, i * step), middle = heating_current(m, (i + 0.5) * step);
        const double last = heating_current(m, (i + 1) * step);
        k->s = relax(k->s, first * first, middle * middle, last * last, step, TIME_CONSTANT);
        const double v = sqrt(k->s > 0.0 ? k->s : 0.0);
        follow(&k->film, v, &film);
        follow(&k->beam, v, &beam);
    }
    m->time += h;
    m->level[0] = m->input[0] + m->slope[0] * h;
    if (!(fabs(k->s) < 1e100)) return "the temperature is not finite";
    return plant_read(m);
}

const char *plant_read(plant *m)
{
    const memory *k = (const memory *)m->memory;
    const double *value = m->parameter;
    m->output[0] = exp(-corrected(value_of(&k->film, &film), READING_MIDDLE, RESISTANCE_GAIN, -RESISTANCE_OFFSET));
    m->output[1] = corrected(value_of(&k->beam, &beam), DEFLECTION_MIDDLE, DEFLECTION_GAIN, DEFLECTION_OFFSET);
#ifdef HAS_SENSOR_AGEING
    m->output[0] *= 1.0 + SENSOR_AGEING_RATE * slowed(m->time, SENSOR_AGEING_SLOWING_TIME);
#endif
#ifdef HAS_SENSOR_DRIFT
    m->output[1] += SENSOR_DRIFT_RATE * drifted(m->time, SENSOR_DRIFT_SETTLING_TIME);
#endif
#ifdef HAS_SENSOR_QUANTISATION
    m->output[0] = nearest(m->output[0], SENSOR_QUANTISATION_RESISTANCE, SENSOR_QUANTISATION_RESISTANCE_LEVEL);
    m->output[1] = nearest(m->output[1], SENSOR_QUANTISATION_DEFLECTION, SENSOR_QUANTISATION_DEFLECTION_LEVEL);
#endif
    m->output[2] = sqrt(k->s > 0.0 ? k->s : 0.0);
    return 0;
}
