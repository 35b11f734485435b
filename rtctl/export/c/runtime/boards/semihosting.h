/* Files of the computer that emulates or debugs a processor: Arm's semihosting, version 2.0, also of RISC-V. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

enum { SEMIHOSTING_OPEN = 0x01, SEMIHOSTING_WRITE = 0x05, SEMIHOSTING_READ = 0x06, SEMIHOSTING_EXIT = 0x18 };
enum { SEMIHOSTING_READ_BINARY = 1, SEMIHOSTING_WRITE_BINARY = 5 };

static inline uintptr_t semihosting(uintptr_t operation, const void *arguments)
{
#if defined(__arm__)
    register uintptr_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
#else
    register uintptr_t a0 __asm__("a0") = operation;
    register const void *a1 __asm__("a1") = arguments;
    __asm__ volatile(
        ".option push\n.option norvc\n.balign 16\nslli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop"
        : "+r"(a0) : "r"(a1) : "memory");
    return a0;
#endif
}

static inline uintptr_t file_open(const char *name, uintptr_t length, uintptr_t mode)
{
    const uintptr_t arguments[3] = {(uintptr_t)name, mode, length};
    return semihosting(SEMIHOSTING_OPEN, arguments);
}

/* Return how many bytes were not read. */
static inline uintptr_t file_read(uintptr_t file, void *to, uintptr_t count)
{
    const uintptr_t arguments[3] = {file, (uintptr_t)to, count};
    return semihosting(SEMIHOSTING_READ, arguments);
}

/* Return how many bytes were not written. */
static inline uintptr_t file_write(uintptr_t file, const void *from, uintptr_t count)
{
    const uintptr_t arguments[3] = {file, (uintptr_t)from, count};
    return semihosting(SEMIHOSTING_WRITE, arguments);
}

static inline void leave(void)
{
    const uintptr_t application_exit = 0x20026;
#if defined(__arm__)
    semihosting(SEMIHOSTING_EXIT, (const void *)application_exit);
#else
    const uintptr_t arguments[2] = {application_exit, 0};
    semihosting(SEMIHOSTING_EXIT, arguments);
#endif
    for (;;) { }
}

#endif
