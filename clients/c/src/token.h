/* SPDX-License-Identifier: Apache-2.0 */
/* Proof that this client has the token that a server wants. */
#ifndef OBSCURA_TOKEN_H
#define OBSCURA_TOKEN_H

#include <stddef.h>

/** Reads the token of a file and writes the proof for this challenge, HMAC-SHA256 in 64 hexadecimal digits. 0
 * with one line in `why` if the file has no token, or the challenge is none. */
int oc_prove(const char* file, const char* challenge, char proof[65], char* why, size_t why_bytes);

#endif
