/* The drive before it reaches the equation, and the sensor behind the motion. */
#if defined HAS_DRIVE_LAG || defined HAS_SENSOR_LAG || defined HAS_SENSOR_HIGHPASS
#define SERIES_BELOW 4.0
#define SERIES_TERMS 40

/* Response at the end of a step of x' = steps (s^k - x), x = 0 at first, s from 0 to 1, for k up to `degree`; and the
   integrals of x, s x and s^2 x. By a series where the closed form loses its digits. */
static void lag_response(double steps, int degree, double *end, double (*moments)[3])
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
#endif

#if defined HAS_SENSOR_LAG || defined HAS_SENSOR_HIGHPASS
/* What is behind a lag after an interval of so many time constants, the cubic through value and slope before it. */
static double follow(double behind, double constants, double interval, const double *before, double value, double slope)
{
    double end[4], moments[4][3];
    lag_response(constants, 3, end, moments);
    const double w0 = end[0] - 3.0 * end[2] + 2.0 * end[3], w1 = end[1] - 2.0 * end[2] + end[3];
    const double w2 = 3.0 * end[2] - 2.0 * end[3], w3 = end[3] - end[2];
    return (1.0 - end[0]) * behind + w0 * before[0] + w1 * interval * before[1] + w2 * value + w3 * interval * slope;
}
#endif

#if defined HAS_INPUT_GAIN_DRIFT || defined HAS_SENSOR_DRIFT
/* A drift over its first rate [s]; without a settling time it goes on and on. */
static double drifted(double time, double settling)
{
    return settling == 0.0 ? time : -settling * expm1(-time / settling);
}
#endif

static void drive_path(motion *s, const double *value, double t, double h, double *u)
{
    (void)s; (void)value; (void)t; (void)h; (void)u;
#ifdef HAS_INPUT_GAIN_DRIFT
    for (int c = 0; c < 3; c++) u[c] *= 1.0 + INPUT_GAIN_DRIFT_RATE * drifted(t + 0.5 * c * h, INPUT_GAIN_DRIFT_SETTLING_TIME);
#endif
#ifdef HAS_DRIVE_OFFSET
    for (int c = 0; c < 3; c++) u[c] += DRIVE_OFFSET_OFFSET;
#endif
#ifdef HAS_DRIVE_DEADBAND
    for (int c = 0; c < 3; c++) u[c] -= most(least(u[c], DRIVE_DEADBAND_WIDTH), -DRIVE_DEADBAND_WIDTH);
#endif
#ifdef HAS_DRIVE_SATURATION
    for (int c = 0; c < 3; c++) u[c] *= langevin(sqrt(DRIVE_SATURATION_CURVATURE) * u[c]);
    for (int c = 0; c < 3; c++) {
        u[c] -= DRIVE_SATURATION_CLIPPED * (u[c] - most(least(u[c], DRIVE_SATURATION_LIMIT), -DRIVE_SATURATION_LIMIT));
    }
#endif
#ifdef HAS_DRIVE_HARMONICS
    for (int c = 0; c < 3; c++) u[c] += u[c] * u[c] * (DRIVE_HARMONICS_SECOND + DRIVE_HARMONICS_THIRD * u[c]);
#endif
#ifdef HAS_DRIVE_LAG
    {   /* each parabola has the first three moments of the lag's output */
        static const double parabola[3][3] = {{1.0, 0.0, 0.0}, {-3.0, 4.0, -1.0}, {2.0, -4.0, 2.0}};
        static const double of_moments[3][3] = {{9.0, -36.0, 30.0}, {-1.5, 15.0, -15.0}, {3.0, -24.0, 30.0}};
        double end[3], moments[3][3], made[3], c[3] = {0.0, 0.0, 0.0}, sums[3], after = 0.0;
        lag_response(h / DRIVE_LAG_TIME_CONSTANT, 2, end, moments);
        if (s->begun == 0.0) s->drive_lag = DRIVE_LAG_SETTLED * u[0];
        for (int k = 0; k < 3; k++) {
            for (int n = 0; n < 3; n++) c[k] += parabola[k][n] * u[n];
            after += end[k] * c[k];
        }
        for (int i = 0; i < 3; i++) {
            sums[i] = s->drive_lag * (1.0 / (i + 1) - moments[0][i]);
            for (int k = 0; k < 3; k++) sums[i] += c[k] * moments[k][i];
        }
        for (int n = 0; n < 3; n++) {
            made[n] = of_moments[n][0] * sums[0] + of_moments[n][1] * sums[1] + of_moments[n][2] * sums[2];
        }
        s->drive_lag = (1.0 - end[0]) * s->drive_lag + after;
        memcpy(u, made, sizeof made);
    }
#endif
#ifdef HAS_ACTUATOR_BACKLASH
    for (int c = 0; c < 3; c++) {
        s->play = least(most(s->play, u[c] - ACTUATOR_BACKLASH_WIDTH), u[c] + ACTUATOR_BACKLASH_WIDTH);
        u[c] = s->play;
    }
#endif
}

/* One step of the second mode beside the first. */
static void second_mode(motion *s, const double *value, double h, const double *u)
{
    (void)s; (void)value; (void)h; (void)u;
#ifdef HAS_MODE_SECOND
    const double rate = 2.0 * 3.141592653589793 * MODE_SECOND_FREQUENCY;
    prepare(&s->mode, h, 1.0, 2.0 * MODE_SECOND_DAMPING_RATIO * rate, rate * rate);
    propagate(&s->mode, u, &s->q, &s->q_rate);
#endif
}

/* The sensor's parts with memory, an interval after they were looked at last; 0 at the start. */
static void sense(motion *s, const double *value, double interval)
{
    double z = s->z, slope = s->v;
    (void)value; (void)interval; (void)slope;
    s->velocity = s->v;
#ifdef HAS_MODE_SECOND
    z += MODE_SECOND_GAIN * s->q;
    slope += MODE_SECOND_GAIN * s->q_rate;
    s->velocity = slope;
#endif
#ifdef HAS_SENSOR_HIGHPASS
    if (interval > 0.0) {
        s->slow = follow(s->slow, interval * SENSOR_HIGHPASS_RATE, interval, s->passed, z, slope);
    } else {
        s->slow = 0.0;
    }
    s->passed[0] = z;
    s->passed[1] = slope;
    z -= s->slow;
    slope -= SENSOR_HIGHPASS_RATE * z;
#endif
#ifdef HAS_SENSOR_LAG
    if (interval > 0.0) {
        s->behind = follow(s->behind, interval / SENSOR_LAG_TIME_CONSTANT, interval, s->reached, z, slope);
    } else {
        s->behind = z;
    }
    s->reached[0] = z;
    s->reached[1] = slope;
    z = s->behind;
#endif
    s->reading = z;
}

/* The sensor's parts without memory. */
static double reading(double z, const double *value, double t)
{
    (void)value; (void)t;
#ifdef HAS_SENSOR_SATURATION
    if (SENSOR_SATURATION_CURVATURE > 0.0) {
        const double root = sqrt(SENSOR_SATURATION_CURVATURE);
        z = tanh(root * z) / root;
    }
    if (SENSOR_SATURATION_CLIPPED > 0.0) {
        z -= SENSOR_SATURATION_CLIPPED * (z - most(least(z, SENSOR_SATURATION_LIMIT), -SENSOR_SATURATION_LIMIT));
    }
#endif
#ifdef HAS_SENSOR_OFFSET
    z += SENSOR_OFFSET_OFFSET;
#endif
#ifdef HAS_SENSOR_HUM
    const double angle = 2.0 * 3.141592653589793 * SENSOR_HUM_FREQUENCY * t;
    z += SENSOR_HUM_COSINE * cos(angle) + SENSOR_HUM_SINE * sin(angle);
#endif
#ifdef HAS_SENSOR_DRIFT
    z += SENSOR_DRIFT_RATE * drifted(t, SENSOR_DRIFT_SETTLING_TIME);
#endif
#ifdef HAS_SENSOR_QUANTISATION
    z = SENSOR_QUANTISATION_LEVEL + SENSOR_QUANTISATION_STEP *
        rint((z - SENSOR_QUANTISATION_LEVEL) / SENSOR_QUANTISATION_STEP);
#endif
    return z;
}
