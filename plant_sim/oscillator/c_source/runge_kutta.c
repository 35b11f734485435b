/* Runge-Kutta of order 4 at a fixed step (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1),
   of the velocity and what dampers that act at some places alone have taken from it. */
static void integrate(motion *s, const double *u, double t, double h, const double *p)
{
    const double half = 0.5 * h, sixth = h / 6.0;
    const double z1 = s->z, v1 = s->v, q1 = v1 + impulse(z1, p);
    double d1[OWN], d2[OWN], d3[OWN], d4[OWN], w[OWN];

    double a1 = acceleration(z1, v1, u[0], t, s->w, p, d1);
#ifdef RUBS
    const double held = resistance(v1, a1, p);
    a1 -= held;
#define FRICTION_AT(x) within_step(held, v1, x, p)
#else
#define FRICTION_AT(x) 0.0
#endif
    const double z2 = z1 + half * v1, v2 = (q1 + half * a1) - impulse(z2, p);
    for (int k = 0; k < OWN_STATES; k++) w[k] = s->w[k] + half * d1[k];
    const double a2 = acceleration(z2, v2, u[1], t + half, w, p, d2) - FRICTION_AT(v2);
    const double z3 = z1 + half * v2, v3 = (q1 + half * a2) - impulse(z3, p);
    for (int k = 0; k < OWN_STATES; k++) w[k] = s->w[k] + half * d2[k];
    const double a3 = acceleration(z3, v3, u[1], t + half, w, p, d3) - FRICTION_AT(v3);
    const double z4 = z1 + h * v3, v4 = (q1 + h * a3) - impulse(z4, p);
    for (int k = 0; k < OWN_STATES; k++) w[k] = s->w[k] + h * d3[k];
    const double a4 = acceleration(z4, v4, u[2], t + h, w, p, d4) - FRICTION_AT(v4);
    s->z = z1 + sixth * (v1 + 2.0 * (v2 + v3) + v4);
    s->v = (q1 + sixth * (a1 + 2.0 * (a2 + a3) + a4)) - impulse(s->z, p);
    for (int k = 0; k < OWN_STATES; k++) s->w[k] += sixth * (d1[k] + 2.0 * (d2[k] + 1.0 * d3[k]) + 1.0 * d4[k]);
#ifdef RUBS
    settle(&s->z, &s->v, z1, v1, a1, a4, held, h, p);
#endif
}
