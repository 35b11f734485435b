/* Strang splitting: the damped linear part exactly, the nonlinear force of position as half kicks before and after
   (Hairer, Lubich, Wanner, Geometric Numerical Integration, II.5). */
static double kick(double z, double h, const double *p)
{
    const double zz = z * z;
    return (h * p[QUADRATIC] + z * (h * p[CUBIC] + h * p[QUINTIC] * zz)) * zz;
}

static void integrate(motion *s, const double *u, double t, double h, const double *p)
{
    (void)t;
    prepare(&s->exact, h, p[GAIN], p[DAMPING_TERM], p[STIFFNESS_TERM]);
    s->v -= 0.5 * kick(s->z, h, p);
    propagate(&s->exact, u, &s->z, &s->v);
    s->v -= 0.5 * kick(s->z, h, p);
}
