const char *plant_start(plant *m)
{
    motion *s = (motion *)m->memory;
    memset(m->memory, 0, sizeof m->memory);
    m->time = 0.0;
    memcpy(m->level, m->input, sizeof m->level);
    s->z = m->initial[0];
    s->v = m->initial[1];
    start_own(s->z, s->v, s->w);
    sense(s, m->parameter, 0.0);
    return plant_read(m);
}

const char *plant_advance(plant *m, double h)
{
    motion *s = (motion *)m->memory;
    const double wanted = ceil(h / INSTANT - 1e-9);
    if (wanted > 1e8 || h / m->longest_step > 1e8) return "longest_step is too short for this communication step";
    const long instants = wanted > 1.0 ? (long)wanted : 1;
    const double finer = ceil(h / instants / m->longest_step - 1e-9);
    const long each = finer > 1.0 ? (long)finer : 1;
    const double step = h / (instants * each);
    double p[ROWS];

    fill_rows(m->parameter, step, p);
#ifdef HAS_DRIVE_DELAY
    const double *value = m->parameter;
    push(&s->drive, m->time, m->input[0], m->slope[0]);
#endif
    for (long i = 0; i < instants * each; i++) {
        const double t = m->time + i * step;
        double u[3];
        for (int c = 0; c < 3; c++) u[c] = m->input[0] + m->slope[0] * ((i + 0.5 * c) * step);
#ifdef HAS_DRIVE_DELAY
        if (!delayed(&s->drive, t, step, DRIVE_DELAY_DELAY, WITHIN, u)) return FORGOTTEN("drive.delay");
#endif
        drive_path(s, m->parameter, t, step, u);
        second_mode(s, m->parameter, step, u);
        integrate(s, u, t, step, p);
        s->begun = 1.0;
        if ((i + 1) % each == 0) sense(s, m->parameter, h / instants);
    }
    m->time += h;
    m->level[0] = m->input[0] + m->slope[0] * h;
    if (!(fabs(s->z) < 1e100)) return "the motion has no bound: the displacement is not finite";
    return plant_read(m);
}

const char *plant_read(plant *m)
{
    const motion *s = (const motion *)m->memory;
    m->state[0] = s->z;
    m->state[1] = s->v;
    m->output[0] = reading(s->reading, m->parameter, m->time);
    m->output[1] = s->velocity;
    return 0;
}
