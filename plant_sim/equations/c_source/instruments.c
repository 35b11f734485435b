#define TURN 6.283185307179586

/* A reading over a step: value and slope at its start and at its end, each as the input is there. */
typedef struct {
    double from, from_slope, to, to_slope;
} course;

/* What is behind a lag of a rate [1/s] after an interval; 0 is the start, where it is `first`. */
static inline double behind(double *own, double rate, double interval, const course *c, double first)
{
    const double before[2] = {c->from, c->from_slope};
    *own = interval > 0.0 ? follow(*own, interval * rate, interval, before, c->to, c->to_slope) : first;
    return *own;
}

static inline void through_filter(double *own, double rate, double interval, course *c)
{
    const double before = *own, now = behind(own, rate, interval, c, c->to);
    *c = (course){before, rate * (c->from - before), now, rate * (c->to - now)};
}

/* Of a high-pass what is behind the lag is left out. */
static inline void past_filter(double *own, double rate, double interval, course *c)
{
    const double before = *own, now = behind(own, rate, interval, c, 0.0);
    c->from_slope -= rate * (c->from - before);
    c->to_slope -= rate * (c->to - now);
    c->from -= before;
    c->to -= now;
}
