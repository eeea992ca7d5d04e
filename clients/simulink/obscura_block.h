/* SPDX-License-Identifier: Apache-2.0 */
/* Logic of the Simulink block: a picture for each step, of a scene whose camera and bodies have the poses of
 * that step. */
#ifndef OBSCURA_BLOCK_H
#define OBSCURA_BLOCK_H

#include <stddef.h>

/** Values of one pose: position in m, quaternion w, x, y, z. */
enum { OBSCURA_BLOCK_POSE = 7 };
/** Truth of one object: pose, range in m, phase angle in degrees, column and row of its centre from 0; NAN:
 * not known. */
enum { OBSCURA_BLOCK_TRUTH = 11 };
enum { OBSCURA_BLOCK_FLAGS = 4 };

/** First of the flags of a step. */
typedef enum obscura_block_outcome {
    OBSCURA_BLOCK_FRESH = 0, /**< the picture is of this step */
    OBSCURA_BLOCK_LATE = 1,  /**< it is of an earlier step: that of this one is not ready, or was not begun */
    OBSCURA_BLOCK_REFUSED = 2, /**< the server refused a pose; the picture is an earlier one */
    OBSCURA_BLOCK_GONE = 3     /**< the server has gone; the picture stays what it was */
} obscura_block_outcome;

/** What the dialog of the block says. */
typedef struct obscura_block_settings {
    const char* address; /**< server that runs; empty: one of the block's own */
    const char* scene;   /**< shipped scene, or a file below the server's folder */
    const char* bodies;  /**< names of the bodies that have poses, with commas between them */
    int width, height;   /**< of the picture */
    int samples;         /**< per pixel */
    double wait_s;       /**< longest time that a step waits for its picture */
} obscura_block_settings;

/** What a step gives. The arrays belong to the block and stay until the next step. */
typedef struct obscura_block_outputs {
    const float* picture; /**< first band, height x width, one column after the other, W/m2 per pixel; 0
                             before the first */
    const double*
        truth; /**< OBSCURA_BLOCK_TRUTH for the camera and each body, of the same instant as the picture */
    double flags[OBSCURA_BLOCK_FLAGS]; /**< outcome, age of the picture in steps, pictures so far, late steps
                                          so far */
} obscura_block_outputs;

typedef struct obscura_block obscura_block;

/** Objects with poses: the camera and the bodies that are named. */
size_t obscura_block_objects(const char* bodies);

/** Connects and loads the scene; NULL with one line in `why` on failure. */
obscura_block* obscura_block_start(const obscura_block_settings* settings, char* why, size_t why_bytes);

/** One step: `poses` has OBSCURA_BLOCK_POSE values for the camera, then for each body. Takes at most the time
 * `wait_s`. */
const obscura_block_outputs* obscura_block_step(obscura_block* block, double time_s, const double* poses);

/** Why the last step was refused, or the server is gone; empty: neither. */
const char* obscura_block_message(const obscura_block* block);

/** Ends the connection and a server of the block's own. NULL is ignored. */
void obscura_block_stop(obscura_block* block);

#endif
