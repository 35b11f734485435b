/* The Runge-Kutta step of plant_sim/oscillator/rk4.py on the nominal Duffing oscillator in plain C, to time ours against.
 *
 * z'' = gain u - damping z' - (stiffness + cubic z^2) z, the drive given at the start, the middle and the end of each
 * step; p (4, lanes): gain, damping, stiffness, cubic, one column a lane. Row 0 of the outputs is the start.
 */
#include <stddef.h>

static inline double force(double z, double v, double u, double g, double d, double k, double c)
{
    return g * u - d * v - (k + c * (z * z)) * z;
}

void one_trajectory(double *z, double *v, const double *nodes, size_t steps, double h, size_t substeps,
                    const double *p, double *out_z, double *out_v)
{
    const double half = 0.5 * h, sixth = h / 6.0, g = p[0], d = p[1], k = p[2], c = p[3];
    double z1 = *z, v1 = *v;
    size_t row = 0, until_sample = substeps;
    out_z[0] = z1, out_v[0] = v1;
    for (size_t i = 0; i < steps; i++) {
        const double u1 = nodes[3 * i], u2 = nodes[3 * i + 1], u4 = nodes[3 * i + 2];
        const double a1 = force(z1, v1, u1, g, d, k, c);
        const double z2 = z1 + half * v1, v2 = v1 + half * a1, a2 = force(z2, v2, u2, g, d, k, c);
        const double z3 = z1 + half * v2, v3 = v1 + half * a2, a3 = force(z3, v3, u2, g, d, k, c);
        const double z4 = z1 + h * v3, v4 = v1 + h * a3, a4 = force(z4, v4, u4, g, d, k, c);
        z1 += sixth * (v1 + 2.0 * (v2 + v3) + v4);
        v1 += sixth * (a1 + 2.0 * (a2 + a3) + a4);
        if (--until_sample == 0) {
            until_sample = substeps;
            row++;
            out_z[row] = z1, out_v[row] = v1;
        }
    }
    *z = z1, *v = v1;
}

void many_lanes(double *restrict z, double *restrict v, const double *restrict nodes, size_t steps, double h,
                size_t substeps, const double *restrict p, double *restrict out_z, double *restrict out_v, size_t lanes)
{
    const double half = 0.5 * h, sixth = h / 6.0;
    const double *restrict g = p, *restrict d = p + lanes, *restrict k = p + 2 * lanes, *restrict c = p + 3 * lanes;
    size_t row = 0, until_sample = substeps;
    for (size_t j = 0; j < lanes; j++)
        out_z[j] = z[j], out_v[j] = v[j];
    for (size_t i = 0; i < steps; i++) {
        const double u1 = nodes[3 * i], u2 = nodes[3 * i + 1], u4 = nodes[3 * i + 2];
        for (size_t j = 0; j < lanes; j++) {
            const double z1 = z[j], v1 = v[j], a1 = force(z1, v1, u1, g[j], d[j], k[j], c[j]);
            const double z2 = z1 + half * v1, v2 = v1 + half * a1, a2 = force(z2, v2, u2, g[j], d[j], k[j], c[j]);
            const double z3 = z1 + half * v2, v3 = v1 + half * a2, a3 = force(z3, v3, u2, g[j], d[j], k[j], c[j]);
            const double z4 = z1 + h * v3, v4 = v1 + h * a3, a4 = force(z4, v4, u4, g[j], d[j], k[j], c[j]);
            z[j] = z1 + sixth * (v1 + 2.0 * (v2 + v3) + v4);
            v[j] = v1 + sixth * (a1 + 2.0 * (a2 + a3) + a4);
        }
        if (--until_sample == 0) {
            until_sample = substeps;
            row++;
            for (size_t j = 0; j < lanes; j++)
                out_z[row * lanes + j] = z[j], out_v[row * lanes + j] = v[j];
        }
    }
}
