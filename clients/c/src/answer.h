/* SPDX-License-Identifier: Apache-2.0 */
/* Answer of a call: its map and views of its body. */
#ifndef OBSCURA_ANSWER_H
#define OBSCURA_ANSWER_H

#include "client.h"

/** Makes an answer of a head and the body that was received with it, both of which are taken over. NULL with
 * a reason in `why` if the rows `arrays` of the head do not describe the body, or memory is short. */
obscura_answer* oc_answer_new(obscura_value* map, unsigned char* body, size_t body_bytes, const char** why);
/** Moves the files that came with the answer into it: as many as its head says. */
void oc_answer_take_files(obscura_answer* answer, oc_files* files);
/** Takes the map out of the answer. */
obscura_value* oc_answer_take_map(obscura_answer* answer);

#endif
