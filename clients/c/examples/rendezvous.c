/* SPDX-License-Identifier: Apache-2.0 */
/* A chaser approaches a target and its arm unfolds: 100 frames with depth maps, a light spot on the target.
 *
 * The arm is a tree: each link hangs on the one before by a hinge, so that a frame only sets angles. Prints
 * one line a frame and writes the last scene.
 *
 * Usage: rendezvous [FRAMES [FOLDER]]
 * Build: cc rendezvous.c $(pkg-config --cflags --libs obscura-client) -lm */
#include "../src/sha256.h"

#include <math.h>
#include <obscura_client.h>
#include <stdio.h>
#include <stdlib.h>

#define LINK(name, parent)                                                                                   \
    "[[body]]\nname = \"" name "\"\nparent = \"" parent "\"\nposition_m = [0.0, 0.0, 2.0]\n"                 \
    "shape = \"cone\"\nbottom_radius_m = 0.08\ntop_radius_m = 0.08\nheight_m = 2.0\nalbedo = 0.6\n"          \
    "joint = \"hinge\"\njoint_axis = [0, 1, 0]\njoint_angle_deg = 0.0\n"

static const char scene[] =
    "[sun]\ndirection = [-0.6, -0.5, -1.0]\n"
    "[camera]\nwidth = 256\nheight = 256\nfocal_length_mm = 25\npixel_pitch_um = 20\n"
    "aperture_mm = 10\nlook_at = \"target\"\n"
    "[[lamp]]\nname = \"spot\"\nbeam = \"gaussian\"\nhalf_angle_deg = 2.0\n"
    "intensity_w_sr = [5e5]\nlook_at = \"target\"\n"
    "[[body]]\nname = \"target\"\nshape = \"box\"\nsize_m = [3.0, 3.0, 4.0]\nalbedo = 0.3\n"
    "spin_axis = [0, 0, 1]\nspin_rate_deg_per_s = 0.5\n" LINK("upper arm", "target")
        LINK("forearm", "upper arm");

/** Sets the scene of a frame: where the chaser, its lamp and the arm are. */
static obscura_status pose(obscura_client* camera, double along) {
    const double rest = 1 - 0.6 * along;
    const double place[] = {6.0 * rest, -3.0 * rest, -60.0 * rest};
    const double spot[] = {place[0] + 0.5, place[1], place[2]};
    obscura_status status = obscura_set_numbers(camera, "camera", NULL, "position_m", place, 3);
    if (status == OBSCURA_OK) status = obscura_set_numbers(camera, "lamp", "spot", "position_m", spot, 3);
    if (status == OBSCURA_OK)
        status = obscura_set_number(camera, "body", "upper arm", "joint_angle_deg", 70 * along);
    if (status == OBSCURA_OK)
        status = obscura_set_number(camera, "body", "forearm", "joint_angle_deg", 40 * along);
    return status;
}

static obscura_status fly(obscura_client* camera, int frames, const char* folder) {
    static const char* const layers[] = {"depth_m", NULL};
    sha256 digest = sha256_begin();
    obscura_status status = obscura_load_toml(camera, scene);
    for (int frame = 0; frame < frames && status == OBSCURA_OK; ++frame) {
        const obscura_render_options options = {
            .time_s = frame, .frame = frame + 1, .samples = 4, .layers = layers, .truth = 1};
        obscura_answer* picture;
        status = pose(camera, (double)frame / (frames > 1 ? frames - 1 : 1));
        if (status == OBSCURA_OK) status = obscura_render(camera, &options, &picture);
        if (status != OBSCURA_OK) break;
        const obscura_array *light = obscura_array_find(picture, "irradiance"),
                            *depth = obscura_array_find(picture, "depth_m");
        double sum = 0, nearest = INFINITY;
        for (size_t i = 0; i < light->count; ++i)
            sum += (double)light->floats[i];
        for (size_t i = 0; i < depth->count; ++i)
            nearest = fmin(nearest, (double)depth->floats[i]);
        sha256_add(&digest, light->data, light->bytes);
        printf("frame %3d: nearest surface %7.3f m, light %.4e W/m2\n", frame + 1, nearest, sum);
        obscura_answer_free(picture);
    }
    char path[4096], hex[65], *text = NULL;
    snprintf(path, sizeof path, "%s/rendezvous.toml", folder);
    if (status == OBSCURA_OK) status = obscura_export(camera, &text);
    FILE* file = text == NULL ? NULL : fopen(path, "w");
    if (file != NULL && fputs(text, file) >= 0 && fclose(file) == 0) {
        sha256_end(&digest, hex);
        printf("sha256 of all pictures: %s\n", hex);
    } else if (status == OBSCURA_OK) {
        perror(path);
        status = OBSCURA_BAD_USE;
    }
    free(text);
    return status;
}

int main(int argc, char* argv[]) {
    obscura_error error;
    obscura_client* camera = obscura_start(NULL, &error);
    if (camera == NULL) {
        fprintf(stderr, "rendezvous: %s\n", error.message);
        return 1;
    }
    const obscura_status status = fly(camera, argc > 1 ? atoi(argv[1]) : 100, argc > 2 ? argv[2] : ".");
    if (status != OBSCURA_OK) fprintf(stderr, "rendezvous: %s\n", obscura_last_error(camera)->message);
    obscura_close(camera);
    return status == OBSCURA_OK ? 0 : 1;
}
