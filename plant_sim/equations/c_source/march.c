/* The plant: its memory is the states in SI units, then the signs of what its events watch, then the signals'. */
#ifndef EVENTS
#define SIDES 0
#else
#define SIDES EVENTS
#endif

/* Of a step, along which slopes are taken: of outputs linear in states and inputs they are exact with any. */
#define NUDGE 0x1p-13

#ifdef SIGNALS
typedef char signals_fit[(STATES + SIDES) * sizeof(double) + sizeof(signals) <= sizeof(((plant *)0)->memory) ? 1 : -1];
#endif

static void si_parameters(const plant *m, double *p)
{
    for (int k = 0; k < PLANT_PARAMETERS; k++) p[k] = m->parameter[k] * parameter_factors[k];
}

/* Inputs at start, middle and end of a step, `passed` into the communication step; those at its end last. */
static const char *si_inputs(plant *m, double passed, double h, double (*u)[INPUTS])
{
    (void)m; (void)passed; (void)h;
    for (int n = 0; n < 3; n++) u[n][0] = 0.0;
    for (int n = 0; n < 3; n++) {
        for (int k = 0; k < PLANT_INPUTS; k++) u[n][k] = m->input[k] + m->slope[k] * (passed + 0.5 * n * h);
    }
#ifdef SIGNALS
    const char *wrong = input_paths((signals *)(m->memory + STATES + SIDES), m->parameter, m->time + passed, h, u);
    if (wrong) return wrong;
#endif
    for (int n = 0; n < 3; n++) {
        for (int k = 0; k < PLANT_INPUTS; k++) u[n][k] *= input_factors[k];
    }
    return 0;
}

/* Outputs in their units under the inputs in SI units. */
static void own_outputs(const double *x, const double *u, double t, const double *p, double *y)
{
    outputs(x, u, t, p, y);
    for (int k = 0; k < PLANT_OUTPUTS; k++) y[k] /= output_factors[k];
}

#ifdef FILTERS
/* Outputs in their units under inputs in SI units, and their slopes, by a nudge [s] along the motion. */
static void output_course(
    const plant *m, const double *u, const double *later, double nudge, double t, const double *p,
    double (*y)[PLANT_OUTPUTS])
{
    double rate[STATES], moved[STATES];
    own_outputs(m->memory, u, t, p, y[0]);
    limited_rates(m->memory, u, t, p, rate);
    for (int r = 0; r < STATES; r++) moved[r] = m->memory[r] + nudge * rate[r];
    own_outputs(moved, later, t + nudge, p, y[1]);
    for (int k = 0; k < PLANT_OUTPUTS; k++) y[1][k] = (y[1][k] - y[0][k]) / nudge;
}
#endif

const char *plant_start(plant *m)
{
    double p[PLANT_AT_LEAST_ONE(PLANT_PARAMETERS)], u[3][INPUTS];
    memset(m->memory, 0, sizeof m->memory);
    for (int r = 0; r < STATES; r++) m->memory[r] = m->initial[r] * state_factors[r];
    within(m->memory);
    m->time = 0.0;
    memcpy(m->level, m->input, sizeof m->level);
    si_parameters(m, p);
    const char *wrong = si_inputs(m, 0.0, 0.0, u);
    if (wrong) return wrong;
#ifdef EVENTS
    guards(m->memory, u[0], 0.0, p, m->memory + STATES);
    for (int e = 0; e < EVENTS; e++) m->memory[STATES + e] = sign_of(m->memory[STATES + e]);
#endif
#ifdef FILTERS
    double y[4][PLANT_OUTPUTS] = {{0.0}};
    own_outputs(m->memory, u[0], 0.0, p, y[2]);
    instruments_between((signals *)(m->memory + STATES + SIDES), m->parameter, 0.0, y);
#endif
    return plant_read(m);
}

const char *plant_advance(plant *m, double h)
{
    double p[PLANT_AT_LEAST_ONE(PLANT_PARAMETERS)], *x = m->memory;
    const double wanted = ceil(h / m->longest_step - 1e-9);
    if (wanted > 1e8) return "longest_step is too short for this communication step";
    const long steps = wanted > 1.0 ? (long)wanted : 1;
    step s;

    si_parameters(m, p);
    s.h = h / steps;
    s.p = p;
#ifdef SIGNALS
    signals *of_signals = (signals *)(m->memory + STATES + SIDES);
    remember_inputs(of_signals, m);
#endif
    for (long i = 0; i < steps; i++) {
        s.t = m->time + i * s.h;
        const char *wrong = si_inputs(m, i * s.h, s.h, s.u);
        if (wrong) return wrong;
#ifdef FILTERS
        const double nudge = NUDGE * s.h;
        double y[4][PLANT_OUTPUTS], after[INPUTS], before[INPUTS];
        for (int k = 0; k < INPUTS; k++) {
            const double change = NUDGE * (s.u[2][k] - s.u[0][k]);
            after[k] = s.u[0][k] + change;
            before[k] = s.u[2][k] - change;
        }
        output_course(m, s.u[0], after, nudge, s.t, p, y);
#endif
#ifdef EVENTS
        if (!carry_on(m, x, &s)) return "events follow each other without end within one step";
#else
        one_step(x, &s);
#endif
#ifdef FILTERS
        output_course(m, s.u[2], before, -nudge, s.t + s.h, p, y + 2);
        instruments_between(of_signals, m->parameter, s.h, y);
#endif
    }
    m->time += h;
    for (int k = 0; k < PLANT_INPUTS; k++) m->level[k] = m->input[k] + m->slope[k] * h;
    for (int r = 0; r < STATES; r++) {
        if (!(fabs(x[r]) < 1e100)) return "the motion has no bound: a state is not finite";
    }
    return plant_read(m);
}

const char *plant_read(plant *m)
{
    double p[PLANT_AT_LEAST_ONE(PLANT_PARAMETERS)], u[INPUTS] = {0.0}, y[PLANT_OUTPUTS];
    si_parameters(m, p);
    for (int k = 0; k < PLANT_INPUTS; k++) u[k] = m->level[k] * input_factors[k];
#ifdef SIGNALS
    const signals *of_signals = (const signals *)(m->memory + STATES + SIDES);
    inputs_behind(of_signals, m->parameter, m->level, m->time, u);
#endif
    own_outputs(m->memory, u, m->time, p, y);
#ifdef SIGNALS
    outputs_behind(of_signals, y);
    instruments(m->parameter, m->time, y);
#endif
    for (int k = 0; k < PLANT_OUTPUTS; k++) m->output[k] = y[k];
    for (int r = 0; r < STATES; r++) m->state[r] = m->memory[r] / state_factors[r];
    return 0;
}
