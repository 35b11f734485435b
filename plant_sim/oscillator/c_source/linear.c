/* z'' = gain u - damping z' - stiffness z over a step, exactly, with u the parabola through its start, middle and end:
   the exponential of the system with the parabola's coefficients as further states. */
#define TERMS_OF_SERIES 19

static void multiply(double a[5][5], double b[5][5], double factor, double out[5][5])
{
    double made[5][5];
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < 5; j++) {
            double sum = 0.0;
            for (int k = 0; k < 5; k++) sum += a[i][k] * b[k][j];
            made[i][j] = sum * factor;
        }
    }
    memcpy(out, made, sizeof made);
}

static void prepare(propagator *e, double h, double gain, double damping, double stiffness)
{
    static const double taylor[3][3] = {{1.0, 0.0, 0.0}, {-3.0, 4.0, -1.0}, {4.0, -8.0, 4.0}};
    double m[5][5] = {{0.0}}, r[5][5] = {{0.0}}, norm = 0.0;
    if (e->h == h && e->gain == gain && e->damping == damping && e->stiffness == stiffness) return;
    e->h = h;
    e->gain = gain;
    e->damping = damping;
    e->stiffness = stiffness;
    const double root = sqrt(fabs(stiffness)), rate = root > 1e-3 / h ? root : 1e-3 / h;
    m[0][1] = h * rate;
    m[1][0] = -h * stiffness / rate;
    m[1][1] = -h * damping;
    m[1][2] = m[2][3] = m[3][4] = 1.0; /* u, du/ds, d2u/ds2 over s = t / h */
    for (int i = 0; i < 5; i++) {
        double sum = 0.0;
        for (int j = 0; j < 5; j++) sum += fabs(m[i][j]);
        norm = sum > norm ? sum : norm;
    }
    const int squarings = norm > 1.0 ? (int)ceil(log2(norm)) : 0;
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < 5; j++) m[i][j] = ldexp(m[i][j], -squarings);
        r[i][i] = 1.0;
    }
    for (int k = TERMS_OF_SERIES; k > 0; k--) {
        multiply(m, r, 1.0 / k, r);
        for (int i = 0; i < 5; i++) r[i][i] += 1.0;
    }
    for (int k = 0; k < squarings; k++) multiply(r, r, 1.0, r);
    const double scale[2] = {1.0, rate};
    for (int i = 0; i < 2; i++) {
        for (int j = 0; j < 2; j++) e->linear[2 * i + j] = r[i][j] * scale[i] / scale[j];
        for (int c = 0; c < 3; c++) {
            double sum = 0.0;
            for (int k = 0; k < 3; k++) sum += r[i][2 + k] * taylor[k][c];
            e->weights[3 * i + c] = sum * (h * gain / rate) * scale[i];
        }
    }
}

static void propagate(const propagator *e, const double *u, double *z, double *v)
{
    const double z1 = *z, v1 = *v;
    *z = (e->weights[0] * u[0] + e->weights[1] * u[1] + e->weights[2] * u[2] + e->linear[0] * z1) + e->linear[1] * v1;
    *v = (e->weights[3] * u[0] + e->weights[4] * u[1] + e->weights[5] * u[2] + e->linear[2] * z1) + e->linear[3] * v1;
}
