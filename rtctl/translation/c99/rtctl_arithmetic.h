/* Arithmetic of the exported functions: reals in one precision, views of arrays, integers that divide as in Python.
 *
 * real_t is float; compile with -DRTCTL_DOUBLE for double. Compile with -ffp-contract=off: a multiplication that is
 * fused with an addition gives other bits. Of a C library nothing is needed but the square root, which is exact.
 * gcc and clang have it built in; other compilers take it from <math.h>: -DRTCTL_LIBM, double only.
 */
#ifndef RTCTL_ARITHMETIC_H
#define RTCTL_ARITHMETIC_H

#include <stdbool.h>
#include <stdint.h>

#ifdef RTCTL_LIBM
#include <math.h>
typedef double real_t;
#define REAL_SQRT sqrt
#define REAL_ABS fabs
#define REAL_COPYSIGN copysign
#define BY_PRECISION(of_double, of_float) (of_double)
#elif defined RTCTL_DOUBLE
typedef double real_t;
#define REAL_SQRT __builtin_sqrt
#define REAL_ABS __builtin_fabs
#define REAL_COPYSIGN __builtin_copysign
#define BY_PRECISION(of_double, of_float) (of_double)
#else
typedef float real_t;
#define REAL_SQRT __builtin_sqrtf
#define REAL_ABS __builtin_fabsf
#define REAL_COPYSIGN __builtin_copysignf
#define BY_PRECISION(of_double, of_float) ((real_t)(of_float))
#endif
#ifdef RTCTL_LIBM
#define REAL_INFINITY ((real_t)INFINITY)
#define REAL_NAN ((real_t)NAN)
#else
#define REAL_INFINITY ((real_t)__builtin_inf())
#define REAL_NAN ((real_t)__builtin_nan(""))
#endif
#define R(x) ((real_t)(x)) /* a constant in the precision of the arithmetic */

typedef struct { real_t *at; int32_t size; } real_array;                    /* memory that functions change */
typedef struct { const real_t *at; int32_t size; } real_list;               /* constants, or memory only read */
typedef struct { const real_t *at; int32_t rows; int32_t columns; } real_table; /* constants below a diagonal of zeros */

/* A view of an array that is a field of a record. */
#define ARRAY_OF(field) ((real_array){(field), (int32_t)(sizeof(field) / sizeof((field)[0]))})
#define LIST_OF(field) ((real_list){(field), (int32_t)(sizeof(field) / sizeof((field)[0]))})

static inline real_list list_of(real_array a) { return (real_list){a.at, a.size}; }

/* Row after row, of which only what is left of the diagonal is stored: the rest of a table is zero. */
static inline real_t table_entry(real_table t, int32_t i, int32_t j)
{
    return (j < i) ? t.at[((i * (i - 1)) / 2) + j] : R(0.0);
}

static inline real_array array_part(real_array a, int32_t first, int32_t end)
{
    return (real_array){&a.at[first], end - first};
}

static inline real_list list_part(real_list a, int32_t first, int32_t end)
{
    return (real_list){&a.at[first], end - first};
}

/* A copy of `from` in `memory`, which is large enough for it. */
static inline real_array copy_of(real_list from, real_t *memory)
{
    for (int32_t k = 0; k < from.size; k++) {
        memory[k] = from.at[k];
    }
    return (real_array){memory, from.size};
}

static inline void array_fill(real_array a, real_t value)
{
    for (int32_t k = 0; k < a.size; k++) {
        a.at[k] = value;
    }
}

/* Minimum and maximum keep their first argument where they are equal or one is not a number. */
static inline real_t real_min(real_t a, real_t b) { return (b < a) ? b : a; }
static inline real_t real_max(real_t a, real_t b) { return (b > a) ? b : a; }
static inline int32_t int_min(int32_t a, int32_t b) { return (b < a) ? b : a; }
static inline int32_t int_max(int32_t a, int32_t b) { return (b > a) ? b : a; }
static inline int64_t long_min(int64_t a, int64_t b) { return (b < a) ? b : a; }
static inline int64_t long_max(int64_t a, int64_t b) { return (b > a) ? b : a; }
static inline int32_t int_abs(int32_t a) { return (a < 0) ? -a : a; }
static inline int64_t long_abs(int64_t a) { return (a < 0) ? -a : a; }

/* A difference of infinities is not a number, and one that is not a number equals nothing. */
static inline bool real_is_nan(real_t x) { return x != x; }
static inline bool real_is_finite(real_t x) { return (x - x) == R(0.0); }

/* Quotient and remainder by b > 0 that round down. */
static inline int32_t int_quotient(int32_t a, int32_t b) { return (a / b) - (((a % b) < 0) ? 1 : 0); }
static inline int32_t int_remainder(int32_t a, int32_t b) { return (a % b) + (((a % b) < 0) ? b : 0); }
static inline int64_t long_quotient(int64_t a, int64_t b) { return (a / b) - (((a % b) < 0) ? 1 : 0); }
static inline int64_t long_remainder(int64_t a, int64_t b) { return (a % b) + (((a % b) < 0) ? b : 0); }

#endif
