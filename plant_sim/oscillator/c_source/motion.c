/* All that an oscillator remembers; doubles alone. */
#define OWN (OWN_STATES > 0 ? OWN_STATES : 1)
typedef struct {
    double z, v;               /* displacement, velocity */
    double w[OWN];             /* states of the mechanisms in the equation */
    double begun;              /* 1 once a step was done */
    double drive_lag, play;    /* the drive behind a lag; behind a play */
    double q, q_rate;          /* second mode, per unit of its gain */
    double slow;               /* what the high-pass takes off */
    double passed[2];          /* what reaches the high-pass: value, slope */
    double behind;             /* reading behind the lag */
    double reached[2];         /* what reaches the lag: value, slope */
    double reading, velocity;  /* what the sensor is shown */
#ifdef HAS_ACTUATOR_HYSTERESIS
    turning_points hysteresis; /* of the drive */
#endif
#ifdef HAS_DRIVE_DELAY
    line drive;                /* the drive of the last communication steps */
#endif
    propagator exact, mode;    /* of the last step's length */
} motion;

typedef char memory_fits[sizeof(motion) <= sizeof(((plant *)0)->memory) ? 1 : -1];
