/* One integration step of the equations; states, inputs and parameters in SI base units. */
#define STATES PLANT_STATES
#define INPUTS PLANT_AT_LEAST_ONE(PLANT_INPUTS)

typedef struct {
    double u[3][INPUTS]; /* inputs at the start, middle and end */
    double h;            /* length [s] */
    double t;            /* time at its start [s] */
    const double *p;     /* parameters */
} step;

/* Puts states back that are beyond a limit; NaN stays. */
static void within(double *x)
{
    for (int r = 0; r < STATES; r++) {
        x[r] = x[r] < low[r] ? low[r] : x[r];
        x[r] = x[r] > high[r] ? high[r] : x[r];
    }
}
