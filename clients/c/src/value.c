/* SPDX-License-Identifier: Apache-2.0 */
#include "value.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

obscura_value* oc_value_new(obscura_type type) {
    obscura_value* value = calloc(1, sizeof *value);
    if (value != NULL) value->type = type;
    return value;
}

char* oc_text_copy(const char* text, size_t bytes) {
    char* copy = malloc(bytes + 1);
    if (copy == NULL) return NULL;
    if (bytes > 0) memcpy(copy, text, bytes);
    copy[bytes] = 0;
    return copy;
}

void obscura_value_free(obscura_value* value) {
    if (value == NULL) return;
    if (value->type >= OBSCURA_ARRAY)
        for (size_t i = 0; i < value->count; ++i) {
            obscura_value_free(value->items[i]);
            if (value->names != NULL) free(value->names[i]);
        }
    free(value->items);
    free(value->names);
    free(value->text);
    free(value);
}

/** Room for one more; 0 if memory is short. */
static int grow(obscura_value* to) {
    if (to->count < to->room) return 1;
    const size_t room = to->room == 0 ? 4 : 2 * to->room;
    obscura_value** items = realloc(to->items, room * sizeof *items);
    if (items == NULL) return 0;
    to->items = items;
    if (to->type == OBSCURA_MAP) {
        char** names = realloc(to->names, room * sizeof *names);
        if (names == NULL) return 0;
        to->names = names;
    }
    to->room = room;
    return 1;
}

int oc_value_add(obscura_value* to, char* name, obscura_value* item) {
    if (item == NULL || !grow(to)) {
        free(name);
        obscura_value_free(item);
        return 0;
    }
    if (to->names != NULL) to->names[to->count] = name;
    to->items[to->count++] = item;
    return 1;
}

/* Makers */

obscura_value* obscura_nil(void) {
    return oc_value_new(OBSCURA_NIL);
}

obscura_value* obscura_bool(int value) {
    obscura_value* made = oc_value_new(OBSCURA_BOOL);
    if (made != NULL) made->is.boolean = value != 0;
    return made;
}

obscura_value* obscura_int(int64_t value) {
    obscura_value* made = oc_value_new(OBSCURA_INT);
    if (made != NULL) made->is.integer = value;
    return made;
}

obscura_value* obscura_number(double value) {
    obscura_value* made = oc_value_new(OBSCURA_NUMBER);
    if (made != NULL) made->is.number = value;
    return made;
}

obscura_value* obscura_text(const char* text, size_t bytes) {
    obscura_value* made = oc_value_new(OBSCURA_STRING);
    if (made == NULL) return NULL;
    made->text = oc_text_copy(text, bytes);
    made->count = bytes;
    if (made->text != NULL) return made;
    free(made);
    return NULL;
}

obscura_value* obscura_string(const char* text) {
    return text == NULL ? NULL : obscura_text(text, strlen(text));
}

obscura_value* obscura_array_new(void) {
    return oc_value_new(OBSCURA_ARRAY);
}

void obscura_append(obscura_value* array, obscura_value* element) {
    if (array == NULL || array->type != OBSCURA_ARRAY) {
        obscura_value_free(element);
        return;
    }
    if (!oc_value_add(array, NULL, element)) array->unfit = 1;
}

obscura_value* obscura_numbers(const double* values, size_t count) {
    obscura_value* made = obscura_array_new();
    for (size_t i = 0; i < count; ++i)
        obscura_append(made, obscura_number(values[i]));
    return made;
}

obscura_value* obscura_vector(double x, double y, double z) {
    return obscura_numbers((double[]){x, y, z}, 3);
}

obscura_value* obscura_strings(const char* const* texts) {
    obscura_value* made = obscura_array_new();
    for (; texts != NULL && *texts != NULL; ++texts)
        obscura_append(made, obscura_string(*texts));
    return made;
}

void obscura_put(obscura_value* map, const char* name, obscura_value* value) {
    if (map == NULL || map->type != OBSCURA_MAP || name == NULL) {
        obscura_value_free(value);
        return;
    }
    for (size_t i = 0; value != NULL && i < map->count; ++i) {
        if (strcmp(map->names[i], name) != 0) continue;
        obscura_value_free(map->items[i]);
        map->items[i] = value;
        return;
    }
    char* copy = oc_text_copy(name, strlen(name));
    if (copy == NULL) {
        obscura_value_free(value);
        map->unfit = 1;
    } else if (!oc_value_add(map, copy, value)) {
        map->unfit = 1;
    }
}

obscura_value* obscura_map_new(void) {
    return oc_value_new(OBSCURA_MAP);
}

obscura_value* obscura_map(const char* name, ...) {
    obscura_value* map = obscura_map_new();
    va_list rest;
    va_start(rest, name);
    for (; name != NULL; name = va_arg(rest, const char*))
        obscura_put(map, name, va_arg(rest, obscura_value*));
    va_end(rest);
    return map;
}

obscura_value* obscura_value_copy(const obscura_value* value) {
    if (value == NULL) return NULL;
    if (value->type == OBSCURA_STRING) return obscura_text(value->text, value->count);
    obscura_value* copy = oc_value_new(value->type);
    if (copy == NULL) return NULL;
    copy->is = value->is;
    copy->unfit = value->unfit;
    for (size_t i = 0; i < value->count; ++i) {
        char* name = value->names == NULL ? NULL : oc_text_copy(value->names[i], strlen(value->names[i]));
        obscura_value* item = obscura_value_copy(value->items[i]);
        if (value->names != NULL && name == NULL) {
            obscura_value_free(item);
            copy->unfit = 1;
        } else if (!oc_value_add(copy, name, item)) {
            copy->unfit = 1;
        }
    }
    return copy;
}

/* Readers */

obscura_type obscura_type_of(const obscura_value* value) {
    return value == NULL ? OBSCURA_NIL : value->type;
}

int obscura_as_bool(const obscura_value* value) {
    return obscura_type_of(value) == OBSCURA_BOOL && value->is.boolean;
}

int64_t obscura_as_int(const obscura_value* value, int64_t otherwise) {
    return obscura_type_of(value) == OBSCURA_INT ? value->is.integer : otherwise;
}

double obscura_as_number(const obscura_value* value, double otherwise) {
    if (obscura_type_of(value) == OBSCURA_INT) return (double)value->is.integer;
    return obscura_type_of(value) == OBSCURA_NUMBER ? value->is.number : otherwise;
}

const char* obscura_as_string(const obscura_value* value) {
    return obscura_type_of(value) == OBSCURA_STRING ? value->text : NULL;
}

size_t obscura_count(const obscura_value* value) {
    return value == NULL ? 0 : value->count;
}

const obscura_value* obscura_at(const obscura_value* value, size_t number) {
    return obscura_type_of(value) >= OBSCURA_ARRAY && number < value->count ? value->items[number] : NULL;
}

const char* obscura_name_at(const obscura_value* map, size_t number) {
    return obscura_type_of(map) == OBSCURA_MAP && number < map->count ? map->names[number] : NULL;
}

const obscura_value* obscura_find(const obscura_value* map, const char* name) {
    if (obscura_type_of(map) != OBSCURA_MAP || name == NULL) return NULL;
    for (size_t i = 0; i < map->count; ++i)
        if (strcmp(map->names[i], name) == 0) return map->items[i];
    return NULL;
}
