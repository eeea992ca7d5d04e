/* SPDX-License-Identifier: Apache-2.0 */
/* Stand-in for Simulink's simstruc.h: what obscura_sfun.c uses of it, with checks of ports and numbers. */
#ifndef SIMSTRUC_H
#define SIMSTRUC_H

#include <assert.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef int int_T;

/* Parameters of the dialog: numbers or a text */
typedef struct mxArray {
    const char* text; /* NULL: numbers */
    const double* numbers;
    size_t count;
} mxArray;

static inline int mxIsChar(const mxArray* array) {
    return array->text != NULL;
}
static inline int mxIsDouble(const mxArray* array) {
    return array->text == NULL;
}
static inline size_t mxGetNumberOfElements(const mxArray* array) {
    return array->text != NULL ? strlen(array->text) : array->count;
}
static inline int mxIsEmpty(const mxArray* array) {
    return mxGetNumberOfElements(array) == 0;
}
static inline const double* mxGetPr(const mxArray* array) {
    assert(array->text == NULL);
    return array->numbers;
}
static inline int mxGetString(const mxArray* array, char* text, size_t bytes) {
    assert(array->text != NULL && strlen(array->text) < bytes);
    strcpy(text, array->text);
    return 0;
}

/* The block. Sizes are set before the start, memory of the signals is given out at it. */
enum { SS_DOUBLE, SS_SINGLE };
enum { SS_OPTION_CALL_TERMINATE_ON_EXIT = 1 };
enum { MOST_PORTS = 4, MOST_PARAMETERS = 16 };

typedef struct Port {
    int rows, columns, type, contiguous, feedthrough;
    void* signal;
} Port;

typedef struct SimStruct {
    int wanted_parameters, parameter_count, inputs, outputs, sample_times, work_count;
    unsigned options;
    mxArray parameters[MOST_PARAMETERS];
    int tunable[MOST_PARAMETERS];
    Port input[MOST_PORTS], output[MOST_PORTS];
    double sample_time, offset;
    void* work_memory[1];
    void** work; /* NULL before the start */
    const char* error;
} SimStruct;

static inline Port* port_of(Port* ports, int count, int number) {
    assert(number >= 0 && number < count);
    return &ports[number];
}
#define INPUT(S, number) port_of((S)->input, (S)->inputs, number)
#define OUTPUT(S, number) port_of((S)->output, (S)->outputs, number)

#define ssSetNumSFcnParams(S, count) ((S)->wanted_parameters = (count))
#define ssGetNumSFcnParams(S) ((S)->wanted_parameters)
#define ssGetSFcnParamsCount(S) ((S)->parameter_count)
#define ssGetSFcnParam(S, number) ((const mxArray*)&(S)->parameters[number])
#define ssSetSFcnParamTunable(S, number, is) ((S)->tunable[number] = (is))
#define ssSetErrorStatus(S, text) ((S)->error = (text))
#define ssGetErrorStatus(S) ((S)->error)
#define ssSetNumContStates(S, count) assert((count) == 0)
#define ssSetNumDiscStates(S, count) assert((count) == 0)
#define ssSetNumInputPorts(S, count) ((S)->inputs = (count), (count) <= MOST_PORTS)
#define ssSetNumOutputPorts(S, count) ((S)->outputs = (count), (count) <= MOST_PORTS)
#define ssSetInputPortMatrixDimensions(S, number, m, n)                                                      \
    (INPUT(S, number)->rows = (m), INPUT(S, number)->columns = (n))
#define ssSetOutputPortMatrixDimensions(S, number, m, n)                                                     \
    (OUTPUT(S, number)->rows = (m), OUTPUT(S, number)->columns = (n))
#define ssSetInputPortWidth(S, number, width) ssSetInputPortMatrixDimensions(S, number, width, 1)
#define ssSetOutputPortWidth(S, number, width) ssSetOutputPortMatrixDimensions(S, number, width, 1)
#define ssGetOutputPortWidth(S, number) (OUTPUT(S, number)->rows * OUTPUT(S, number)->columns)
#define ssSetInputPortRequiredContiguous(S, number, is) (INPUT(S, number)->contiguous = (is))
#define ssSetInputPortDirectFeedThrough(S, number, is) (INPUT(S, number)->feedthrough = (is))
#define ssSetOutputPortDataType(S, number, kind) (OUTPUT(S, number)->type = (kind))
#define ssGetInputPortSignal(S, number)                                                                      \
    (assert(INPUT(S, number)->contiguous), (const void*)INPUT(S, number)->signal)
#define ssGetOutputPortSignal(S, number) (OUTPUT(S, number)->signal)
#define ssSetNumSampleTimes(S, count) ((S)->sample_times = (count))
#define ssSetSampleTime(S, number, seconds) (assert((number) == 0), (S)->sample_time = (seconds))
#define ssSetOffsetTime(S, number, seconds) (assert((number) == 0), (S)->offset = (seconds))
#define ssSetNumPWork(S, count) (assert((count) <= 1), (S)->work_count = (count))
#define ssGetPWork(S) ((S)->work)
#define ssGetPWorkValue(S, number) ((S)->work[number])
#define ssSetPWorkValue(S, number, value) ((S)->work[number] = (value))
#define ssSetOptions(S, bits) ((S)->options = (bits))

#endif
