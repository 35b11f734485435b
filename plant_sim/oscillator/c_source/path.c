/* The drive before it reaches the equation, and the sensor behind the motion. */
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
    for (int c = 0; c < 3; c++) u[c] -= cut(u[c], -DRIVE_DEADBAND_WIDTH, DRIVE_DEADBAND_WIDTH);
#endif
#ifdef HAS_DRIVE_SATURATION
    for (int c = 0; c < 3; c++) u[c] *= langevin(sqrt(DRIVE_SATURATION_CURVATURE) * u[c]);
    for (int c = 0; c < 3; c++) {
        u[c] -= DRIVE_SATURATION_CLIPPED * (u[c] - cut(u[c], -DRIVE_SATURATION_LIMIT, DRIVE_SATURATION_LIMIT));
    }
#endif
#ifdef HAS_DRIVE_HARMONICS
    for (int c = 0; c < 3; c++) u[c] += u[c] * u[c] * (DRIVE_HARMONICS_SECOND + DRIVE_HARMONICS_THIRD * u[c]);
#endif
#ifdef HAS_DRIVE_LAG
    if (s->begun == 0.0) s->drive_lag = DRIVE_LAG_SETTLED * u[0];
    through_lag(u, h / DRIVE_LAG_TIME_CONSTANT, &s->drive_lag);
#endif
#ifdef HAS_ACTUATOR_BACKLASH
    for (int c = 0; c < 3; c++) {
        s->play = cut(s->play, u[c] - ACTUATOR_BACKLASH_WIDTH, u[c] + ACTUATOR_BACKLASH_WIDTH);
        u[c] = s->play;
    }
#endif
#ifdef HAS_ACTUATOR_HYSTERESIS
    if (s->begun == 0.0) {
        arrive(&s->hysteresis, u[0], ACTUATOR_HYSTERESIS_REMANENCE, ACTUATOR_HYSTERESIS_DENSITY,
               ACTUATOR_HYSTERESIS_FADING);
    }
    for (int c = 0; c < 3; c++) {
        u[c] += turned(&s->hysteresis, u[c], ACTUATOR_HYSTERESIS_DENSITY, ACTUATOR_HYSTERESIS_FADING);
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
    z = bent(z, SENSOR_SATURATION_CURVATURE, SENSOR_SATURATION_CLIPPED, SENSOR_SATURATION_LIMIT);
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
    if (SENSOR_QUANTISATION_STEP > 0.0) {
        z = SENSOR_QUANTISATION_LEVEL + SENSOR_QUANTISATION_STEP *
            rint((z - SENSOR_QUANTISATION_LEVEL) / SENSOR_QUANTISATION_STEP);
    }
#endif
    return z;
}
