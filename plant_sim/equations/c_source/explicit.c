/* Runge-Kutta of order 4 (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1, table 1.2). A state
   that is at a limit when the step begins, and whose rate points beyond it, stays there for the step. */
static void runge_kutta(double *x, const step *s)
{
    double a[STATES], b[STATES], c[STATES], d[STATES], y[STATES];
    int at_low[STATES], at_high[STATES];
    const double half = 0.5 * s->h, sixth = s->h / 6.0;

    rates(x, s->u[0], s->t, s->p, a);
    for (int r = 0; r < STATES; r++) {
        at_low[r] = x[r] <= low[r] && a[r] < 0.0;
        at_high[r] = x[r] >= high[r] && a[r] > 0.0;
    }
#define KEEP(k) \
    for (int r = 0; r < STATES; r++) { \
        if ((at_low[r] && k[r] < 0.0) || (at_high[r] && k[r] > 0.0)) k[r] = 0.0; \
    }
    KEEP(a)
    for (int r = 0; r < STATES; r++) y[r] = x[r] + half * a[r];
    rates(y, s->u[1], s->t + half, s->p, b);
    KEEP(b)
    for (int r = 0; r < STATES; r++) y[r] = x[r] + half * b[r];
    rates(y, s->u[1], s->t + half, s->p, c);
    KEEP(c)
    for (int r = 0; r < STATES; r++) y[r] = x[r] + s->h * c[r];
    rates(y, s->u[2], s->t + s->h, s->p, d);
    KEEP(d)
#undef KEEP
    for (int r = 0; r < STATES; r++) x[r] += sixth * (a[r] + 2.0 * (b[r] + c[r]) + d[r]);
    within(x);
}
