// SPDX-License-Identifier: Apache-2.0
// The calls of libgpiod 1 on plain files, to be preloaded: a file is a chip of eight lines, and each byte
// that is appended to it while a line is requested is a rising edge of that line. A file that is taken away
// is a chip that was pulled out. Only tests use it.
#include <errno.h>
#include <fcntl.h>
#include <gpiod.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#ifdef GPIOD_LINE_BULK_MAX_LINES

struct gpiod_line {
    int fd;
    off_t seen;
};

struct gpiod_chip {
    struct gpiod_line line;
};

static off_t length_of(int fd) {
    struct stat status;
    return fstat(fd, &status) == 0 ? status.st_size : 0;
}

struct gpiod_chip* gpiod_chip_open(const char* path) {
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return NULL;
    struct gpiod_chip* chip = calloc(1, sizeof *chip);
    if (chip == NULL) {
        close(fd);
        return NULL;
    }
    chip->line.fd = fd;
    return chip;
}

void gpiod_chip_close(struct gpiod_chip* chip) {
    close(chip->line.fd);
    free(chip);
}

unsigned int gpiod_chip_num_lines(struct gpiod_chip* chip) {
    (void)chip;
    return 8;
}

struct gpiod_line* gpiod_chip_get_line(struct gpiod_chip* chip, unsigned int offset) {
    (void)offset;
    return &chip->line;
}

int gpiod_line_request_rising_edge_events(struct gpiod_line* line, const char* consumer) {
    (void)consumer;
    line->seen = length_of(line->fd);
    return 0;
}

int gpiod_line_event_wait(struct gpiod_line* line, const struct timespec* timeout) {
    const struct timespec step = {0, 500000};
    long long left_ns = timeout->tv_sec * 1000000000LL + timeout->tv_nsec;
    for (; length_of(line->fd) <= line->seen; left_ns -= step.tv_nsec) {
        if (left_ns <= 0) return 0;
        nanosleep(&step, NULL);
    }
    return 1;
}

int gpiod_line_event_read_multiple(struct gpiod_line* line, struct gpiod_line_event* events,
                                   unsigned int most) {
    unsigned int count = 0;
    for (; count < most && line->seen < length_of(line->fd); ++line->seen, ++count) {
        clock_gettime(CLOCK_MONOTONIC, &events[count].ts);
        events[count].event_type = GPIOD_LINE_EVENT_RISING_EDGE;
    }
    return (int)count;
}

#endif
