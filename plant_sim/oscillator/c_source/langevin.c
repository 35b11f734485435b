/* 3 L(x) / x with L(x) = coth x - 1 / x, by its series where x is small. */
static double langevin(double x)
{
    static const double series[] = {
        -349222.0 / 510443155096875.0, 87734.0 / 12993098493375.0, -3617.0 / 54273594375.0, 4.0 / 6081075.0,
        -1382.0 / 212837625.0, 2.0 / 31185.0, -1.0 / 1575.0, 2.0 / 315.0, -1.0 / 15.0, 1.0
    };
    if (fabs(x) < 0.5) {
        double total = 0.0;
        for (int k = 0; k < 10; k++) total = total * (x * x) + series[k];
        return total;
    }
    const double e = exp(-2.0 * fabs(x));
    return 3.0 * ((1.0 + e) / (1.0 - e) - 1.0 / fabs(x)) / fabs(x);
}
