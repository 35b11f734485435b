/* A byte at a time: what they move here is short. Volatile, else a compiler would make of a loop a call of itself. */
#include <string.h>

void *memcpy(void *restrict to, const void *restrict from, size_t count)
{
    return memmove(to, from, count);
}

void *memmove(void *to, const void *from, size_t count)
{
    volatile unsigned char *t = to;
    const unsigned char *f = from;
    if (t < f)
        for (size_t i = 0; i < count; i++)
            t[i] = f[i];
    else
        while (count--)
            t[count] = f[count];
    return to;
}

void *memset(void *to, int value, size_t count)
{
    volatile unsigned char *t = to;
    while (count--)
        t[count] = (unsigned char)value;
    return to;
}
