/* A Runge-Kutta step from one share of a step to another. */
static void part_of_step(double *x, const step *s, double begin, double end)
{
    double k[4][STATES], y[STATES], u[INPUTS];
    const double h = (end - begin) * s->h, t = s->t + begin * s->h;
    for (int stage = 0; stage < 4; stage++) {
        const double share = stage == 0 ? 0.0 : stage == 3 ? 1.0 : 0.5;
        for (int r = 0; r < STATES; r++) y[r] = x[r] + (stage > 0 ? share * h * k[stage - 1][r] : 0.0);
        at_share(s, begin + share * (end - begin), u);
        limited_rates(y, u, t + share * h, s->p, k[stage]);
    }
    for (int r = 0; r < STATES; r++) x[r] += h / 6.0 * (k[0][r] + 2.0 * (k[1][r] + k[2][r]) + k[3][r]);
}
