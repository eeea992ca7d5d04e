/* SPDX-License-Identifier: Apache-2.0 */
/* The scenario of scenario_test.py in C. Usage: scenario ADDRESS */
#include "clients/c/src/sha256.h"

#include <math.h>
#include <obscura_client.h>
#include <stdio.h>
#include <stdlib.h>

static void show_digest(const char* name, const void* data, size_t bytes) {
    sha256 digest = sha256_begin();
    char hex[65];
    sha256_add(&digest, data, bytes);
    sha256_end(&digest, hex);
    printf("%s %s\n", name, hex);
}

/** Renders and shows the picture. Ends the program if that fails. */
static void show(obscura_client* camera, double time_s, int frame) {
    const char* const layers[] = {"depth_m", NULL};
    const obscura_render_options options = {
        .time_s = time_s, .samples = 16, .seed = 7, .frame = frame, .layers = layers};
    obscura_answer* picture;
    if (obscura_render(camera, &options, &picture) != OBSCURA_OK) {
        fprintf(stderr, "scenario: %s\n", obscura_last_error(camera)->message);
        exit(1);
    }
    const obscura_array *values = obscura_array_at(picture, 0),
                        *depth = obscura_array_find(picture, "depth_m");
    size_t lit = 0, seen = 0;
    for (size_t i = 0; i < values->count; ++i)
        lit += values->floats[i] > 0;
    for (size_t i = 0; i < depth->count; ++i)
        seen += !isnan(depth->floats[i]);
    show_digest("values", values->data, values->bytes);
    show_digest("depth", depth->data, depth->bytes);
    printf("lit %zu\nseen %zu\n", lit, seen);
    obscura_answer_free(picture);
}

/** Exposes a sensor and shows its digital numbers. */
static void show_sensor(obscura_client* camera) {
    obscura_value* size = obscura_map("width", obscura_int(96), "height", obscura_int(64), NULL);
    obscura_value* sensor = obscura_map("file", obscura_string("generic"), "readout", size, NULL);
    obscura_value* fields =
        obscura_map("exposure_s", obscura_number(0.02), "sensor", sensor, "samples", obscura_int(2), "seed",
                    obscura_int(7), "frame", obscura_int(5), "run", obscura_int(3), NULL);
    obscura_answer* picture;
    if (obscura_call(camera, "render", fields, &picture) != OBSCURA_OK) {
        fprintf(stderr, "scenario: %s\n", obscura_last_error(camera)->message);
        exit(1);
    }
    const obscura_array* numbers = obscura_array_find(picture, "dn");
    long sum = 0;
    for (size_t i = 0; i < numbers->count; ++i)
        sum += ((const uint16_t*)numbers->data)[i];
    show_digest("dn", numbers->data, numbers->bytes);
    printf("sum %ld\n", sum);
    obscura_answer_free(picture);
}

/** An array of whole numbers, which the exported scene keeps as such. */
static obscura_value* whole(int x, int y, int z) {
    obscura_value* numbers = obscura_array_new();
    obscura_append(numbers, obscura_int(x));
    obscura_append(numbers, obscura_int(y));
    obscura_append(numbers, obscura_int(z));
    return numbers;
}

int main(int argc, char* argv[]) {
    obscura_error error;
    obscura_client* camera = obscura_connect(argc > 1 ? argv[1] : "", NULL, &error);
    if (camera == NULL) {
        fprintf(stderr, "scenario: %s\n", error.message);
        return 1;
    }
    obscura_load_scene(camera, obscura_map_new());
    obscura_set(camera, "camera", NULL,
                obscura_map("width", obscura_int(160), "height", obscura_int(120), "focal_length_mm",
                            obscura_number(10), "pixel_pitch_um", obscura_number(20), "boresight",
                            whole(0, 0, 1), "up", whole(0, -1, 0), "psf_sigma_px", obscura_number(1.5),
                            NULL));
    obscura_set(camera, "sun", NULL, obscura_map("direction", obscura_vector(-1, -0.5, -2), NULL));
    obscura_add(camera, "body",
                obscura_map("name", obscura_string("ball"), "shape", obscura_string("ellipsoid"), "radii_m",
                            obscura_vector(1, 1, 1), "albedo", obscura_number(0.3), "position_m",
                            obscura_vector(0.25, -0.125, 12.5), NULL));
    show(camera, 0, 3);
    if (obscura_set_number(camera, "body", "ball", "albedo", 2.5) == OBSCURA_REFUSED) {
        const obscura_error* refused = obscura_last_error(camera);
        printf("refused %s %s %s\n", refused->code, refused->field, refused->allowed);
    }
    obscura_set_numbers(camera, "body", "ball", "position_m", (const double[]){0.1, 0.2, 10}, 3);
    obscura_set(camera, "camera", NULL, obscura_map("psf_sigma_px", obscura_nil(), NULL));
    show(camera, 1.5, 4);
    show_sensor(camera);
    char* text;
    if (obscura_export(camera, &text) == OBSCURA_OK) show_digest("export", text, strlen(text));
    free(text);
    obscura_close(camera);
    return 0;
}
