/* Events within a step: where an expression passes zero, states are set anew and the step goes on from there. The share
   of the step is enclosed by ITP (Oliveira, Takahashi, ACM Trans. Math. Software 47 (2020) 5), each trial being a step
   of the integrator's own kind. The values after an event are those on the side on which the motion goes on. */
#define LOCATED 1e-12    /* width to which the share of a step is enclosed */
#define MOST_EVENTS 1000 /* in a step, beyond which they are taken to follow each other without end */
#define PROBE 1e-3       /* share of a step over which the slope of an expression is taken */
#define CURVATURE 0.2    /* kappa1 of ITP; kappa2 is 2 */
#define SLACK 1.0        /* n0 of ITP */
#define FARTHEST 1e300   /* value beyond which an expression is taken to be no larger */

typedef struct {
    double g[EVENTS];     /* expressions where events take place */
    int fires[EVENTS];    /* whether an event takes place */
    double after[STATES]; /* states after the events */
} taking_place;

static double sign_of(double g)
{
    return g > 0.0 ? 1.0 : g < 0.0 ? -1.0 : 0.0;
}

static void move(const double *x, const step *s, double begin, double end, double *moved)
{
    memcpy(moved, x, STATES * sizeof *x);
    part_of_step(moved, s, begin, end);
    within(moved);
}

static void watch(const double *x, const step *s, double share, double *g)
{
    double u[INPUTS];
    at_share(s, share, u);
    guards(x, u, s->t + share * s->h, s->p, g);
}

/* How far the nearest of the expressions is from an event; below 0 it is beyond it. */
static double left_of(const double *side, const double *g)
{
    double least = HUGE_VAL;
    for (int e = 0; e < EVENTS; e++) {
        if (side[e] != 0.0 && side[e] * directions[e] <= 0.0 && side[e] * g[e] < least) least = side[e] * g[e];
    }
    return least;
}

/* Change of an expression along the rates. */
static double slope_of(const double *x, const step *s, double share, int e)
{
    double u[INPUTS], rate[STATES], moved[STATES], here[EVENTS], there[EVENTS];
    at_share(s, share, u);
    limited_rates(x, u, s->t + share * s->h, s->p, rate);
    for (int r = 0; r < STATES; r++) moved[r] = x[r] + PROBE * s->h * rate[r];
    watch(x, s, share, here);
    watch(moved, s, share + PROBE, there);
    return there[e] - here[e];
}

/* The states after all events that take place at x. */
static void set_states(const double *x, const step *s, double share, taking_place *now)
{
    double u[INPUTS], sets[EVENTS * STATES];
    for (int k = 0; k < EVENTS * STATES; k++) sets[k] = NAN;
    at_share(s, share, u);
    resets(x, u, s->t + share * s->h, s->p, sets);
    for (int r = 0; r < STATES; r++) {
        now->after[r] = x[r];
        for (int e = 0; e < EVENTS; e++) {
            if (now->fires[e] && !isnan(sets[e * STATES + r])) now->after[r] = sets[e * STATES + r];
        }
    }
    within(now->after);
}

/* Marks which events take place and returns the first, -1 without any; the other expressions change sides. */
static int mark(double *side, taking_place *now)
{
    int first = -1;
    for (int e = 0; e < EVENTS; e++) {
        const double g = now->g[e];
        now->fires[e] = side[e] * g < 0.0 && side[e] * directions[e] <= 0.0;
        if (now->fires[e]) {
            first = first < 0 ? e : first;
        } else if (g != 0.0 && !isnan(g)) {
            side[e] = sign_of(g);
        }
    }
    return first;
}

/* Shares of the step between which the first event lies; `last` is what is left at its end. */
static void enclose(const double *side, const double *x, const step *s, double begin, double last, double *before,
                    double *beyond)
{
    double g[EVENTS], here[STATES];
    watch(x, s, begin, g);
    double a = begin, b = 1.0, at_a = left_of(side, g), at_b = last;
    at_a = at_a > 0.0 ? at_a : 0.0;
    const double width = b - a;
    double halvings = ceil(log2(width / LOCATED));
    halvings = (halvings > 0.0 ? halvings : 0.0) + SLACK;
    while (b - a > LOCATED) {
        const double half = 0.5 * (a + b), most = 0.5 * (LOCATED * exp2(halvings) - (b - a));
        double found = (at_a * b - at_b * a) / (at_a - at_b);
        const double toward = half >= found ? 1.0 : -1.0, by = CURVATURE / width * (b - a) * (b - a);
        found = by <= fabs(half - found) ? found + toward * by : half;
        if (!(fabs(found - half) <= most)) found = half - toward * most;
        if (!(a < found && found < b) || halvings < 0.0) found = half;
        halvings -= 1.0;
        move(x, s, begin, found, here);
        watch(here, s, found, g);
        const double left = left_of(side, g);
        if (left < 0.0) {
            b = found;
            at_b = left > -FARTHEST ? left : -FARTHEST;
        } else {
            a = found;
            at_a = left < FARTHEST ? left : FARTHEST;
        }
    }
    *before = a;
    *beyond = b;
}

/* Goes on from x at a share of the step to its end, then returns -1, or to the first event and the states after it. */
static int to_event(double *side, double *x, const step *s, double *share, taking_place *now)
{
    double there[STATES], before, beyond;
    for (int e = 0; e < EVENTS; e++) {
        if (side[e] == 0.0) side[e] = sign_of(slope_of(x, s, *share, e));
    }
    move(x, s, *share, 1.0, there);
    watch(there, s, 1.0, now->g);
    const double last = left_of(side, now->g);
    if (!(last < 0.0)) {
        mark(side, now);
        memcpy(x, there, sizeof there);
        *share = 1.0;
        return -1;
    }
    enclose(side, x, s, *share, last, &before, &beyond);
    move(x, s, *share, beyond, there);
    watch(there, s, beyond, now->g);
    const int first = mark(side, now);
    set_states(there, s, beyond, now);
    if (first < 0 || side[first] * slope_of(now->after, s, beyond, first) <= 0.0) {
        *share = beyond;
        return first;
    }
    move(x, s, *share, before, there); /* it is turned back */
    watch(there, s, before, now->g);
    set_states(there, s, before, now);
    *share = before;
    return first;
}

/* Moves x through a step and its events; returns 0 where they follow each other without end. */
static int carry(double *side, double *x, const step *s)
{
    taking_place now;
    double share = 0.0, g[EVENTS];
    for (int count = 0; count <= MOST_EVENTS; count++) {
        watch(x, s, share, now.g);
        const int first = mark(side, &now);
        if (first >= 0) { /* it jumped, because of an input or of another event */
            set_states(x, s, share, &now);
        } else if (share >= 1.0 || to_event(side, x, s, &share, &now) < 0) {
            return 1;
        }
        memcpy(x, now.after, sizeof now.after);
        watch(x, s, share, g);
        for (int e = 0; e < EVENTS; e++) {
            if (now.fires[e]) side[e] = sign_of(g[e]);
        }
    }
    return 0;
}
