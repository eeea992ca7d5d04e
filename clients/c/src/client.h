/* SPDX-License-Identifier: Apache-2.0 */
/* State of a client. */
#ifndef OBSCURA_CLIENT_STATE_H
#define OBSCURA_CLIENT_STATE_H

#include "obscura_client.h"

#include <sys/types.h>

/** A server that was started for this client. */
typedef struct oc_server {
    pid_t process;    /**< 0: none */
    int input;        /**< its standard input: it ends when that is closed */
    int complaints;   /**< file without a name that its standard error goes to */
    char folder[256]; /**< of its socket */
} oc_server;

/** Files that came with messages and belong to answers that are not made yet, oldest first. */
enum { OC_MOST_FILES = 8 };
typedef struct oc_files {
    int descriptors[OC_MOST_FILES];
    size_t count;
} oc_files;

/** Message that arrives. */
typedef struct oc_incoming {
    unsigned char early[4096]; /**< what was read ahead: frame, head, beginning of the body */
    size_t early_begin, early_end;
    int has_frame;
    unsigned kind;
    uint32_t id;
    unsigned char *head, *body;
    size_t head_bytes, head_got, body_bytes, body_got;
} oc_incoming;

struct obscura_client {
    int socket;  /**< non-blocking; -1: lost */
    int wake[2]; /**< pipe: a byte in it cancels the request in progress */
    char* address;
    double timeout_s;
    uint64_t max_body_bytes;
    obscura_error error;
    uint32_t next_id;
    uint32_t current; /**< request in progress; 0: none */
    int owes_credit;  /**< a frame of the stream in progress was taken */
    double news_s;    /**< time at which the server was heard of last, or the request began */
    oc_incoming in;
    oc_files files;
    obscura_progress progress;
    void* context;
    obscura_answer* hello;
    oc_server server;
};

/** Ends the connection; the client only waits to be freed. Returns OBSCURA_LOST. */
obscura_status oc_lose(obscura_client* client, const char* message, ...)
    __attribute__((format(printf, 2, 3)));

/** Ends the server, at the latest after some seconds by force; writes the first line of what it complained
 * of. */
void oc_server_end(oc_server* server, char* complaint, size_t bytes);

#endif
