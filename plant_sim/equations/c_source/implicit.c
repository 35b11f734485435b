/* Linearly implicit Euler steps, extrapolated to order 4, for stiff models (Deuflhard, SIAM Review 27 (1985) 505;
   Hairer, Wanner, Solving Ordinary Differential Equations II, IV.9). */
#define ORDER 4
#define SHARE 1e-6       /* step of a finite difference, as a share of a state's size */
#define MOVED_SHARE 1e-8 /* least step, as a share of what a state moves in an integration step by its rate alone */

/* Solves matrix times unknown = rhs by elimination with pivots; both are overwritten. */
static void solve_in_place(double matrix[STATES][STATES], double *rhs)
{
    for (int c = 0; c < STATES; c++) {
        int best = c;
        for (int r = c + 1; r < STATES; r++) {
            if (fabs(matrix[r][c]) > fabs(matrix[best][c])) best = r;
        }
        if (best != c) {
            for (int k = 0; k < STATES; k++) {
                const double kept = matrix[c][k];
                matrix[c][k] = matrix[best][k];
                matrix[best][k] = kept;
            }
            const double kept = rhs[c];
            rhs[c] = rhs[best];
            rhs[best] = kept;
        }
        for (int r = c + 1; r < STATES; r++) {
            const double factor = matrix[r][c] / matrix[c][c];
            for (int k = c; k < STATES; k++) matrix[r][k] -= factor * matrix[c][k];
            rhs[r] -= factor * rhs[c];
        }
    }
    for (int r = STATES - 1; r >= 0; r--) {
        for (int k = r + 1; k < STATES; k++) rhs[r] -= matrix[r][k] * rhs[k];
        rhs[r] /= matrix[r][r];
    }
}

/* Moves x from one share of a step to another; (I - h J) dx = h f with J by finite differences at the start. */
static void part_of_step(double *x, const step *s, double begin, double end)
{
    double slopes[STATES][STATES], matrix[STATES][STATES], table[ORDER][STATES];
    double base[STATES], moved[STATES], here[STATES], rhs[STATES], u[INPUTS];

    at_share(s, begin, u);
    limited_rates(x, u, s->t + begin * s->h, s->p, base);
    for (int c = 0; c < STATES; c++) {
        const double before = x[c], size = fabs(before), of_size = SHARE * (size > 1e-12 ? size : 1e-12);
        const double of_motion = MOVED_SHARE * fabs((end - begin) * s->h * base[c]);
        const double by = of_motion > of_size ? of_motion : of_size;
        x[c] = before + by;
        limited_rates(x, u, s->t + begin * s->h, s->p, moved);
        x[c] = before;
        for (int r = 0; r < STATES; r++) slopes[r][c] = (moved[r] - base[r]) / by;
    }
    for (int k = 1; k <= ORDER; k++) {
        const double own = (end - begin) * s->h / k;
        memcpy(here, x, sizeof here);
        for (int i = 1; i <= k; i++) {
            at_share(s, begin + (end - begin) * ((double)i / k), u);
            limited_rates(here, u, s->t + begin * s->h + i * own, s->p, rhs);
            for (int r = 0; r < STATES; r++) {
                rhs[r] *= own;
                for (int c = 0; c < STATES; c++) matrix[r][c] = (r == c ? 1.0 : 0.0) - own * slopes[r][c];
            }
            solve_in_place(matrix, rhs);
            for (int r = 0; r < STATES; r++) here[r] += rhs[r];
        }
        for (int r = 0; r < STATES; r++) {
            table[k - 1][r] = here[r];
            for (int m = 1; m < k; m++) { /* Aitken and Neville */
                const double change = table[k - m][r] - table[k - m - 1][r];
                table[k - m - 1][r] = table[k - m][r] + change / ((double)k / (k - m) - 1.0);
            }
        }
    }
    memcpy(x, table[0], sizeof here);
}
