/* SPDX-License-Identifier: Apache-2.0 */
#include "obscura_mex_values.h"

#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { DEEPEST = 16 };

/* To the server */

/** Whether a number is sent as an integer. */
static int is_whole(double number) {
    return number == floor(number) && fabs(number) < 9007199254740992.0 && !(number == 0 && signbit(number));
}

static double element(const mxArray* array, size_t at) {
    const void* data = mxGetData(array);
#define ELEMENT(class, type)                                                                                 \
    case mx##class##_CLASS:                                                                                  \
        return (double)((const type*)data)[at];
    switch (mxGetClassID(array)) {
        ELEMENT(DOUBLE, double)
        ELEMENT(SINGLE, float)
        ELEMENT(INT8, int8_t)
        ELEMENT(UINT8, uint8_t)
        ELEMENT(INT16, int16_t)
        ELEMENT(UINT16, uint16_t)
        ELEMENT(INT32, int32_t)
        ELEMENT(UINT32, uint32_t)
        ELEMENT(INT64, int64_t)
        ELEMENT(UINT64, uint64_t)
    default:
        return mxIsLogical(array) ? (double)((const mxLogical*)data)[at] : NAN;
    }
#undef ELEMENT
}

static obscura_value* number_value(const mxArray* array, size_t at, int whole) {
    if (mxIsLogical(array)) return obscura_bool(element(array, at) != 0);
    return whole ? obscura_int((int64_t)element(array, at)) : obscura_number(element(array, at));
}

/** A double scalar is an integer if it is whole; an array of doubles are numbers: a key wants the one or the
 * other. */
static obscura_value* numbers_of(const mxArray* array) {
    const size_t rows = mxGetM(array), columns = mxGetN(array), count = mxGetNumberOfElements(array);
    const int is_real = mxIsDouble(array) || mxIsSingle(array);
    const int whole = !is_real || (mxIsDouble(array) && count == 1 && is_whole(element(array, 0)));
    if (count == 1) return number_value(array, 0, whole);
    obscura_value* all = obscura_array_new();
    const int is_matrix = rows > 1 && columns > 1;
    for (size_t row = 0; row < (is_matrix ? rows : count); ++row) {
        if (!is_matrix) {
            obscura_append(all, number_value(array, row, whole));
            continue;
        }
        obscura_value* line = obscura_array_new();
        for (size_t column = 0; column < columns; ++column)
            obscura_append(line, number_value(array, row + rows * column, whole));
        obscura_append(all, line);
    }
    return all;
}

static obscura_value* value_of(const mxArray* array, int depth, const char** why);

static obscura_value* map_of(const mxArray* array, size_t at, int depth, const char** why) {
    obscura_value* map = obscura_map_new();
    for (int i = 0; i < mxGetNumberOfFields(array); ++i)
        obscura_put(map, mxGetFieldNameByNumber(array, i),
                    value_of(mxGetFieldByNumber(array, at, i), depth + 1, why));
    return map;
}

static obscura_value* value_of(const mxArray* array, int depth, const char** why) {
    if (depth > DEEPEST) *why = "a value has more than 16 levels";
    if (*why != NULL) return NULL;
    if (array == NULL) return obscura_nil();
    const size_t count = mxGetNumberOfElements(array);
    if (mxIsChar(array)) {
        char* text = mxArrayToString(array);
        obscura_value* made = obscura_string(text == NULL ? "" : text);
        mxFree(text);
        return made;
    }
    if (mxIsStruct(array) && count == 1) return map_of(array, 0, depth, why);
    if (mxIsStruct(array) || mxIsCell(array)) {
        obscura_value* all = obscura_array_new();
        for (size_t i = 0; i < count; ++i)
            obscura_append(all, mxIsCell(array) ? value_of(mxGetCell(array, i), depth + 1, why)
                                                : map_of(array, i, depth + 1, why));
        return all;
    }
    if ((!mxIsNumeric(array) && !mxIsLogical(array)) || mxIsComplex(array) || mxIsSparse(array) ||
        mxGetNumberOfDimensions(array) > 2) {
        *why = "only numbers, strings, structs, cell arrays and matrices of real numbers can be sent";
        return NULL;
    }
    return count == 0 ? obscura_nil() : numbers_of(array);
}

obscura_value* obscura_value_of(const mxArray* array, const char** why) {
    *why = NULL;
    obscura_value* made = value_of(array, 0, why);
    if (*why == NULL) return made;
    obscura_value_free(made);
    return NULL;
}

/* From the server */

static int is_number(const obscura_value* value) {
    return obscura_type_of(value) == OBSCURA_INT || obscura_type_of(value) == OBSCURA_NUMBER;
}

/** Length that all rows of numbers have; 0: it is no array of such. */
static size_t row_length(const obscura_value* rows) {
    const size_t length = obscura_count(obscura_at(rows, 0));
    for (size_t row = 0; row < obscura_count(rows); ++row) {
        const obscura_value* line = obscura_at(rows, row);
        if (obscura_type_of(line) != OBSCURA_ARRAY || obscura_count(line) != length) return 0;
        for (size_t i = 0; i < length; ++i)
            if (!is_number(obscura_at(line, i))) return 0;
    }
    return length;
}

static mxArray* array_of(const obscura_value* value) {
    const size_t count = obscura_count(value), length = row_length(value);
    int numbers = 1;
    for (size_t i = 0; i < count; ++i)
        numbers = numbers && is_number(obscura_at(value, i));
    if (numbers) {
        mxArray* made = mxCreateDoubleMatrix(1, count, mxREAL);
        for (size_t i = 0; i < count; ++i)
            ((double*)mxGetData(made))[i] = obscura_as_number(obscura_at(value, i), NAN);
        return made;
    }
    if (length > 0) {
        mxArray* made = mxCreateDoubleMatrix(count, length, mxREAL);
        for (size_t row = 0; row < count; ++row)
            for (size_t i = 0; i < length; ++i)
                ((double*)mxGetData(made))[row + count * i] =
                    obscura_as_number(obscura_at(obscura_at(value, row), i), NAN);
        return made;
    }
    mxArray* made = mxCreateCellMatrix(1, count);
    for (size_t i = 0; i < count; ++i)
        mxSetCell(made, i, obscura_mx_of(obscura_at(value, i)));
    return made;
}

/** Puts a field into a struct; its name as one that is allowed: "normal.x" is normal_x. */
static void put_field(mxArray* to, const char* name, mxArray* value) {
    char legal[64] = "x";
    size_t at = isalpha((unsigned char)name[0]) ? 0 : 1;
    for (; *name != 0 && at < sizeof legal - 1; ++name)
        legal[at++] = isalnum((unsigned char)*name) ? *name : '_';
    legal[at] = 0;
    int number = mxGetFieldNumber(to, legal);
    if (number < 0) number = mxAddField(to, legal);
    mxSetFieldByNumber(to, 0, number, value);
}

mxArray* obscura_mx_of(const obscura_value* value) {
    switch (obscura_type_of(value)) {
    case OBSCURA_NIL:
        break;
    case OBSCURA_BOOL:
        return mxCreateLogicalScalar(obscura_as_bool(value) != 0);
    case OBSCURA_INT:
    case OBSCURA_NUMBER:
        return mxCreateDoubleScalar(obscura_as_number(value, NAN));
    case OBSCURA_STRING:
        return mxCreateString(obscura_as_string(value));
    case OBSCURA_ARRAY:
        return array_of(value);
    case OBSCURA_MAP: {
        mxArray* made = mxCreateStructMatrix(1, 1, 0, NULL);
        for (size_t i = 0; i < obscura_count(value); ++i)
            put_field(made, obscura_name_at(value, i), obscura_mx_of(obscura_at(value, i)));
        return made;
    }
    }
    return mxCreateDoubleMatrix(0, 0, mxREAL);
}

static mxClassID class_of(const char* dtype) {
    static const struct {
        const char* dtype;
        mxClassID class;
    } classes[] = {{"f4", mxSINGLE_CLASS}, {"f8", mxDOUBLE_CLASS}, {"u1", mxUINT8_CLASS},
                   {"u2", mxUINT16_CLASS}, {"u4", mxUINT32_CLASS}, {"u8", mxUINT64_CLASS},
                   {"i1", mxINT8_CLASS},   {"i2", mxINT16_CLASS},  {"i4", mxINT32_CLASS},
                   {"i8", mxINT64_CLASS}};
    for (size_t i = 0; i < sizeof classes / sizeof *classes; ++i)
        if (strcmp(classes[i].dtype, dtype + 1) == 0) return classes[i].class;
    return mxUNKNOWN_CLASS;
}

/** Rows become columns, in blocks of which the cache holds reads and writes. */
#define TRANSPOSE(type)                                                                                      \
    for (size_t block_row = 0; block_row < rows; block_row += block_rows)                                    \
        for (size_t block_column = 0; block_column < columns; block_column += block_columns)                 \
            for (size_t row = block_row; row < rows && row < block_row + block_rows; ++row)                  \
                for (size_t column = block_column;                                                           \
                     column < columns && column < block_column + block_columns; ++column)                    \
                    ((type*)to)[row + rows * column] = ((const type*)from)[column + columns * row];

static void transpose(void* to, const void* from, size_t rows, size_t columns, size_t bytes) {
    enum { block_rows = 64, block_columns = 8 };
    switch (bytes) {
    case 1:
        TRANSPOSE(uint8_t) break;
    case 2:
        TRANSPOSE(uint16_t) break;
    case 4:
        TRANSPOSE(uint32_t) break;
    default:
        TRANSPOSE(uint64_t) break;
    }
}

static mxArray* pixels_of(const obscura_array* array) {
    const size_t n = array->dimensions;
    const size_t columns = n > 0 ? array->shape[n - 1] : 1, rows = n > 1 ? array->shape[n - 2] : 1;
    const size_t plane = rows * columns;
    const mxClassID class = class_of(array->dtype);
    if (class == mxUNKNOWN_CLASS || array->count == 0) return mxCreateDoubleMatrix(0, 0, mxREAL);
    const mwSize shape[] = {rows, columns, array->count / plane};
    mxArray* made = mxCreateNumericArray(3, shape, class, mxREAL);
    const size_t each = array->bytes / array->count;
    for (size_t at = 0; at < array->count; at += plane)
        transpose((char*)mxGetData(made) + at * each, (const char*)array->data + at * each, rows, columns,
                  each);
    return made;
}

mxArray* obscura_mx_arrays(const obscura_answer* answer) {
    mxArray* made = mxCreateStructMatrix(1, 1, 0, NULL);
    for (size_t i = 0; i < obscura_array_count(answer); ++i) {
        const obscura_array* array = obscura_array_at(answer, i);
        put_field(made, array->name, pixels_of(array));
    }
    return made;
}
