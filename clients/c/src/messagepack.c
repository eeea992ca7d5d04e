/* SPDX-License-Identifier: Apache-2.0 */
#include "messagepack.h"

#include "value.h"

#include <stdlib.h>
#include <string.h>

/* Writing */

void oc_buffer_add(oc_buffer* buffer, const void* data, size_t bytes) {
    if (buffer->failed || bytes == 0) return;
    if (bytes > buffer->room - buffer->size) {
        size_t room = buffer->room == 0 ? 256 : buffer->room;
        while (room - buffer->size < bytes && room < SIZE_MAX / 2)
            room *= 2;
        unsigned char* grown = room - buffer->size < bytes ? NULL : realloc(buffer->data, room);
        if (grown == NULL) {
            buffer->failed = 1;
            return;
        }
        buffer->data = grown;
        buffer->room = room;
    }
    memcpy(buffer->data + buffer->size, data, bytes);
    buffer->size += bytes;
}

/** First byte, then the low `bytes` of `number`, the highest first. */
static void add_coded(oc_buffer* out, unsigned code, uint64_t number, int bytes) {
    unsigned char text[9] = {(unsigned char)code};
    for (int i = 0; i < bytes; ++i)
        text[1 + i] = (unsigned char)(number >> (8 * (bytes - 1 - i)));
    oc_buffer_add(out, text, 1 + (size_t)bytes);
}

/** Start of a string (`code8` 0xD9), array or map (no form of 8 bits: 0). */
static void add_count(oc_buffer* out, size_t count, unsigned fix, size_t fix_most, unsigned code8,
                      unsigned code16) {
    if (count <= fix_most)
        add_coded(out, fix | (unsigned)count, 0, 0);
    else if (code8 != 0 && count <= 0xFF)
        add_coded(out, code8, count, 1);
    else if (count <= 0xFFFF)
        add_coded(out, code16, count, 2);
    else
        add_coded(out, code16 + 1, count, 4);
}

static void add_text(oc_buffer* out, const char* text, size_t bytes) {
    add_count(out, bytes, 0xA0, 31, 0xD9, 0xDA);
    oc_buffer_add(out, text, bytes);
}

static uint64_t bits_of(double number) {
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

static const char unfit[] = "a value is missing (NULL), or memory was short when it was made";

static const char* pack(oc_buffer* out, const obscura_value* value, int depth) {
    if (value->unfit) return unfit;
    if (value->count > UINT32_MAX) return "a value has more than 2^32 - 1 bytes or elements";
    switch (value->type) {
    case OBSCURA_NIL:
        add_coded(out, 0xC0, 0, 0);
        return NULL;
    case OBSCURA_BOOL:
        add_coded(out, value->is.boolean ? 0xC3 : 0xC2, 0, 0);
        return NULL;
    case OBSCURA_INT:
        if (value->is.integer >= 0 && value->is.integer < 128)
            add_coded(out, (unsigned)value->is.integer, 0, 0);
        else
            add_coded(out, 0xD3, (uint64_t)value->is.integer, 8);
        return NULL;
    case OBSCURA_NUMBER:
        add_coded(out, 0xCB, bits_of(value->is.number), 8);
        return NULL;
    case OBSCURA_STRING:
        add_text(out, value->text, value->count);
        return NULL;
    case OBSCURA_ARRAY:
    case OBSCURA_MAP:
        break;
    }
    if (depth == OC_DEEPEST) return "a value has more than 16 levels";
    const int is_map = value->type == OBSCURA_MAP;
    add_count(out, value->count, is_map ? 0x80 : 0x90, 15, 0, is_map ? 0xDE : 0xDC);
    for (size_t i = 0; i < value->count; ++i) {
        if (is_map) add_text(out, value->names[i], strlen(value->names[i]));
        const char* why = pack(out, value->items[i], depth + 1);
        if (why != NULL) return why;
    }
    return NULL;
}

const char* oc_pack(oc_buffer* out, const obscura_value* value) {
    const char* why = value == NULL ? unfit : pack(out, value, 0);
    return why == NULL && out->failed ? "not enough memory" : why;
}

/* Reading */

typedef struct {
    const unsigned char* data;
    size_t bytes, at, values;
    const char* why;
} reader;

static const char short_of_memory[] = "not enough memory for a head";

static obscura_value* stop(reader* in, const char* why) {
    if (in->why == NULL) in->why = why;
    return NULL;
}

/** `bytes` as a number, the highest first. 0 with `why` set if they are not there. */
static uint64_t take(reader* in, size_t bytes) {
    if (bytes > in->bytes - in->at) {
        (void)stop(in, "a head ends early");
        return 0;
    }
    uint64_t number = 0;
    for (size_t i = 0; i < bytes; ++i)
        number = number << 8 | in->data[in->at++];
    return number;
}

static double double_of(uint64_t bits) {
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

static double float_of(uint32_t bits) {
    float number;
    memcpy(&number, &bits, sizeof number);
    return (double)number;
}

/** The next `count` bytes as text; NULL with `why` set. */
static char* take_text(reader* in, uint64_t count) {
    if (in->why != NULL) return NULL;
    if (count > in->bytes - in->at) {
        (void)stop(in, "a head ends early");
        return NULL;
    }
    char* text = oc_text_copy((const char*)in->data + in->at, (size_t)count);
    if (text == NULL) (void)stop(in, short_of_memory);
    in->at += (size_t)count;
    return text;
}

/** Bytes of the string that begins here; -1: no string does. */
static int64_t text_bytes(reader* in, unsigned code) {
    if (code >= 0xA0 && code < 0xC0) return code & 31;
    if (code < 0xD9 || code > 0xDB) return -1;
    return (int64_t)take(in, (size_t)1 << (code - 0xD9));
}

static obscura_value* read_value(reader* in, int depth);

/** Elements or members behind their count. */
static obscura_value* read_items(reader* in, obscura_type type, uint64_t count, int depth) {
    if (depth == OC_DEEPEST) return stop(in, "a head has more than 16 levels");
    if (count > (in->bytes - in->at) / (type == OBSCURA_MAP ? 2 : 1)) return stop(in, "a head ends early");
    obscura_value* all = oc_value_new(type);
    if (all == NULL) return stop(in, short_of_memory);
    for (uint64_t i = 0; i < count && in->why == NULL; ++i) {
        char* name = NULL;
        if (type == OBSCURA_MAP) {
            const int64_t bytes = text_bytes(in, (unsigned)take(in, 1));
            if (bytes < 0) (void)stop(in, "a head has a key that is no string");
            name = take_text(in, (uint64_t)bytes);
            if (name == NULL) break;
        }
        if (!oc_value_add(all, name, read_value(in, depth + 1))) (void)stop(in, short_of_memory);
    }
    if (in->why == NULL) return all;
    obscura_value_free(all);
    return NULL;
}

static obscura_value* made(reader* in, obscura_value* value) {
    if (in->why == NULL) return value != NULL ? value : stop(in, short_of_memory);
    obscura_value_free(value);
    return NULL;
}

static obscura_value* read_unsigned(reader* in, size_t bytes) {
    const uint64_t number = take(in, bytes);
    if (number > INT64_MAX) return stop(in, "a head has an integer beyond 64 bits with sign");
    return made(in, obscura_int((int64_t)number));
}

static obscura_value* read_signed(reader* in, size_t bytes) {
    const uint64_t number = take(in, bytes), sign = (uint64_t)1 << (8 * bytes - 1);
    return made(in, obscura_int((int64_t)((number ^ sign) - sign)));
}

static obscura_value* read_text(reader* in, unsigned code) {
    const uint64_t bytes = (uint64_t)text_bytes(in, code);
    obscura_value* value = made(in, oc_value_new(OBSCURA_STRING));
    if (value == NULL) return NULL;
    value->text = take_text(in, bytes);
    value->count = (size_t)bytes;
    return made(in, value);
}

static obscura_value* read_value(reader* in, int depth) {
    const unsigned code = (unsigned)take(in, 1);
    if (in->why != NULL) return NULL;
    if (++in->values > OC_MOST_VALUES) return stop(in, "a head has more than 2^20 values");
    if (code < 0x80) return made(in, obscura_int((int64_t)code));
    if (code >= 0xE0) return made(in, obscura_int((int64_t)code - 256));
    if (code < 0x90) return read_items(in, OBSCURA_MAP, code & 15, depth);
    if (code < 0xA0) return read_items(in, OBSCURA_ARRAY, code & 15, depth);
    if (code < 0xC0) return read_text(in, code);
    switch (code) {
    case 0xC0:
        return made(in, obscura_nil());
    case 0xC2:
    case 0xC3:
        return made(in, obscura_bool(code == 0xC3));
    case 0xCA:
        return made(in, obscura_number(float_of((uint32_t)take(in, 4))));
    case 0xCB:
        return made(in, obscura_number(double_of(take(in, 8))));
    case 0xCC:
    case 0xCD:
    case 0xCE:
    case 0xCF:
        return read_unsigned(in, (size_t)1 << (code - 0xCC));
    case 0xD0:
    case 0xD1:
    case 0xD2:
    case 0xD3:
        return read_signed(in, (size_t)1 << (code - 0xD0));
    case 0xD9:
    case 0xDA:
    case 0xDB:
        return read_text(in, code);
    case 0xDC:
    case 0xDD:
        return read_items(in, OBSCURA_ARRAY, take(in, code == 0xDC ? 2 : 4), depth);
    case 0xDE:
    case 0xDF:
        return read_items(in, OBSCURA_MAP, take(in, code == 0xDE ? 2 : 4), depth);
    default:
        return stop(in, "a head has something that is not for heads");
    }
}

obscura_value* oc_unpack(const unsigned char* data, size_t bytes, const char** why) {
    reader in = {data, bytes, 0, 0, NULL};
    obscura_value* value = read_value(&in, 0);
    if (value != NULL && in.at != bytes) {
        obscura_value_free(value);
        value = stop(&in, "a head goes on behind its end");
    }
    *why = in.why;
    return value;
}
