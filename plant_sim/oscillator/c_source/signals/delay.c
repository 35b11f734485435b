/* A delayed input: the communication steps that the delay holds, as begin, level and slope of each. */
#define TEXT(x) #x
#define NUMBER(x) TEXT(x)
#define FORGOTTEN(name) \
    name ".delay holds more communication steps than the unit keeps (" NUMBER(KEPT) "); take longer ones"

typedef struct {
    double count, first; /* steps so far; level before the first */
    double begins[KEPT], levels[KEPT], slopes[KEPT];
} line;

static void push(line *d, double t, double level, double slope)
{
    const int at = (int)d->count % KEPT;
    if (d->count == 0.0) d->first = level;
    d->begins[at] = t;
    d->levels[at] = level;
    d->slopes[at] = slope;
    d->count += 1.0;
    if (d->count >= 1073741824.0) d->count = KEPT + fmod(d->count, KEPT); /* it stays an int */
}

static double level_of(const line *d, int k, double t)
{
    return k < 0 ? d->first : d->levels[k % KEPT] + d->slopes[k % KEPT] * (t - d->begins[k % KEPT]);
}

/* Sets the input at start, middle and end of a step from t on; where it jumps within, to the parabola that has the same
   first three moments, or to one that stays `within` the levels of the jump. Returns 0 where what it needs is forgotten. */
static int delayed(const line *d, double t, double h, double delay, int within, double *u)
{
    const double from = t - delay, near = 1e-9 * h;
    const int count = (int)d->count, oldest = count > KEPT ? count - KEPT : 0;
    int k = count - 1;
    while (k >= oldest && d->begins[k % KEPT] > from + near) k--;
    if (k < oldest && oldest > 0) return 0;
    for (int c = 0; c < 3; c++) u[c] = level_of(d, k, from + 0.5 * c * h);
    for (; k + 1 < count && d->begins[(k + 1) % KEPT] < from + h - near; k++) {
        const double corner = d->begins[(k + 1) % KEPT], share = (corner - from) / h;
        const double jump = d->levels[(k + 1) % KEPT] - level_of(d, k, corner);
        const double kink = d->slopes[(k + 1) % KEPT] - (k < 0 ? 0.0 : d->slopes[k % KEPT]);
        double before[3] = {
            share * (9.0 + share * (10.0 * share - 18.0)),
            share * (-1.5 + share * (7.5 - 5.0 * share)),
            share * (3.0 + share * (10.0 * share - 12.0)),
        };
        if (within) {
            before[0] = 1.0;
            before[1] = cut(1.5 * share - 0.25, 0.0, 1.0);
            before[2] = 0.0;
        }
        for (int c = 0; c < 3; c++) {
            const double since = from + 0.5 * c * h - corner;
            u[c] += jump * (1.0 - before[c]) + (since > 0.0 ? kink * since : 0.0);
        }
    }
    return 1;
}
