/* A Prandtl-Ishlinskii operator from its turning points; see plant_sim.oscillator.integration.turning_points. */
typedef struct {
    double count, drive, heading; /* turning points; the last drive, and its direction */
    double at[2 * DEEPEST];       /* drive and value of each */
} turning_points;

static double rise_from_rest(double size, double density, double fading)
{
    const double x = fading * size;
    if (x < 1e-3) return density * size * size * (0.5 - x * (1.0 / 6.0 - x / 24.0));
    return density * (x + expm1(-x)) / (fading * fading);
}

static double branch(double u, double since, double held, double density, double fading)
{
    const double change = 2.0 * rise_from_rest(0.5 * fabs(u - since), density, fading);
    return u > since ? held + change : held - change;
}

static double on_branch(const turning_points *s, double u, double density, double fading)
{
    const int n = (int)s->count;
    if (n == 0) return copysign(rise_from_rest(fabs(u), density, fading), u);
    return branch(u, s->at[2 * n - 2], s->at[2 * n - 1], density, fading);
}

/* Begin at the drive `first`, with what one turning point before has left beside what that drive does from rest. */
static void arrive(turning_points *s, double first, double remanence, double density, double fading)
{
    memset(s, 0, sizeof(*s));
    s->drive = first;
    s->heading = first > 0.0 ? 1.0 : first < 0.0 ? -1.0 : 0.0;
    if (remanence == 0.0 || density == 0.0) return;
    const double way = remanence > 0.0 ? 1.0 : -1.0, rested = on_branch(s, first, density, fading);
    double low = fabs(first), high = low + 4.0 * sqrt(fabs(remanence) / density);
    if (fading > 0.0 && high < low + 50.0 / fading) high = low + 50.0 / fading;
    for (int k = 0; k < 60; k++) {
        const double size = 0.5 * (low + high);
        const double left = branch(first, way * size, way * rise_from_rest(size, density, fading), density, fading);
        if (fabs(left - rested) < fabs(remanence)) low = size;
        else high = size;
    }
    s->count = 1.0;
    s->heading = -way;
    s->at[0] = way * 0.5 * (low + high);
    s->at[1] = way * rise_from_rest(0.5 * (low + high), density, fading);
}

/* What the operator gives at the drive u, after all before. */
static double turned(turning_points *s, double u, double density, double fading)
{
    if (u != s->drive) {
        const double ahead = u > s->drive ? 1.0 : -1.0;
        int n = (int)s->count;
        if (ahead * s->heading < 0.0 && n < DEEPEST) {
            const double held = on_branch(s, s->drive, density, fading);
            s->at[2 * n] = s->drive;
            s->at[2 * n + 1] = held;
            n++;
        }
        s->heading = ahead;
        while (n > 1) {
            const double turn = s->at[2 * n - 2], before = s->at[2 * n - 4], way = turn > before ? 1.0 : -1.0;
            if (way * (u - before) <= 0.0) n -= 2;
            else if (way * (u - turn) >= 0.0) n -= 1; /* after a turn that was one too many */
            else break;
        }
        if (n == 1 && fabs(u) >= fabs(s->at[0])) n = 0;
        s->count = n;
        s->drive = u;
    }
    return on_branch(s, u, density, fading);
}
