/* SPDX-License-Identifier: Apache-2.0 */
/* Non-blocking stream sockets, waits with an end, and texts of errors. */
#ifndef OBSCURA_TRANSPORT_H
#define OBSCURA_TRANSPORT_H

#include "client.h"

#include <stddef.h>

/** Seconds of a clock that only goes forward. */
double oc_now_s(void);

/** Waits until `descriptor` can be read, or written for `events` POLLOUT, or `other` (-1: none) can be read,
 * or `until_s` of oc_now_s() has passed. Returns the descriptors that are ready as bits 1 and 2; 0: time is
 * over. */
int oc_wait_for(int descriptor, short events, int other, double until_s);

/** A connected, non-blocking socket; -1 with one line in `why`. `address` as of obscura_connect(). */
int oc_open(const char* address, double until_s, char* why, size_t why_bytes);

/** Two ends of a pipe, non-blocking and closed in children; 0 on failure. */
int oc_pipe(int ends[2]);

/** Makes a descriptor blocking again; 0 on failure. */
int oc_set_blocking(int descriptor);

/** Takes at most `most` files, the oldest ones, out of `from` into `to`. Returns how many. */
size_t oc_take_files(oc_files* from, int* to, size_t most);
/** As recv(): files that come along are added to `files`, and closed where that is full. */
ssize_t oc_receive_some(int descriptor, void* to, size_t room, oc_files* files);

/** Closes the descriptor, if it is one, and makes it -1. */
void oc_close(int* descriptor);

/** Fills `error` and returns its status. `message` as of printf(). */
obscura_status oc_fail(obscura_error* error, obscura_status status, const char* code, const char* message,
                       ...) __attribute__((format(printf, 4, 5)));

#endif
