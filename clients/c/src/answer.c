/* SPDX-License-Identifier: Apache-2.0 */
#include "answer.h"

#include "transport.h"

#include <stdlib.h>
#include <string.h>

struct obscura_answer {
    obscura_value* map;
    unsigned char* body;
    obscura_array* arrays;
    size_t count;
    int files[OC_MOST_FILES]; /**< -1: taken out */
    size_t file_count;
};

/** Bytes of an element of that type; 0: none that is known. */
static size_t bytes_of(const char* dtype) {
    if (dtype == NULL || strlen(dtype) != 3 || strchr("<|", dtype[0]) == NULL) return 0;
    const size_t bytes = (size_t)(dtype[2] - '0');
    if (dtype[1] == 'f') return bytes == 4 || bytes == 8 ? bytes : 0;
    if (dtype[1] != 'i' && dtype[1] != 'u') return 0;
    return bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8 ? bytes : 0;
}

/** Fills the view that a row describes; returns NULL, or what is wrong with the row. */
static const char* read_row(obscura_array* view, const obscura_value* row, const unsigned char* body,
                            size_t body_bytes) {
    view->name = obscura_as_string(obscura_find(row, "name"));
    view->dtype = obscura_as_string(obscura_find(row, "dtype"));
    const obscura_value* shape = obscura_find(row, "shape");
    const char* codec = obscura_as_string(obscura_find(row, "codec"));
    const int64_t offset = obscura_as_int(obscura_find(row, "offset"), -1),
                  bytes = obscura_as_int(obscura_find(row, "bytes"), -1);
    const size_t each = bytes_of(view->dtype);
    view->dimensions = obscura_count(shape);
    if (codec != NULL && strcmp(codec, "none") != 0) return "an array is compressed";
    if (view->name == NULL || each == 0 || obscura_type_of(shape) != OBSCURA_ARRAY || view->dimensions > 8)
        return "an array has no name, or no shape, or a type that is not known";
    if (offset < 0 || bytes < 0 || (uint64_t)offset > body_bytes ||
        (uint64_t)bytes > body_bytes - (uint64_t)offset || (uint64_t)offset % each != 0)
        return "an array is not inside the body";
    view->bytes = (size_t)bytes;
    view->count = view->bytes / each;
    size_t left = view->count;
    int empty = 0;
    for (size_t i = 0; i < view->dimensions; ++i) {
        const int64_t length = obscura_as_int(obscura_at(shape, i), -1);
        if (length < 0 || (uint64_t)length > SIZE_MAX) return "an array has a length below 0";
        view->shape[i] = (size_t)length;
        if (length == 0)
            empty = 1;
        else if (left % (size_t)length != 0)
            return "an array has another shape than bytes";
        else
            left /= (size_t)length;
    }
    if (view->bytes % each != 0 || (empty ? view->count != 0 : left != 1))
        return "an array has another shape than bytes";
    view->data = offset == 0 ? body : body + offset; /* there may be no body */
    view->floats = strcmp(view->dtype, "<f4") == 0 ? view->data : NULL;
    return NULL;
}

obscura_answer* oc_answer_new(obscura_value* map, unsigned char* body, size_t body_bytes, const char** why) {
    obscura_answer* answer = calloc(1, sizeof *answer);
    if (answer == NULL) {
        *why = "not enough memory";
        obscura_value_free(map);
        free(body);
        return NULL;
    }
    answer->map = map;
    answer->body = body;
    const obscura_value* rows = obscura_find(map, "arrays");
    *why = obscura_type_of(map) != OBSCURA_MAP ? "an answer has no map" : NULL;
    answer->count = obscura_type_of(rows) == OBSCURA_ARRAY ? obscura_count(rows) : 0;
    if (answer->count > 0) answer->arrays = calloc(answer->count, sizeof *answer->arrays);
    if (answer->count > 0 && answer->arrays == NULL) *why = "not enough memory";
    for (size_t i = 0; *why == NULL && i < answer->count; ++i)
        *why = read_row(&answer->arrays[i], obscura_at(rows, i), body, body_bytes);
    if (*why == NULL) return answer;
    obscura_answer_free(answer);
    return NULL;
}

void oc_answer_take_files(obscura_answer* answer, oc_files* files) {
    const int64_t wanted = obscura_as_int(obscura_find(answer->map, "descriptors"), 0);
    if (wanted <= 0) return;
    const size_t most = wanted < OC_MOST_FILES ? (size_t)wanted : OC_MOST_FILES;
    answer->file_count = oc_take_files(files, answer->files, most);
}

int obscura_take_descriptor(obscura_answer* answer, size_t number) {
    if (answer == NULL || number >= answer->file_count) return -1;
    const int file = answer->files[number];
    answer->files[number] = -1;
    return file;
}

obscura_value* oc_answer_take_map(obscura_answer* answer) {
    obscura_value* map = answer->map;
    answer->map = NULL;
    return map;
}

const obscura_value* obscura_answer_map(const obscura_answer* answer) {
    return answer == NULL ? NULL : answer->map;
}

size_t obscura_array_count(const obscura_answer* answer) {
    return answer == NULL ? 0 : answer->count;
}

const obscura_array* obscura_array_at(const obscura_answer* answer, size_t number) {
    return number < obscura_array_count(answer) ? &answer->arrays[number] : NULL;
}

const obscura_array* obscura_array_find(const obscura_answer* answer, const char* name) {
    for (size_t i = 0; i < obscura_array_count(answer); ++i)
        if (strcmp(answer->arrays[i].name, name) == 0) return &answer->arrays[i];
    return NULL;
}

void obscura_answer_free(obscura_answer* answer) {
    if (answer == NULL) return;
    for (size_t i = 0; i < answer->file_count; ++i)
        oc_close(&answer->files[i]);
    obscura_value_free(answer->map);
    free(answer->body);
    free(answer->arrays);
    free(answer);
}
