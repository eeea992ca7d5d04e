/* SPDX-License-Identifier: Apache-2.0 */
/* Tree of values: what the head of a message holds. */
#ifndef OBSCURA_VALUE_H
#define OBSCURA_VALUE_H

#include "obscura_client.h"

struct obscura_value {
    obscura_type type;
    int unfit; /**< memory was short while it was made: it cannot be sent */
    union {
        int boolean;
        int64_t integer;
        double number;
    } is;
    char* text;            /**< of a string, with a 0 behind its `count` bytes */
    size_t count;          /**< bytes, elements or members */
    size_t room;           /**< of `items` and `names` */
    obscura_value** items; /**< elements, or values of members */
    char** names;          /**< of a map's members */
};

/** New value of that type, 0 or empty; NULL if memory is short. */
obscura_value* oc_value_new(obscura_type type);
/** Puts an element at the end, or a member if `name`, which is taken over, is not NULL. Returns 0 and frees
 * both if memory is short or `item` is NULL. Does not look for a member of that name. */
int oc_value_add(obscura_value* to, char* name, obscura_value* item);
/** `bytes` of `text` with a 0 behind them; NULL if memory is short. */
char* oc_text_copy(const char* text, size_t bytes);

#endif
