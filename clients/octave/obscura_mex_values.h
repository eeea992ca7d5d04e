/* SPDX-License-Identifier: Apache-2.0 */
/* Values of the client as arrays of Octave and MATLAB. */
#ifndef OBSCURA_MEX_VALUES_H
#define OBSCURA_MEX_VALUES_H

#include <mex.h>
#include <obscura_client.h>

/** The value that an array means: a struct is a map, a char array a string, a vector an array, a matrix an
 * array of its rows, a cell array an array, [] nil. Integer classes are integers, and so is a double scalar
 * that is whole; other numbers are numbers. NULL with the reason in `why` if it cannot be sent. */
obscura_value* obscura_value_of(const mxArray* array, const char** why);

/** The array of a value: a map is a struct, an array of numbers a row, an array of rows of one length a
 * matrix, any other array a cell array, nil []. */
mxArray* obscura_mx_of(const obscura_value* value);

/** Struct with the arrays of an answer: [bands, rows, columns] in C order as rows x columns x bands. */
mxArray* obscura_mx_arrays(const obscura_answer* answer);

#endif
