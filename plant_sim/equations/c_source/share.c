/* Inputs at a share of a step, on the parabola through its start, middle and end. */
static void at_share(const step *s, double share, double *u)
{
    const double first = (1.0 - share) * (1.0 - 2.0 * share);
    const double middle = 4.0 * share * (1.0 - share), last = share * (2.0 * share - 1.0);
    for (int k = 0; k < PLANT_INPUTS; k++) u[k] = first * s->u[0][k] + middle * s->u[1][k] + last * s->u[2][k];
    if (PLANT_INPUTS == 0) u[0] = 0.0;
}
