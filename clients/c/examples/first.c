/* SPDX-License-Identifier: Apache-2.0 */
/* A ball comes nearer, ten pictures with depth. Build: cc first.c $(pkg-config --cflags --libs
 * obscura-client) */
#include <math.h>
#include <obscura_client.h>
#include <stdio.h>
#include <stdlib.h>

int main(void) {
    obscura_error error;
    obscura_client* camera = obscura_start(NULL, &error);
    if (camera == NULL) return fprintf(stderr, "%s\n", error.message), 1;
    obscura_set(camera, "camera", NULL,
                obscura_map("width", obscura_int(640), "height", obscura_int(480), "focal_length_mm",
                            obscura_number(25), NULL));
    obscura_set(camera, "sun", NULL, obscura_map("direction", obscura_vector(-1, -1, -2), NULL));
    obscura_add(camera, "body",
                obscura_map("name", obscura_string("ball"), "shape", obscura_string("ellipsoid"), "radii_m",
                            obscura_vector(1, 1, 1), "albedo", obscura_number(0.3), NULL));
    for (int step = 0; step < 10; ++step) {
        obscura_answer* picture;
        obscura_set(camera, "body", "ball", obscura_map("position_m", obscura_vector(0, 0, 40 - step), NULL));
        if (obscura_render(
                camera, &(obscura_render_options){.samples = 16, .layers = (const char*[]){"depth_m", NULL}},
                &picture) != OBSCURA_OK)
            break;
        const obscura_array* depth = obscura_array_find(picture, "depth_m");
        float nearest = INFINITY;
        for (size_t i = 0; i < depth->count; ++i)
            nearest = fminf(nearest, depth->floats[i]);
        printf("nearest surface %.3f m\n", (double)nearest);
        obscura_answer_free(picture);
    }
    const int failed = obscura_last_error(camera)->status != OBSCURA_OK;
    if (failed) fprintf(stderr, "%s\n", obscura_last_error(camera)->message);
    obscura_close(camera);
    return failed;
}
