#define TURN 6.283185307179586

/* A reading behind a lag: what is behind it, the two values before, and the time between these two. */
typedef struct {
    double behind, last, before, gap;
} filter;

/* What is behind a lag of a rate [1/s] after an interval, 0 at the start, where it is `first`. Slopes are those of the
   parabola through the last three values. */
static inline double behind(filter *f, double rate, double interval, double z, double first)
{
    if (interval > 0.0) {
        const double rise = (z - f->last) / interval;
        double slopes[2] = {rise, rise};
        if (f->gap > 0.0) {
            const double bend = (rise - (f->last - f->before) / f->gap) / (interval + f->gap);
            slopes[0] = rise - bend * interval;
            slopes[1] = rise + bend * interval;
        }
        const double from[2] = {f->last, slopes[0]};
        f->behind = follow(f->behind, interval * rate, interval, from, z, slopes[1]);
        f->before = f->last;
    } else {
        f->behind = first;
    }
    f->gap = interval;
    f->last = z;
    return f->behind;
}

