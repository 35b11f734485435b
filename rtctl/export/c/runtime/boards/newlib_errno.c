/* What newlib's square root in double precision asks for; in single precision the processor has one. */
int *__errno(void);

int *__errno(void)
{
    static int number;
    return &number;
}
