/* SPDX-License-Identifier: Apache-2.0 */
#include "client.h"

#include "answer.h"
#include "messagepack.h"
#include "receive.h"
#include "token.h"
#include "transport.h"
#include "value.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#ifndef MSG_NOSIGNAL
#define MSG_NOSIGNAL 0
#endif

enum { MOST_REQUEST_BYTES = 1 << 20 };

obscura_status oc_lose(obscura_client* client, const char* message, ...) {
    char text[sizeof client->error.message];
    va_list values;
    va_start(values, message);
    vsnprintf(text, sizeof text, message, values);
    va_end(values);
    oc_close(&client->socket);
    client->current = 0;
    return oc_fail(&client->error, OBSCURA_LOST, "connection-lost", "%s", text);
}

static obscura_status well(obscura_client* client) {
    client->error.status = OBSCURA_OK;
    client->error.code[0] = client->error.message[0] = client->error.field[0] = 0;
    client->error.allowed[0] = client->error.hint[0] = 0;
    return OBSCURA_OK;
}

static obscura_status closed(obscura_client* client) {
    return oc_lose(client, "%s: the connection is closed", client->address);
}

/* Sending */

/** Sends the bytes, or ends the connection. A server that has hung up may have said why: that is for the
 * reader. */
static obscura_status send_all(obscura_client* client, const unsigned char* data, size_t bytes) {
    const double until_s = oc_now_s() + client->timeout_s;
    while (bytes > 0) {
        const ssize_t sent = send(client->socket, data, bytes, MSG_NOSIGNAL);
        if (sent >= 0) {
            data += sent;
            bytes -= (size_t)sent;
        } else if (errno == EPIPE || errno == ECONNRESET) {
            return OBSCURA_OK;
        } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
            if (oc_wait_for(client->socket, POLLOUT, -1, until_s) == 0)
                return oc_lose(client, "%s: the server does not read", client->address);
        } else if (errno != EINTR) {
            return oc_lose(client, "%s: %s", client->address, strerror(errno));
        }
    }
    return OBSCURA_OK;
}

static void put_little(unsigned char* to, uint64_t number, int bytes) {
    for (int i = 0; i < bytes; ++i)
        to[i] = (unsigned char)(number >> (8 * i));
}

/** Sends a request with a number of its own, which it writes to `id`. Takes over `fields`. */
static obscura_status send_request(obscura_client* client, const char* name, obscura_value* fields,
                                   uint32_t* id) {
    oc_buffer out = {0};
    static const unsigned char frame[OC_FRAME_BYTES] = {'O', 'B', 'S', 'C', 1, OC_REQUEST};
    oc_buffer_add(&out, frame, sizeof frame);
    obscura_put(fields, "call", obscura_string(name));
    const char* why = oc_pack(&out, fields);
    obscura_value_free(fields);
    obscura_status status;
    if (why != NULL) {
        status = oc_fail(&client->error, OBSCURA_BAD_USE, "bad-use", "%s: %s", name, why);
    } else if (out.size - OC_FRAME_BYTES > MOST_REQUEST_BYTES) {
        status =
            oc_fail(&client->error, OBSCURA_BAD_USE, "too-large", "%s: a request of %zu bytes, allowed %d",
                    name, out.size - OC_FRAME_BYTES, (int)MOST_REQUEST_BYTES);
    } else {
        *id = client->next_id;
        client->next_id = client->next_id == UINT32_MAX ? 1 : client->next_id + 1;
        put_little(out.data + 8, *id, 4);
        put_little(out.data + 12, out.size - OC_FRAME_BYTES, 4);
        status = send_all(client, out.data, out.size);
    }
    free(out.data);
    return status;
}

/** Asks the server to end the request in progress. */
static obscura_status send_cancel(obscura_client* client) {
    uint32_t id;
    return send_request(client, "cancel", obscura_map("request", obscura_int(client->current), NULL), &id);
}

static void forget_wakes(obscura_client* client) {
    char bytes[64];
    while (read(client->wake[0], bytes, sizeof bytes) > 0) {
    }
}

obscura_status obscura_begin(obscura_client* client, const char* name, obscura_value* fields) {
    if (client->socket < 0) {
        obscura_value_free(fields);
        return closed(client);
    }
    if (fields == NULL) fields = obscura_map_new();
    if (obscura_type_of(fields) != OBSCURA_MAP) {
        obscura_value_free(fields);
        return oc_fail(&client->error, OBSCURA_BAD_USE, "bad-use", "%s: the fields are no map", name);
    }
    if (client->current != 0) {
        const obscura_status status = send_cancel(client);
        client->current = 0;
        if (status != OBSCURA_OK) {
            obscura_value_free(fields);
            return status;
        }
    }
    forget_wakes(client);
    uint32_t id = 0;
    const obscura_status status = send_request(client, name, fields, &id);
    if (status != OBSCURA_OK) return status;
    client->current = id;
    client->owes_credit = 0;
    client->news_s = oc_now_s();
    return well(client);
}

void obscura_cancel(obscura_client* client) {
    const int fault = errno;                 /* for signal handlers */
    if (write(client->wake[1], "", 1) < 0) { /* full: it is known already */
    }
    errno = fault;
}

/* Receiving */

static void copy_text(char* to, size_t bytes, const obscura_value* head, const char* name) {
    const char* text = obscura_as_string(obscura_find(head, name));
    snprintf(to, bytes, "%s", text == NULL ? "" : text);
}

/** Outcome of the request that `head` refuses. */
static obscura_status refused(obscura_client* client, const obscura_value* head, int of_connection) {
    obscura_error* error = &client->error;
    copy_text(error->code, sizeof error->code, head, "code");
    copy_text(error->message, sizeof error->message, head, "message");
    copy_text(error->field, sizeof error->field, head, "field");
    copy_text(error->allowed, sizeof error->allowed, head, "allowed");
    copy_text(error->hint, sizeof error->hint, head, "hint");
    client->current = 0;
    error->status = strcmp(error->code, "cancelled") == 0 ? OBSCURA_CANCELLED : OBSCURA_REFUSED;
    if (of_connection) {
        error->status = OBSCURA_LOST;
        oc_close(&client->socket);
    }
    return error->status;
}

/** Tells of progress, and sends `cancel` if that is wanted. */
static obscura_status news(obscura_client* client, const obscura_value* head) {
    const char* event = obscura_as_string(obscura_find(head, "event"));
    if (client->progress == NULL || event == NULL || strcmp(event, "progress") != 0) return OBSCURA_PENDING;
    const int stop = client->progress(client->context, obscura_as_int(obscura_find(head, "done"), 0),
                                      obscura_as_int(obscura_find(head, "total"), 0),
                                      obscura_as_number(obscura_find(head, "left_s"), NAN));
    const obscura_status status = stop ? send_cancel(client) : OBSCURA_OK;
    return status == OBSCURA_OK ? OBSCURA_PENDING : status;
}

/** Makes an answer, or a frame, of the message that has arrived; takes over `head`. */
static obscura_status take_arrays(obscura_client* client, obscura_value* head, obscura_answer** answer) {
    oc_incoming* in = &client->in;
    const char* why = NULL;
    obscura_answer* made = oc_answer_new(head, in->body, in->body_bytes, &why);
    in->body = NULL;
    if (made == NULL) return oc_lose(client, "%s: %s", client->address, why);
    oc_answer_take_files(made, &client->files);
    if (answer != NULL)
        *answer = made;
    else
        obscura_answer_free(made);
    return well(client);
}

static int is_frame(const obscura_value* head) {
    const char* event = obscura_as_string(obscura_find(head, "event"));
    return event != NULL && strcmp(event, "frame") == 0;
}

/** Uses the message that has arrived; OBSCURA_PENDING: it was not the answer. `frame`: where a frame of a
 * stream is wanted instead of the answer; else NULL. */
static obscura_status take_message(obscura_client* client, obscura_answer** answer, obscura_answer** frame) {
    oc_incoming* in = &client->in;
    const int of_connection = in->kind == OC_ERROR && in->id == 0;
    if (!of_connection && in->id != client->current) { /* of a request that was given up */
        oc_receive_next(in);
        return OBSCURA_PENDING;
    }
    const char* why = NULL;
    obscura_value* head = oc_unpack(in->head, in->head_bytes, &why);
    obscura_status status = OBSCURA_PENDING;
    if (head == NULL) {
        status = oc_lose(client, "%s: %s", client->address, why);
    } else if (in->kind == OC_ERROR) {
        status = refused(client, head, of_connection);
    } else if (in->kind == OC_EVENT && frame != NULL && is_frame(head)) {
        client->owes_credit = 1;
        status = take_arrays(client, head, frame);
        head = NULL;
    } else if (in->kind == OC_EVENT) {
        status = news(client, head);
    } else if (in->kind == OC_ANSWER) {
        client->current = 0;
        status = take_arrays(client, head, answer);
        head = NULL;
    } else {
        status = oc_lose(client, "%s: a message of kind %u", client->address, in->kind);
    }
    obscura_value_free(head);
    oc_receive_next(in);
    return status;
}

/** Whether a request is in progress. */
static obscura_status check_current(obscura_client* client) {
    if (client->socket < 0) return client->error.status == OBSCURA_LOST ? OBSCURA_LOST : closed(client);
    if (client->current == 0)
        return oc_fail(&client->error, OBSCURA_BAD_USE, "bad-use", "no request is in progress");
    return OBSCURA_OK;
}

/** Waits for the answer or, where `frame` is not NULL, for a frame or the answer. */
static obscura_status wait_for_message(obscura_client* client, double wait_s, obscura_answer** answer,
                                       obscura_answer** frame) {
    const double end_s = wait_s < 0 ? INFINITY : oc_now_s() + wait_s;
    for (;;) {
        const int got = oc_receive(client);
        if (got < 0) return OBSCURA_LOST;
        if (got > 0) {
            const obscura_status status = take_message(client, answer, frame);
            if (status != OBSCURA_PENDING) return status;
        }
        const double now_s = oc_now_s(), silent_s = client->news_s + client->timeout_s;
        if (now_s >= end_s) return OBSCURA_PENDING;
        if (got > 0) continue;
        if (now_s >= silent_s) return oc_lose(client, "%s: no answer in time", client->address);
        const int ready =
            oc_wait_for(client->socket, POLLIN, client->wake[0], silent_s < end_s ? silent_s : end_s);
        if ((ready & 2) != 0) {
            forget_wakes(client);
            const obscura_status status = send_cancel(client);
            if (status != OBSCURA_OK) return status;
        }
    }
}

obscura_status obscura_wait(obscura_client* client, double wait_s, obscura_answer** answer) {
    if (answer != NULL) *answer = NULL;
    const obscura_status status = check_current(client);
    return status == OBSCURA_OK ? wait_for_message(client, wait_s, answer, NULL) : status;
}

obscura_status obscura_next(obscura_client* client, double wait_s, obscura_answer** frame) {
    *frame = NULL;
    obscura_status status = check_current(client);
    if (status == OBSCURA_OK && client->owes_credit) {
        uint32_t id;
        client->owes_credit = 0;
        status =
            send_request(client, "credit", obscura_map("request", obscura_int(client->current), NULL), &id);
    }
    return status == OBSCURA_OK ? wait_for_message(client, wait_s, NULL, frame) : status;
}

obscura_status obscura_call(obscura_client* client, const char* name, obscura_value* fields,
                            obscura_answer** answer) {
    if (answer != NULL) *answer = NULL;
    const obscura_status status = obscura_begin(client, name, fields);
    return status == OBSCURA_OK ? obscura_wait(client, -1, answer) : status;
}

/* Connections */

/** Says hello, with the proof of a token if there is one. */
static obscura_status greet(obscura_client* client, const char* token_file) {
    obscura_value* fields = obscura_map("protocol_min", obscura_int(1), "protocol_max", obscura_int(1),
                                        "client", obscura_string("libobscura-client"), NULL);
    if (token_file != NULL) {
        obscura_answer* answer;
        const obscura_status status = obscura_call(client, "challenge", NULL, &answer);
        char proof[65], why[512] = "";
        const char* challenge = obscura_as_string(obscura_find(obscura_answer_map(answer), "challenge"));
        const int proved = status == OBSCURA_OK && oc_prove(token_file, challenge, proof, why, sizeof why);
        obscura_answer_free(answer);
        if (!proved) {
            obscura_value_free(fields);
            return status != OBSCURA_OK ? status
                                        : oc_fail(&client->error, OBSCURA_BAD_USE, "bad-use", "%s", why);
        }
        obscura_put(fields, "proof", obscura_string(proof));
    }
    return obscura_call(client, "hello", fields, &client->hello);
}

obscura_client* obscura_connect(const char* address, const obscura_connect_options* options,
                                obscura_error* error) {
    static const obscura_connect_options defaults = {0};
    if (options == NULL) options = &defaults;
    obscura_client* client = calloc(1, sizeof *client);
    if (address == NULL || client == NULL) {
        free(client);
        oc_fail(error, OBSCURA_BAD_USE, "bad-use", "%s",
                address == NULL ? "no address" : "not enough memory");
        return NULL;
    }
    client->socket = client->wake[0] = client->wake[1] = -1;
    client->server.input = client->server.complaints = -1;
    const double timeout_s = options->timeout_s > 0 ? options->timeout_s : 600;
    client->timeout_s = options->connect_timeout_s > 0 ? options->connect_timeout_s : timeout_s;
    client->max_body_bytes = options->max_body_bytes > 0 ? options->max_body_bytes : (uint64_t)1 << 36;
    client->next_id = 1;
    client->address = oc_text_copy(address, strlen(address));
    char why[512];
    if (client->address == NULL || !oc_pipe(client->wake)) {
        oc_fail(&client->error, OBSCURA_BAD_USE, "bad-use", "not enough memory or descriptors");
    } else if ((client->socket = oc_open(address, oc_now_s() + client->timeout_s, why, sizeof why)) < 0) {
        oc_lose(client, "%s", why);
    } else if (greet(client, options->token_file) == OBSCURA_OK) {
        client->timeout_s = timeout_s;
        return client;
    }
    if (error != NULL) *error = client->error;
    obscura_close(client);
    return NULL;
}

void obscura_close(obscura_client* client) {
    if (client == NULL) return;
    oc_close(&client->socket);
    oc_close(&client->wake[0]);
    oc_close(&client->wake[1]);
    oc_server_end(&client->server, NULL, 0);
    while (client->files.count > 0)
        oc_close(&client->files.descriptors[--client->files.count]);
    oc_receive_next(&client->in);
    obscura_answer_free(client->hello);
    free(client->address);
    free(client);
}

const obscura_error* obscura_last_error(const obscura_client* client) {
    return &client->error;
}

const obscura_value* obscura_server(const obscura_client* client) {
    return obscura_answer_map(client->hello);
}

int obscura_socket(const obscura_client* client) {
    return client->socket;
}

void obscura_set_progress(obscura_client* client, obscura_progress progress, void* context) {
    client->progress = progress;
    client->context = context;
}
