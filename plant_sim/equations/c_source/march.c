/* The plant: its memory is the states in SI units, then the signs of what its events watch. */
static void si_parameters(const plant *m, double *p)
{
    for (int k = 0; k < PLANT_PARAMETERS; k++) p[k] = m->parameter[k] * parameter_factors[k];
}

static void si_inputs(const plant *m, double passed, double *u)
{
    for (int k = 0; k < PLANT_INPUTS; k++) u[k] = (m->input[k] + m->slope[k] * passed) * input_factors[k];
    if (PLANT_INPUTS == 0) u[0] = 0.0;
}

const char *plant_start(plant *m)
{
    for (int r = 0; r < STATES; r++) m->memory[r] = m->initial[r] * state_factors[r];
    within(m->memory);
    m->time = 0.0;
    memcpy(m->level, m->input, sizeof m->level);
#ifdef EVENTS
    double p[PLANT_AT_LEAST_ONE(PLANT_PARAMETERS)], u[INPUTS];
    si_parameters(m, p);
    si_inputs(m, 0.0, u);
    guards(m->memory, u, 0.0, p, m->memory + STATES);
    for (int e = 0; e < EVENTS; e++) m->memory[STATES + e] = sign_of(m->memory[STATES + e]);
#endif
    return plant_read(m);
}

const char *plant_advance(plant *m, double h)
{
    double p[PLANT_AT_LEAST_ONE(PLANT_PARAMETERS)], *x = m->memory;
    const double wanted = ceil(h / m->longest_step - 1e-9);
    const long steps = wanted > 1.0 ? (long)wanted : 1;
    step s;

    si_parameters(m, p);
    s.h = h / steps;
    s.p = p;
    for (long i = 0; i < steps; i++) {
        s.t = m->time + i * s.h;
        for (int n = 0; n < 3; n++) si_inputs(m, (i + 0.5 * n) * s.h, s.u[n]);
#ifdef EVENTS
        if (!carry_on(m, x, &s)) return "events follow each other without end within one step";
#else
        one_step(x, &s);
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
    double p[PLANT_AT_LEAST_ONE(PLANT_PARAMETERS)], u[INPUTS], y[PLANT_OUTPUTS];
    si_parameters(m, p);
    for (int k = 0; k < PLANT_INPUTS; k++) u[k] = m->level[k] * input_factors[k];
    outputs(m->memory, u, m->time, p, y);
    for (int k = 0; k < PLANT_OUTPUTS; k++) m->output[k] = y[k] / output_factors[k];
    for (int r = 0; r < STATES; r++) m->state[r] = m->memory[r] / state_factors[r];
    return 0;
}
