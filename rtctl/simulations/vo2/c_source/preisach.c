/* Preisach model by its Everett function: y = c + sign H + c1 v + c2 v^2. The memory is the stack of alternating extrema
   that the input has left; an input that passes an older extremum wipes the pair inside it (Mayergoyz, Mathematical
   Models of Hysteresis, 1991). When the stack is full, the innermost loop is forgotten. */
typedef struct {
    double top;            /* number of the innermost extremum */
    double at[EXTREMA];    /* extrema: maxima at odd places, minima at even ones */
    double level[EXTREMA]; /* H at each of them */
} relays;

typedef struct {
    int count; /* of grid nodes */
    const double *grid, *nodes; /* E at the nodes, row by row */
    double sign, c, c1, c2;
} preisach;

static int cell(const double *grid, int count, double x, int above)
{
    int low = 0, high = count - 1;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (above ? grid[middle] <= x : grid[middle] < x) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Mass of the relays that switch up below alpha and down above beta <= alpha. */
static double everett(double alpha, double beta, const preisach *p)
{
    const double *grid = p->grid;
    const int i = cell(grid, p->count, alpha, 1), j = cell(grid, p->count, beta, 0);
#define NODE(a, b) p->nodes[(a) * p->count + (b)]
    double fa = (alpha - grid[i]) / (grid[i + 1] - grid[i]), inner, outer;
    const double fb = (grid[j + 1] - beta) / (grid[j + 1] - grid[j]);
    if (j > i) return 0.0;
    if (i == j) {
        inner = 0.0;
        outer = NODE(i + 1, j);
        fa = fa + fb - 1.0 > 0.0 ? fa + fb - 1.0 : 0.0;
    } else {
        inner = NODE(i, j + 1) + fb * (NODE(i, j) - NODE(i, j + 1));
        outer = NODE(i + 1, j + 1) + fb * (NODE(i + 1, j) - NODE(i + 1, j + 1));
    }
#undef NODE
    return inner + fa * (outer - inner);
}

/* All relays off, as a full cooling leaves them. */
static void cool(relays *s, const preisach *p)
{
    memset(s, 0, sizeof *s);
    s->at[0] = p->grid[0];
}

static double value_of(const relays *s, const preisach *p)
{
    const int top = (int)s->top;
    const double v = s->at[top];
    return p->c + p->sign * s->level[top] + v * (p->c1 + p->c2 * v);
}

static void follow(relays *s, double v, const preisach *p)
{
    int top = (int)s->top;
    v = v < p->grid[0] ? p->grid[0] : v > p->grid[p->count - 1] ? p->grid[p->count - 1] : v;
    if (v != s->at[top]) {
        const int rising = v > s->at[top];
        if (rising != (top % 2 == 1)) {
            if (top == EXTREMA - 1) top -= 2;
            top += 1;
        }
        if (rising) {
            while (top >= 3 && v >= s->at[top - 2]) top -= 2;
        } else {
            while (top >= 2 && v <= s->at[top - 2]) top -= 2;
        }
        s->top = top;
        s->at[top] = v;
    }
    if (top == 0) {
        s->level[0] = 0.0;
    } else if (top % 2 == 1) {
        s->level[top] = s->level[top - 1] + everett(v, s->at[top - 1], p);
    } else {
        s->level[top] = s->level[top - 1] - everett(s->at[top - 1], v, p);
    }
}
