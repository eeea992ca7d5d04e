/* SPDX-License-Identifier: Apache-2.0 */
/* MessagePack of message heads: nil, booleans, integers, numbers, strings, arrays and maps with names as
 * keys. */
#ifndef OBSCURA_MESSAGEPACK_H
#define OBSCURA_MESSAGEPACK_H

#include "obscura_client.h"

enum {
    OC_DEEPEST = 16,         /**< levels of arrays and maps */
    OC_MOST_VALUES = 1 << 20 /**< in one head that is read */
};

/** Bytes that grow. */
typedef struct oc_buffer {
    unsigned char* data;
    size_t size, room;
    int failed; /**< memory was short: what is in it is not whole */
} oc_buffer;

void oc_buffer_add(oc_buffer* buffer, const void* data, size_t bytes);

/** Puts the value behind what is in `out`. Returns NULL, or why it cannot be sent. */
const char* oc_pack(oc_buffer* out, const obscura_value* value);

/** The one value that `data` holds; NULL, with the reason in `why`, if it is not whole, goes on behind it, is
 * too deep, has too many values, or has a key that is no string. Takes memory in proportion to `bytes`. */
obscura_value* oc_unpack(const unsigned char* data, size_t bytes, const char** why);

#endif
