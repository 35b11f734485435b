/* The board as a program of this computer: its serial line is a pseudo-terminal, or standard input and output.
 *
 *   rtctl_host LINK     makes a pseudo-terminal, links LINK to it, prints "ready" and answers there until it is ended
 *   rtctl_host -        answers on standard input and output, until the input ends
 */
#define _GNU_SOURCE
#include "rtctl_board.h"
#include "rtctl_device.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static int in = STDIN_FILENO, out = STDOUT_FILENO;
static uint8_t arrived[256];
static ssize_t taken, count;

int board_receive(void)
{
    return taken < count ? arrived[taken++] : -1;
}

void board_wait(void)
{
    struct pollfd line = { .fd = in, .events = POLLIN };
    if (poll(&line, 1, 1) <= 0)
        return;
    taken = 0;
    count = read(in, arrived, sizeof arrived);
    if (count == 0)
        exit(0); /* the input has ended */
}

void board_send(const uint8_t *bytes, size_t bytes_count)
{
    struct pollfd line = { .fd = out, .events = POLLOUT };
    if (poll(&line, 1, 0) > 0 && write(out, bytes, bytes_count) < 0 && errno != EAGAIN)
        exit(1); /* nobody is there any more */
}

uint64_t board_time_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

static bool is_link(const char *path)
{
    struct stat found;
    return !lstat(path, &found) && S_ISLNK(found.st_mode); /* anything else that is there stays */
}

/* A pseudo-terminal in raw mode; its master. The slave stays open here, else the master fails while no host has it. */
static int raw_terminal(const char *link)
{
    struct termios raw;
    int master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || grantpt(master) || unlockpt(master))
        return -1;
    int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    if (slave < 0 || tcgetattr(slave, &raw))
        return -1;
    cfmakeraw(&raw);
    if (tcsetattr(slave, TCSANOW, &raw) || fcntl(master, F_SETFL, O_NONBLOCK))
        return -1;
    return is_link(link) && unlink(link) ? -1 : symlink(ptsname(master), link) ? -1 : master;
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "usage: %s LINK|-\n", argv[0]);
        return 2;
    }
    if (strcmp(argv[1], "-")) {
        in = out = raw_terminal(argv[1]);
        if (in < 0) {
            fprintf(stderr, "%s: %s: %s; give the path of a link that can be made\n", argv[0], argv[1], strerror(errno));
            return 1;
        }
        printf("ready\n");
        fflush(stdout);
    }
    device_start();
    for (;;)
        device_turn();
}
