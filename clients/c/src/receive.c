/* SPDX-License-Identifier: Apache-2.0 */
#include "receive.h"

#include "transport.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

static uint64_t little(const unsigned char* from, int bytes) {
    uint64_t number = 0;
    for (int i = bytes; i-- > 0;)
        number = number << 8 | from[i];
    return number;
}

void oc_receive_next(oc_incoming* in) {
    free(in->head);
    free(in->body);
    in->head = in->body = NULL;
    in->has_frame = 0;
    in->head_bytes = in->head_got = in->body_bytes = in->body_got = 0;
}

/** Reads the frame and makes room for what follows it. -1: it is none. */
static int take_frame(obscura_client* client) {
    oc_incoming* in = &client->in;
    const unsigned char* frame = in->early + in->early_begin;
    if (memcmp(frame, "OBSC\1", 5) != 0 || little(frame + 6, 2) != 0) {
        oc_lose(client, "%s: the server does not speak this protocol", client->address);
        return -1;
    }
    const uint64_t head_bytes = little(frame + 12, 4), body_bytes = little(frame + 16, 8);
    if (head_bytes > OC_MOST_HEAD_BYTES || body_bytes > client->max_body_bytes || body_bytes > SIZE_MAX - 1) {
        oc_lose(client, "%s: an answer of %llu + %llu bytes is too large", client->address,
                (unsigned long long)head_bytes, (unsigned long long)body_bytes);
        return -1;
    }
    in->kind = frame[5];
    in->id = (uint32_t)little(frame + 8, 4);
    in->head_bytes = (size_t)head_bytes;
    in->body_bytes = (size_t)body_bytes;
    in->early_begin += OC_FRAME_BYTES;
    /* Pages of it are used as bytes arrive. */
    in->head = malloc(in->head_bytes + 1);
    in->body = in->body_bytes == 0 ? NULL : malloc(in->body_bytes);
    if (in->head == NULL || (in->body == NULL && in->body_bytes != 0)) {
        oc_lose(client, "%s: not enough memory for an answer of %llu bytes", client->address,
                (unsigned long long)body_bytes);
        return -1;
    }
    in->has_frame = 1;
    return 0;
}

/** Moves what was read ahead to where it belongs. */
static void take_early(oc_incoming* in, unsigned char* to, size_t wanted, size_t* got) {
    const size_t there = in->early_end - in->early_begin;
    const size_t taken = there < wanted - *got ? there : wanted - *got;
    if (taken == 0) return;
    memcpy(to + *got, in->early + in->early_begin, taken);
    *got += taken;
    in->early_begin += taken;
}

int oc_receive(obscura_client* client) {
    oc_incoming* in = &client->in;
    for (;;) {
        if (!in->has_frame && in->early_end - in->early_begin >= OC_FRAME_BYTES && take_frame(client) != 0)
            return -1;
        if (in->has_frame) {
            take_early(in, in->head, in->head_bytes, &in->head_got);
            if (in->head_got == in->head_bytes) take_early(in, in->body, in->body_bytes, &in->body_got);
            if (in->head_got == in->head_bytes && in->body_got == in->body_bytes) return 1;
        }
        /* A body is read to its place; all else ahead. */
        const int to_body = in->has_frame && in->head_got == in->head_bytes;
        if (!to_body && in->early_begin > 0) {
            memmove(in->early, in->early + in->early_begin, in->early_end - in->early_begin);
            in->early_end -= in->early_begin;
            in->early_begin = 0;
        }
        unsigned char* to = to_body ? in->body + in->body_got : in->early + in->early_end;
        const size_t room = to_body ? in->body_bytes - in->body_got : sizeof in->early - in->early_end;
        const ssize_t got = oc_receive_some(client->socket, to, room, &client->files);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return 0;
        if (got <= 0) {
            oc_lose(client, "%s: %s", client->address,
                    got == 0 ? "the server has ended the connection" : strerror(errno));
            return -1;
        }
        client->news_s = oc_now_s();
        *(to_body ? &in->body_got : &in->early_end) += (size_t)got;
    }
}
