/* SPDX-License-Identifier: Apache-2.0 */
/* Level-2 S-function `obscura_sfun`: a rendered camera as a Simulink block. The logic is in obscura_block.c.
 *
 * Parameters: sample time; address; scene; bodies; [height width]; samples; longest wait of a step in s.
 *
 * Inputs: time in s; poses, 7 x (1 + bodies): position in m and quaternion w x y z of the camera, then of
 * each body.
 *
 * Outputs: picture, single, height x width; truth, 11 x (1 + bodies); flags, 4: see obscura_block.h.
 *
 * Build: see docs/clients.md. */
#define S_FUNCTION_NAME obscura_sfun
#define S_FUNCTION_LEVEL 2

#include "obscura_block.h"
#include "simstruc.h"

#include <string.h>

enum { SAMPLE_TIME, ADDRESS, SCENE, BODIES, SIZE, SAMPLES, WAIT, PARAMETERS };
enum { MOST_TEXT = 1024 };

static int is_text(SimStruct* S, int parameter) {
    const mxArray* value = ssGetSFcnParam(S, parameter);
    return (mxIsChar(value) || mxIsEmpty(value)) && mxGetNumberOfElements(value) < MOST_TEXT;
}

static int is_positive(SimStruct* S, int parameter, size_t count) {
    const mxArray* value = ssGetSFcnParam(S, parameter);
    if (!mxIsDouble(value) || mxGetNumberOfElements(value) != count) return 0;
    for (size_t i = 0; i < count; ++i)
        if (!(mxGetPr(value)[i] > 0 && mxGetPr(value)[i] <= 1e9)) return 0;
    return 1;
}

static void text_of(SimStruct* S, int parameter, char* text) {
    text[0] = 0;
    if (!mxIsEmpty(ssGetSFcnParam(S, parameter))) mxGetString(ssGetSFcnParam(S, parameter), text, MOST_TEXT);
}

#define MDL_CHECK_PARAMETERS
static void mdlCheckParameters(SimStruct* S) {
    if (!is_positive(S, SAMPLE_TIME, 1) || !is_positive(S, SIZE, 2) || !is_positive(S, SAMPLES, 1) ||
        !is_positive(S, WAIT, 1))
        ssSetErrorStatus(
            S, "obscura: sample time, [height width], samples and longest wait are positive numbers");
    else if (mxGetPr(ssGetSFcnParam(S, SIZE))[0] > 16384 || mxGetPr(ssGetSFcnParam(S, SIZE))[1] > 16384)
        ssSetErrorStatus(S, "obscura: height and width are at most 16384");
    else if (!is_text(S, ADDRESS) || !is_text(S, SCENE) || !is_text(S, BODIES))
        ssSetErrorStatus(S, "obscura: address, scene and bodies are texts of fewer than 1024 characters");
}

static void mdlInitializeSizes(SimStruct* S) {
    ssSetNumSFcnParams(S, PARAMETERS);
    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) return; /* Simulink says so */
    mdlCheckParameters(S);
    if (ssGetErrorStatus(S) != NULL) return;
    for (int i = 0; i < PARAMETERS; ++i)
        ssSetSFcnParamTunable(S, i, 0);
    char bodies[MOST_TEXT];
    text_of(S, BODIES, bodies);
    const int objects = (int)obscura_block_objects(bodies);
    const double* size = mxGetPr(ssGetSFcnParam(S, SIZE));
    ssSetNumContStates(S, 0);
    ssSetNumDiscStates(S, 0);
    if (!ssSetNumInputPorts(S, 2) || !ssSetNumOutputPorts(S, 3)) return;
    ssSetInputPortWidth(S, 0, 1);
    ssSetInputPortMatrixDimensions(S, 1, OBSCURA_BLOCK_POSE, objects);
    for (int port = 0; port < 2; ++port) {
        ssSetInputPortRequiredContiguous(S, port, 1);
        ssSetInputPortDirectFeedThrough(S, port, 1);
    }
    ssSetOutputPortMatrixDimensions(S, 0, (int)size[0], (int)size[1]);
    ssSetOutputPortDataType(S, 0, SS_SINGLE);
    ssSetOutputPortMatrixDimensions(S, 1, OBSCURA_BLOCK_TRUTH, objects);
    ssSetOutputPortWidth(S, 2, OBSCURA_BLOCK_FLAGS);
    ssSetNumSampleTimes(S, 1);
    ssSetNumPWork(S, 1);
    ssSetOptions(S, SS_OPTION_CALL_TERMINATE_ON_EXIT);
}

static void mdlInitializeSampleTimes(SimStruct* S) {
    ssSetSampleTime(S, 0, mxGetPr(ssGetSFcnParam(S, SAMPLE_TIME))[0]);
    ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_START
static void mdlStart(SimStruct* S) {
    static char why[MOST_TEXT]; /* Simulink keeps the pointer */
    char address[MOST_TEXT], scene[MOST_TEXT], bodies[MOST_TEXT];
    text_of(S, ADDRESS, address);
    text_of(S, SCENE, scene);
    text_of(S, BODIES, bodies);
    const double* size = mxGetPr(ssGetSFcnParam(S, SIZE));
    const obscura_block_settings settings = {.address = address,
                                             .scene = scene,
                                             .bodies = bodies,
                                             .width = (int)size[1],
                                             .height = (int)size[0],
                                             .samples = (int)mxGetPr(ssGetSFcnParam(S, SAMPLES))[0],
                                             .wait_s = mxGetPr(ssGetSFcnParam(S, WAIT))[0]};
    obscura_block* block = obscura_block_start(&settings, why, sizeof why);
    ssSetPWorkValue(S, 0, block);
    if (block == NULL) ssSetErrorStatus(S, why);
}

static void mdlOutputs(SimStruct* S, int_T tid) {
    (void)tid; /* one sample time */
    const double* time_s = (const double*)ssGetInputPortSignal(S, 0);
    const double* poses = (const double*)ssGetInputPortSignal(S, 1);
    const obscura_block_outputs* outputs =
        obscura_block_step((obscura_block*)ssGetPWorkValue(S, 0), *time_s, poses);
    memcpy(ssGetOutputPortSignal(S, 0), outputs->picture, (size_t)ssGetOutputPortWidth(S, 0) * sizeof(float));
    memcpy(ssGetOutputPortSignal(S, 1), outputs->truth, (size_t)ssGetOutputPortWidth(S, 1) * sizeof(double));
    memcpy(ssGetOutputPortSignal(S, 2), outputs->flags, sizeof outputs->flags);
}

static void mdlTerminate(SimStruct* S) {
    if (ssGetPWork(S) == NULL) return; /* it never started */
    obscura_block_stop((obscura_block*)ssGetPWorkValue(S, 0));
    ssSetPWorkValue(S, 0, NULL);
}

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
