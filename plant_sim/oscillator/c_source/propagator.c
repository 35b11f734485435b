/* A linear oscillator's exact step: see linear.c. */
typedef struct {
    double h, gain, damping, stiffness; /* what it was computed for */
    double linear[4], weights[6];       /* of (z, v), and of the drive at start, middle, end: z's, then v's */
} propagator;

