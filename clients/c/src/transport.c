/* SPDX-License-Identifier: Apache-2.0 */
#include "transport.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#ifndef MSG_CMSG_CLOEXEC
#define MSG_CMSG_CLOEXEC 0
#endif

double oc_now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int oc_wait_for(int descriptor, short events, int other, double until_s) {
    struct pollfd both[2] = {{.fd = descriptor, .events = events}, {.fd = other, .events = POLLIN}};
    for (;;) {
        const double left_s = until_s - oc_now_s();
        const int left_ms = left_s <= 0 ? 0 : left_s > 1e6 ? 1000000000 : (int)(1e3 * left_s) + 1;
        const int ready = poll(both, 2, left_ms);
        if (ready > 0) return (both[0].revents != 0 ? 1 : 0) | (both[1].revents != 0 ? 2 : 0);
        if (ready == 0 && left_s <= 1e6) return 0;
        if (ready < 0 && errno != EINTR) return 1; /* the next read or write tells what is wrong */
    }
}

void oc_close(int* descriptor) {
    if (*descriptor >= 0) close(*descriptor);
    *descriptor = -1;
}

/** Makes a descriptor non-blocking and closed in children; 0 on failure. */
static int adapt(int descriptor) {
    return fcntl(descriptor, F_SETFD, FD_CLOEXEC) == 0 &&
           fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) | O_NONBLOCK) == 0;
}

int oc_set_blocking(int descriptor) {
    return fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) & ~O_NONBLOCK) == 0;
}

int oc_pipe(int ends[2]) {
    if (pipe(ends) != 0) {
        ends[0] = ends[1] = -1;
        return 0;
    }
    if (adapt(ends[0]) && adapt(ends[1])) return 1;
    oc_close(&ends[0]);
    oc_close(&ends[1]);
    return 0;
}

size_t oc_take_files(oc_files* from, int* to, size_t most) {
    const size_t taken = from->count < most ? from->count : most;
    memcpy(to, from->descriptors, taken * sizeof *to);
    from->count -= taken;
    memmove(from->descriptors, from->descriptors + taken, from->count * sizeof *to);
    return taken;
}

ssize_t oc_receive_some(int descriptor, void* to, size_t room, oc_files* files) {
    union {
        struct cmsghdr aligned;
        char bytes[CMSG_SPACE(OC_MOST_FILES * sizeof(int))];
    } control;
    struct iovec part = {.iov_base = to, .iov_len = room};
    struct msghdr message = {.msg_iov = &part,
                             .msg_iovlen = 1,
                             .msg_control = control.bytes,
                             .msg_controllen = sizeof control.bytes};
    const ssize_t got = recvmsg(descriptor, &message, MSG_CMSG_CLOEXEC);
    if (got < 0) return got;
    for (struct cmsghdr* each = CMSG_FIRSTHDR(&message); each != NULL; each = CMSG_NXTHDR(&message, each)) {
        if (each->cmsg_level != SOL_SOCKET || each->cmsg_type != SCM_RIGHTS) continue;
        const size_t count = (each->cmsg_len - CMSG_LEN(0)) / sizeof(int);
        for (size_t i = 0; i < count; ++i) {
            int file;
            memcpy(&file, CMSG_DATA(each) + i * sizeof file, sizeof file);
            if (files->count < OC_MOST_FILES)
                files->descriptors[files->count++] = file;
            else
                oc_close(&file);
        }
    }
    return got;
}

/** A socket connected to `address`; -1 with errno. */
static int connected(int family, const struct sockaddr* address, socklen_t bytes, double until_s) {
    int made = socket(family, SOCK_STREAM, 0);
    if (made < 0) return -1;
    int fault = 0;
    if (!adapt(made)) {
        fault = errno;
    } else if (connect(made, address, bytes) != 0) {
        fault = errno;
        if (fault == EINPROGRESS || fault == EINTR) {
            socklen_t size = sizeof fault;
            if (oc_wait_for(made, POLLOUT, -1, until_s) == 0)
                fault = ETIMEDOUT;
            else if (getsockopt(made, SOL_SOCKET, SO_ERROR, &fault, &size) != 0)
                fault = errno;
        }
    }
    if (fault == 0) return made;
    oc_close(&made);
    errno = fault;
    return -1;
}

static int open_unix(const char* path, double until_s) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    memcpy(address.sun_path, path, strlen(path) + 1);
    /* A Unix socket whose server is busy says EAGAIN instead of EINPROGRESS. */
    int made;
    while ((made = connected(AF_UNIX, (const struct sockaddr*)&address, sizeof address, until_s)) < 0 &&
           errno == EAGAIN && oc_now_s() < until_s)
        nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
    return made;
}

int oc_open(const char* address, double until_s, char* why, size_t why_bytes) {
    static const char running[] = "is `obscura serve` running there?";
    if (strchr(address, '/') != NULL) {
        const int made = open_unix(address, until_s);
        if (made < 0) snprintf(why, why_bytes, "%s: %s (%s)", address, strerror(errno), running);
        return made;
    }
    char host[256];
    const char* colon = strrchr(address, ':');
    if (colon == NULL || colon == address || (size_t)(colon - address) >= sizeof host) {
        snprintf(why, why_bytes, "%.200s: no address, allowed HOST:PORT, or a path with a / (%s)", address,
                 running);
        return -1;
    }
    const char* begin = address;
    size_t bytes = (size_t)(colon - address);
    if (bytes > 2 && begin[0] == '[' && begin[bytes - 1] == ']') ++begin, bytes -= 2;
    memcpy(host, begin, bytes);
    host[bytes] = 0;

    struct addrinfo *found = NULL,
                    hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICSERV};
    const int unknown = getaddrinfo(host, colon + 1, &hints, &found);
    if (unknown != 0) {
        snprintf(why, why_bytes, "%s: %s (%s)", address, gai_strerror(unknown), running);
        return -1;
    }
    int made = -1;
    for (const struct addrinfo* each = found; each != NULL && made < 0; each = each->ai_next)
        made = connected(each->ai_family, each->ai_addr, each->ai_addrlen, until_s);
    if (made < 0)
        snprintf(why, why_bytes, "%s: %s (%s)", address, strerror(errno), running);
    else
        setsockopt(made, IPPROTO_TCP, TCP_NODELAY, &(int){1}, sizeof(int));
    freeaddrinfo(found);
    return made;
}

obscura_status oc_fail(obscura_error* error, obscura_status status, const char* code, const char* message,
                       ...) {
    if (error == NULL) return status;
    memset(error, 0, sizeof *error);
    error->status = status;
    snprintf(error->code, sizeof error->code, "%s", code);
    va_list values;
    va_start(values, message);
    vsnprintf(error->message, sizeof error->message, message, values);
    va_end(values);
    return status;
}
