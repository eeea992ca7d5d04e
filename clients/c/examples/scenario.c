/* SPDX-License-Identifier: Apache-2.0 */
/* One picture of a ball, whose bytes are the same in every language: prints their SHA-256.
 *
 * Usage: scenario ADDRESS */
#include "sha256.h"

#include <obscura_client.h>
#include <stdio.h>

static void print_digest(const obscura_answer* picture, const char* name) {
    const obscura_array* array = obscura_array_find(picture, name);
    sha256 digest = sha256_begin();
    char hex[65];
    sha256_add(&digest, array->data, array->bytes);
    sha256_end(&digest, hex);
    printf("%s %s\n", name, hex);
}

static obscura_status render(obscura_client* camera, obscura_answer** picture) {
    obscura_value* view = obscura_map("width", obscura_int(64), "height", obscura_int(48), "focal_length_mm",
                                      obscura_int(25), "pixel_pitch_um", obscura_int(20), "boresight",
                                      obscura_vector(0, 0, 1), "up", obscura_vector(0, -1, 0), NULL);
    obscura_value* sun = obscura_map("direction", obscura_vector(-1, -1, -2), NULL);
    obscura_value* ball = obscura_map("name", obscura_string("ball"), "shape", obscura_string("ellipsoid"),
                                      "radii_m", obscura_vector(1, 1, 1), "albedo", obscura_number(0.3),
                                      "position_m", obscura_vector(0, 0, 40), NULL);
    obscura_status status = obscura_load_scene(camera, obscura_map("camera", view, "sun", sun, NULL));
    if (status == OBSCURA_OK)
        status = obscura_add(camera, "body", ball);
    else
        obscura_value_free(ball);
    if (status == OBSCURA_OK)
        status =
            obscura_set_numbers(camera, "body", "ball", "position_m", (const double[]){0.25, -0.5, 20}, 3);
    const obscura_render_options options = {
        .time_s = 2.5, .samples = 4, .seed = 7, .layers = (const char* const[]){"depth_m", NULL}};
    return status == OBSCURA_OK ? obscura_render(camera, &options, picture) : status;
}

int main(int argc, char* argv[]) {
    if (argc != 2) {
        fprintf(stderr, "usage: scenario ADDRESS\n");
        return 64;
    }
    obscura_error error;
    obscura_client* camera = obscura_connect(argv[1], NULL, &error);
    if (camera == NULL) {
        fprintf(stderr, "scenario: %s\n", error.message);
        return 1;
    }
    obscura_answer* picture = NULL;
    const obscura_status status = render(camera, &picture);
    if (status == OBSCURA_OK) {
        print_digest(picture, "irradiance");
        print_digest(picture, "depth_m");
    } else {
        fprintf(stderr, "scenario: %s\n", obscura_last_error(camera)->message);
    }
    obscura_answer_free(picture);
    obscura_close(camera);
    return status == OBSCURA_OK ? 0 : 1;
}
