/* The plant by the functions above. All that it remembers is reals, in plant.memory. */
typedef char memory_fits[sizeof(memory) == sizeof(((plant *)0)->memory) ? 1 : -1];

static const char *result(const memory *s)
{
    switch ((int)s->fault) {
    case 0: return 0;
    case 1: return "time_constant must be above 0 s";
    case 2: return "the temperature is not finite";
    case 4: return "longest_step is too short for this communication step";
    default: return "actuation.delay.delay holds more communication steps than the unit keeps (" KEPT "); take longer ones";
    }
}

const char *plant_start(plant *m)
{
    const Parameters now = parameters_of(m->parameter);
    memset(m->memory, 0, sizeof m->memory);
    m->time = 0.0;
    march_start((memory *)m->memory, m->input[0], &now, &CONSTANTS);
    return plant_read(m);
}

const char *plant_advance(plant *m, double h)
{
    const Parameters now = parameters_of(m->parameter);
    memory *s = (memory *)m->memory;
    march_advance(s, m->input[0], m->slope[0], h, m->longest_step, &now, &CONSTANTS);
    m->time += h;
    m->level[0] = m->input[0] + m->slope[0] * h;
    return s->fault != 0.0 ? result(s) : plant_read(m);
}

const char *plant_read(plant *m)
{
    const Parameters now = parameters_of(m->parameter);
    memory *s = (memory *)m->memory;
    march_look(s, m->level[0], &now, &CONSTANTS);
    m->output[0] = s->resistance;
    m->output[1] = s->deflection;
    m->output[2] = surrogate(s->power);
    return 0;
}
