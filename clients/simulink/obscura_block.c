/* SPDX-License-Identifier: Apache-2.0 */
#include "obscura_block.h"

#include <math.h>
#include <obscura_client.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* A step is a job: one request for each pose that has changed, then the picture. A job that is not done in
 * time goes on in the steps that follow, with the poses that it began with. */
struct obscura_block {
    obscura_client* client;
    size_t objects;
    char** names; /* of the bodies: objects - 1 */
    int width, height, samples;
    double wait_s;

    double time_s;  /* of the job */
    double* poses;  /* of the job */
    double* sent;   /* what the server has; bytes of 0xFF: nothing yet */
    size_t next;    /* object whose pose is next; `objects`: the picture is; beyond: no job */
    int asked;      /* a request is in progress */
    double job_age; /* steps since the job began */

    float* picture;
    double* truth;
    obscura_block_outputs outputs;
    char message[1024];
};

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

size_t obscura_block_objects(const char* bodies) {
    size_t count = 1;
    for (const char* at = bodies; at != NULL && *at != 0;
         at = strchr(at, ',') == NULL ? NULL : strchr(at, ',') + 1)
        ++count;
    return count;
}

/** The names between the commas, without the blanks around them. 0: memory is short. */
static int split(char** names, const char* bodies) {
    for (const char* at = bodies; at != NULL && *at != 0;) {
        const char* end = strchr(at, ',');
        size_t bytes = end == NULL ? strlen(at) : (size_t)(end - at);
        const char* begin = at;
        while (bytes > 0 && *begin == ' ')
            ++begin, --bytes;
        while (bytes > 0 && begin[bytes - 1] == ' ')
            --bytes;
        char* name = calloc(bytes + 1, 1);
        if (name == NULL) return 0;
        memcpy(name, begin, bytes);
        *names++ = name;
        at = end == NULL ? NULL : end + 1;
    }
    return 1;
}

static obscura_client* open_client(const obscura_block_settings* settings, obscura_error* error) {
    if (settings->address == NULL || settings->address[0] == 0) {
        const obscura_start_options options = {.scene = settings->scene};
        return obscura_start(&options, error);
    }
    obscura_client* client = obscura_connect(settings->address, NULL, error);
    if (client == NULL || obscura_load(client, settings->scene) == OBSCURA_OK) return client;
    *error = *obscura_last_error(client);
    obscura_close(client);
    return NULL;
}

obscura_block* obscura_block_start(const obscura_block_settings* settings, char* why, size_t why_bytes) {
    if (settings->width < 1 || settings->height < 1 || settings->samples < 1 || settings->width > 65536 ||
        settings->height > 65536) {
        snprintf(why, why_bytes, "width, height and samples are at least 1");
        return NULL;
    }
    obscura_error error = {.message = "not enough memory"};
    obscura_block* block = calloc(1, sizeof *block);
    const size_t objects = obscura_block_objects(settings->bodies),
                 pixels = (size_t)settings->width * (size_t)settings->height;
    if (block != NULL) {
        block->objects = objects;
        block->width = settings->width;
        block->height = settings->height;
        block->samples = settings->samples;
        block->wait_s = settings->wait_s;
        block->next = objects + 1;
        block->names = calloc(objects, sizeof *block->names);
        block->poses = calloc(objects, OBSCURA_BLOCK_POSE * sizeof *block->poses);
        block->sent = calloc(objects, OBSCURA_BLOCK_POSE * sizeof *block->sent);
        block->picture = calloc(pixels, sizeof *block->picture);
        block->truth = calloc(objects, OBSCURA_BLOCK_TRUTH * sizeof *block->truth);
        if (block->names != NULL && block->poses != NULL && block->sent != NULL && block->picture != NULL &&
            block->truth != NULL && split(block->names, settings->bodies))
            block->client = open_client(settings, &error);
    }
    if (block == NULL || block->client == NULL) {
        snprintf(why, why_bytes, "%s", error.message);
        obscura_block_stop(block);
        return NULL;
    }
    memset(block->sent, 0xFF, objects * OBSCURA_BLOCK_POSE * sizeof *block->sent);
    for (size_t i = 0; i < objects * OBSCURA_BLOCK_TRUTH; ++i)
        block->truth[i] = NAN;
    block->outputs.picture = block->picture;
    block->outputs.truth = block->truth;
    return block;
}

void obscura_block_stop(obscura_block* block) {
    if (block == NULL) return;
    obscura_close(block->client);
    for (size_t i = 0; block->names != NULL && i + 1 < block->objects; ++i)
        free(block->names[i]);
    free(block->names);
    free(block->poses);
    free(block->sent);
    free(block->picture);
    free(block->truth);
    free(block);
}

const char* obscura_block_message(const obscura_block* block) {
    return block->message;
}

static size_t pose_bytes(void) {
    return OBSCURA_BLOCK_POSE * sizeof(double);
}

/** Sends the request that is next in the job; nothing if there is none. */
static obscura_status ask(obscura_block* block) {
    const size_t all = block->objects;
    while (block->next < all && memcmp(block->poses + OBSCURA_BLOCK_POSE * block->next,
                                       block->sent + OBSCURA_BLOCK_POSE * block->next, pose_bytes()) == 0)
        ++block->next;
    if (block->next == all) {
        const obscura_render_options options = {.time_s = block->time_s,
                                                .width = block->width,
                                                .height = block->height,
                                                .samples = block->samples,
                                                .truth = 1};
        return obscura_render_begin(block->client, &options);
    }
    const double* pose = block->poses + OBSCURA_BLOCK_POSE * block->next;
    const int is_camera = block->next == 0;
    obscura_value* keys = obscura_map("position_m", obscura_numbers(pose, 3), "orientation",
                                      obscura_numbers(pose + 3, 4), NULL);
    if (is_camera) { /* the scene may aim it in another way */
        static const char* const aims[] = {"boresight", "look_at", "look_at_m", "up"};
        for (size_t i = 0; i < sizeof aims / sizeof *aims; ++i)
            obscura_put(keys, aims[i], obscura_nil());
    }
    obscura_value* fields =
        obscura_map("section", obscura_string(is_camera ? "camera" : "body"), "keys", keys, NULL);
    if (!is_camera) obscura_put(fields, "item", obscura_string(block->names[block->next - 1]));
    return obscura_begin(block->client, "scene.set", fields);
}

/** Copies numbers of an array; NAN where there are none. */
static void copy_numbers(double* to, size_t count, const obscura_value* from) {
    for (size_t i = 0; i < count; ++i)
        to[i] = obscura_as_number(obscura_at(from, i), NAN);
}

static void take_truth(double* to, const obscura_value* row) {
    copy_numbers(to, 3, obscura_find(row, "position_m"));
    copy_numbers(to + 3, 4, obscura_find(row, "orientation"));
    to[7] = obscura_as_number(obscura_find(row, "range_m"), NAN);
    to[8] = obscura_as_number(obscura_find(row, "phase_deg"), NAN);
    copy_numbers(to + 9, 2, obscura_find(row, "pixel"));
}

/** Takes picture and truth over. 0: the answer is not of the form that was asked for. */
static int take_picture(obscura_block* block, const obscura_answer* answer) {
    const obscura_array* values = obscura_array_at(answer, 0);
    const size_t width = (size_t)block->width, height = (size_t)block->height;
    if (values == NULL || values->floats == NULL || values->dimensions != 3 || values->shape[0] < 1 ||
        values->shape[1] != height || values->shape[2] != width)
        return 0;
    for (size_t column = 0; column < width; ++column)
        for (size_t row = 0; row < height; ++row)
            block->picture[row + height * column] = values->floats[column + width * row];
    const obscura_value* truth = obscura_find(obscura_answer_map(answer), "truth");
    const obscura_value* bodies = obscura_find(truth, "bodies");
    take_truth(block->truth, obscura_find(truth, "camera"));
    for (size_t object = 1; object < block->objects; ++object) {
        const obscura_value* found = NULL;
        for (size_t i = 0; i < obscura_count(bodies) && found == NULL; ++i) {
            const char* name = obscura_as_string(obscura_find(obscura_at(bodies, i), "name"));
            if (name != NULL && strcmp(name, block->names[object - 1]) == 0) found = obscura_at(bodies, i);
        }
        take_truth(block->truth + OBSCURA_BLOCK_TRUTH * object, found);
    }
    return 1;
}

/** Goes on with the job until then. OBSCURA_OK: it is done, and the picture taken. */
static obscura_status go_on(obscura_block* block, double until_s) {
    while (block->next <= block->objects) {
        obscura_status status = block->asked ? OBSCURA_OK : ask(block);
        block->asked = status == OBSCURA_OK;
        obscura_answer* answer = NULL;
        const double left_s = until_s - now_s();
        if (status == OBSCURA_OK) status = obscura_wait(block->client, left_s > 0 ? left_s : 0, &answer);
        if (status == OBSCURA_PENDING) return status;
        block->asked = 0;
        if (status == OBSCURA_OK && block->next < block->objects)
            memcpy(block->sent + OBSCURA_BLOCK_POSE * block->next,
                   block->poses + OBSCURA_BLOCK_POSE * block->next, pose_bytes());
        if (status != OBSCURA_OK)
            snprintf(block->message, sizeof block->message, "%s", obscura_last_error(block->client)->message);
        else if (block->next == block->objects && !take_picture(block, answer)) {
            snprintf(block->message, sizeof block->message, "the server sent a picture of another form");
            status = OBSCURA_REFUSED;
        }
        obscura_answer_free(answer);
        block->next = status == OBSCURA_OK ? block->next + 1 : block->objects + 1;
        if (status != OBSCURA_OK) return status;
    }
    return OBSCURA_OK;
}

/** Writes the flags of a step. */
static const obscura_block_outputs* told(obscura_block* block, obscura_block_outcome outcome) {
    block->outputs.flags[0] = outcome;
    if (outcome == OBSCURA_BLOCK_LATE) block->outputs.flags[3] += 1;
    return &block->outputs;
}

/** A picture has been taken, of a job that began so many steps ago. */
static void count_picture(obscura_block* block) {
    block->outputs.flags[1] = block->job_age;
    block->outputs.flags[2] += 1;
}

static obscura_block_outcome outcome_of(obscura_status status) {
    switch (status) {
    case OBSCURA_OK:
        return OBSCURA_BLOCK_FRESH;
    case OBSCURA_PENDING:
        return OBSCURA_BLOCK_LATE;
    case OBSCURA_LOST:
        return OBSCURA_BLOCK_GONE;
    default:
        return OBSCURA_BLOCK_REFUSED;
    }
}

const obscura_block_outputs* obscura_block_step(obscura_block* block, double time_s, const double* poses) {
    const double until_s = now_s() + block->wait_s;
    block->message[0] = 0;
    block->outputs.flags[1] += 1;
    block->job_age += 1;
    if (block->next <= block->objects) { /* the job of an earlier step */
        const obscura_status status = go_on(block, until_s);
        if (status == OBSCURA_PENDING || status == OBSCURA_LOST) return told(block, outcome_of(status));
        if (status == OBSCURA_OK) count_picture(block);
    }
    block->time_s = time_s;
    memcpy(block->poses, poses, block->objects * pose_bytes());
    block->next = 0;
    block->job_age = 0;
    const obscura_status status = go_on(block, until_s);
    if (status == OBSCURA_OK) count_picture(block);
    return told(block, outcome_of(status));
}
