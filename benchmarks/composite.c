/* The composite estimator step of rtctl/estimators/composite.py in plain C, to time the compiled kernel against.
 *
 * -R [kohm] -> analytic inverse of a GPI (equations 7 to 11, 14) -> surrogate [mA] -> EGPI (12, 15) -> deflection [um].
 * Zhang et al., IEEE/ASME Trans. Mechatronics 21(5), 2016. All parameters come at run time; states advance in place.
 */
#include <math.h>
#include <stddef.h>

typedef struct {
    size_t plays;                         /* of the inverse */
    const double *p_hat, *r_hat;          /* weights [1/kohm], radii [kohm] */
    double a_R, b_R, a_L, b_L, c;         /* envelopes tanh(a v + b), bias [kohm] */
    double y_limit, u_limit, deadband;    /* [kohm], [-], [kohm] */
    double low, high;                     /* clip of the surrogate [mA] */
    size_t egpi_plays;
    const double *p, *r, *ea_R, *eb_R, *ea_L, *eb_L; /* weights [um], radii [-], an envelope pair a play */
    double c2, c3, c4;                    /* c3 + c2 v + c4 v^2 [um] */
} rtctl_composite;

static double play(double w, double lower, double upper)
{
    if (w < lower)
        w = lower;
    if (w > upper)
        w = upper;
    return w;
}

/* state: the plays z, the last v, the branch (+1 heating, -1 cooling). */
static double inverse_step(const rtctl_composite *m, double *state, double y)
{
    size_t n = m->plays;
    double branch = state[n + 1], moves = 0.0, u = 0.0;
    if (isfinite(y)) {
        double offset = y - m->c;
        if (fabs(offset) >= m->y_limit)
            offset = copysign(m->y_limit, offset);
        double change = offset - state[0], along = change * branch;
        moves = along > 0.0 ? branch : along < -m->deadband ? -branch : 0.0;
        if (moves != 0.0) {
            for (size_t j = 0; j < n; j++)
                state[j] = play(state[j], offset - m->r_hat[j], offset + m->r_hat[j]);
            branch = moves;
        }
    }
    for (size_t j = 0; j < n; j++)
        u += m->p_hat[j] * state[j];
    u = fmin(fmax(u, -m->u_limit), m->u_limit);
    if (moves != 0.0)
        state[n] = branch > 0.0 ? (atanh(u) - m->b_R) / m->a_R : (atanh(u) - m->b_L) / m->a_L;
    state[n + 1] = branch;
    return state[n];
}

static double egpi_step(const rtctl_composite *m, double *w, double v)
{
    double y = m->c3 + v * (m->c2 + m->c4 * v);
    for (size_t j = 0; j < m->egpi_plays; j++) {
        double lower = tanh(m->ea_R[j] * v + m->eb_R[j]) - m->r[j];
        double upper = tanh(m->ea_L[j] * v + m->eb_L[j]) + m->r[j];
        w[j] = play(w[j], lower, upper);
        y += m->p[j] * w[j];
    }
    return y;
}

void rtctl_composite_run(const rtctl_composite *m, double *state, double *w, const double *resistance_ohm,
                         double *deflection_um, size_t samples)
{
    for (size_t k = 0; k < samples; k++) {
        double v = inverse_step(m, state, -1e-3 * resistance_ohm[k]);
        deflection_um[k] = egpi_step(m, w, fmin(fmax(v, m->low), m->high));
    }
}

/* What no implementation with this libm can go below: the twelve tanh and one atanh of a step, nothing else. */
double rtctl_libm_run(const rtctl_composite *m, const double *v, size_t samples)
{
    double sum = 0.0;
    for (size_t k = 0; k < samples; k++) {
        sum += atanh(0.1 * v[k]);
        for (size_t j = 0; j < m->egpi_plays; j++)
            sum += tanh(m->ea_R[j] * v[k] + m->eb_R[j]) + tanh(m->ea_L[j] * v[k] + m->eb_L[j]);
    }
    return sum;
}
