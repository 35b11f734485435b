/* What a signal goes through on its way to the equations and behind them; by numbers, for any signal. */
#define SERIES_BELOW 4.0
#define SERIES_TERMS 40

/* Response at the end of a step of x' = steps (s^k - x), x = 0 at first, s from 0 to 1, for k up to `degree`; and the
   integrals of x, s x and s^2 x. By a series where the closed form loses its digits. */
static inline void lag_response(double steps, int degree, double *end, double (*moments)[3])
{
    for (int k = 0; k <= degree; k++) {
        if (steps < SERIES_BELOW) {
            double term = 1.0;
            end[k] = moments[k][0] = moments[k][1] = moments[k][2] = 0.0;
            for (int j = 1; j <= SERIES_TERMS; j++) {
                term *= -steps / (k + j);
                end[k] -= term;
                for (int i = 0; i < 3; i++) moments[k][i] -= term / (k + j + i + 1.0);
            }
            continue;
        }
        double before = 0.0;
        end[k] = k == 0 ? -expm1(-steps) : 1.0 - k / steps * end[k - 1];
        for (int i = 0; i < 3; i++) {
            before = 1.0 / (k + i + 1) - (end[k] - i * before) / steps;
            moments[k][i] = before;
        }
    }
}

/* What is behind a lag after an interval of so many time constants, the cubic through value and slope before it. */
static inline double follow(
    double behind, double constants, double interval, const double *before, double value, double slope)
{
    double end[4], moments[4][3];
    lag_response(constants, 3, end, moments);
    const double w0 = end[0] - 3.0 * end[2] + 2.0 * end[3], w1 = end[1] - 2.0 * end[2] + end[3];
    const double w2 = 3.0 * end[2] - 2.0 * end[3], w3 = end[3] - end[2];
    return (1.0 - end[0]) * behind + w0 * before[0] + w1 * interval * before[1] + w2 * value + w3 * interval * slope;
}

/* An input at start, middle and end of a step of so many time constants, behind a lag of state x: the parabola that has
   the first three moments of the lag's output. */
static inline void through_lag(double *u, double steps, double *x)
{
    static const double parabola[3][3] = {{1.0, 0.0, 0.0}, {-3.0, 4.0, -1.0}, {2.0, -4.0, 2.0}};
    static const double of_moments[3][3] = {{9.0, -36.0, 30.0}, {-1.5, 15.0, -15.0}, {3.0, -24.0, 30.0}};
    double end[3], moments[3][3], c[3] = {0.0, 0.0, 0.0}, sums[3], after = 0.0;
    lag_response(steps, 2, end, moments);
    for (int k = 0; k < 3; k++) {
        for (int n = 0; n < 3; n++) c[k] += parabola[k][n] * u[n];
        after += end[k] * c[k];
    }
    for (int i = 0; i < 3; i++) {
        sums[i] = *x * (1.0 / (i + 1) - moments[0][i]);
        for (int k = 0; k < 3; k++) sums[i] += c[k] * moments[k][i];
    }
    for (int n = 0; n < 3; n++) {
        u[n] = of_moments[n][0] * sums[0] + of_moments[n][1] * sums[1] + of_moments[n][2] * sums[2];
    }
    *x = (1.0 - end[0]) * *x + after;
}

/* A drift over its first rate [s]; without a settling time it goes on and on. */
static inline double drifted(double time, double settling)
{
    return settling == 0.0 ? time : -settling * expm1(-time / settling);
}

static inline double cut(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

/* Compressed where it is large, or cut off. */
static inline double bent(double z, double curvature, double clipped, double limit)
{
    if (curvature > 0.0) z = tanh(sqrt(curvature) * z) / sqrt(curvature);
    return clipped > 0.0 ? z - clipped * (z - cut(z, -limit, limit)) : z;
}
