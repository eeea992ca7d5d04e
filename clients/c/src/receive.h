/* SPDX-License-Identifier: Apache-2.0 */
/* Messages that arrive: frame of 24 bytes, head, arrays. */
#ifndef OBSCURA_RECEIVE_H
#define OBSCURA_RECEIVE_H

#include "client.h"

enum { OC_FRAME_BYTES = 24, OC_MOST_HEAD_BYTES = 1 << 24 };
enum { OC_REQUEST = 1, OC_ANSWER = 2, OC_EVENT = 3, OC_ERROR = 4 };

/** Reads what has arrived, without waiting. Returns 1: a message is whole; 0: more is to come; -1: the
 * connection is lost, and client->error says why. */
int oc_receive(obscura_client* client);
/** Makes room for the next message. */
void oc_receive_next(oc_incoming* in);

#endif
