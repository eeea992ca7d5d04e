/* SPDX-License-Identifier: Apache-2.0 */
/* Calls with their fields as arguments. */
#include "answer.h"
#include "transport.h"
#include "value.h"

#include <stdlib.h>
#include <string.h>

obscura_status obscura_load(obscura_client* client, const char* file) {
    return obscura_call(client, "scene.load", obscura_map("file", obscura_string(file), NULL), NULL);
}

obscura_status obscura_load_toml(obscura_client* client, const char* toml) {
    return obscura_call(client, "scene.load", obscura_map("toml", obscura_string(toml), NULL), NULL);
}

obscura_status obscura_load_scene(obscura_client* client, obscura_value* scene) {
    return obscura_call(client, "scene.load", obscura_map("scene", scene, NULL), NULL);
}

/** Fields that say which table or element is meant. */
static obscura_value* place(const char* section, const char* item) {
    obscura_value* fields = obscura_map("section", obscura_string(section), NULL);
    if (item != NULL) obscura_put(fields, "item", obscura_string(item));
    return fields;
}

obscura_status obscura_set(obscura_client* client, const char* section, const char* item,
                           obscura_value* keys) {
    obscura_value* fields = place(section, item);
    obscura_put(fields, "keys", keys);
    return obscura_call(client, "scene.set", fields, NULL);
}

obscura_status obscura_set_number(obscura_client* client, const char* section, const char* item,
                                  const char* key, double value) {
    return obscura_set(client, section, item, obscura_map(key, obscura_number(value), NULL));
}

obscura_status obscura_set_numbers(obscura_client* client, const char* section, const char* item,
                                   const char* key, const double* values, size_t count) {
    return obscura_set(client, section, item, obscura_map(key, obscura_numbers(values, count), NULL));
}

obscura_status obscura_set_string(obscura_client* client, const char* section, const char* item,
                                  const char* key, const char* value) {
    return obscura_set(client, section, item, obscura_map(key, obscura_string(value), NULL));
}

obscura_status obscura_add(obscura_client* client, const char* section, obscura_value* keys) {
    obscura_value* fields = place(section, NULL);
    obscura_put(fields, "keys", keys);
    return obscura_call(client, "scene.add", fields, NULL);
}

obscura_status obscura_remove(obscura_client* client, const char* section, const char* item) {
    return obscura_call(client, "scene.remove", place(section, item), NULL);
}

obscura_status obscura_get(obscura_client* client, const char* section, const char* item,
                           obscura_value** keys) {
    *keys = NULL;
    obscura_answer* answer;
    const obscura_status status = obscura_call(client, "scene.get", place(section, item), &answer);
    if (status != OBSCURA_OK) return status;
    *keys = obscura_value_copy(obscura_find(obscura_answer_map(answer), "keys"));
    obscura_answer_free(answer);
    return OBSCURA_OK;
}

obscura_status obscura_export(obscura_client* client, char** toml) {
    *toml = NULL;
    obscura_answer* answer;
    const obscura_status status = obscura_call(client, "scene.export", NULL, &answer);
    if (status != OBSCURA_OK) return status;
    const char* text = obscura_as_string(obscura_find(obscura_answer_map(answer), "toml"));
    *toml = oc_text_copy(text == NULL ? "" : text, text == NULL ? 0 : strlen(text));
    obscura_answer_free(answer);
    return OBSCURA_OK;
}

/* Pictures */

static void put_number(obscura_value* fields, const char* name, double value) {
    if (value != 0) obscura_put(fields, name, obscura_number(value));
}

static void put_int(obscura_value* fields, const char* name, int64_t value) {
    if (value != 0) obscura_put(fields, name, obscura_int(value));
}

/** Fields of `render` for what the options give. */
static obscura_value* render_fields(const obscura_render_options* options) {
    obscura_value* fields = obscura_map_new();
    if (options == NULL) return fields;
    put_number(fields, "time_s", options->time_s);
    put_number(fields, "exposure_s", options->exposure_s);
    put_int(fields, "width", options->width);
    put_int(fields, "height", options->height);
    const int* window = options->window;
    if (window[0] != 0 || window[1] != 0 || window[2] != 0 || window[3] != 0)
        obscura_put(fields, "window",
                    obscura_numbers((double[]){window[0], window[1], window[2], window[3]}, 4));
    put_int(fields, "samples", options->samples);
    put_number(fields, "error", options->error);
    put_int(fields, "max_samples", options->max_samples);
    put_int(fields, "bounces", options->bounces);
    put_int(fields, "seed", options->seed);
    put_int(fields, "frame", options->frame);
    if (options->truth) obscura_put(fields, "truth", obscura_bool(1));
    if (options->sensor != NULL) obscura_put(fields, "sensor", obscura_string(options->sensor));
    put_number(fields, "gain_db", options->gain_db);
    if (options->layers != NULL) obscura_put(fields, "layers", obscura_strings(options->layers));
    return fields;
}

obscura_status obscura_render(obscura_client* client, const obscura_render_options* options,
                              obscura_answer** picture) {
    return obscura_call(client, "render", render_fields(options), picture);
}

obscura_status obscura_render_begin(obscura_client* client, const obscura_render_options* options) {
    return obscura_begin(client, "render", render_fields(options));
}
