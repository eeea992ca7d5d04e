// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/camera_section.hpp"

#include "core/camera/pixel_pitch.hpp"
#include "models/kinds/timing_program.hpp"
#include "models/values/model_table.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene_files/kernel_keys.hpp"
#include "renderer/scene_files/place_keys.hpp"
#include "renderer/scene_files/section_rules.hpp"

#include <algorithm>
#include <memory>
#include <string_view>
#include <utility>

namespace obscura::scene {
namespace {

struct CameraPlace {
    PlaceKeys place;
    JointKeys joint;
    KernelPlaceKeys kernel;
    std::string vibration, shutter; ///< where tables are wanted
};

/// Reads `vibration = { model = "FILE.mot", PARAMETER = VALUE }`; `word`: what stands in place of the table.
void read_vibration(Camera& camera, const std::string& word, const config::ReadTable& table) {
    if (!word.empty())
        table.refuse("vibration", "allowed is a table: write vibration = { model = \"FILE.mot\" }");
    if (const auto own = models::read_model(table, "vibration", "motion"))
        table.refuse_if_thrown("vibration", [&] {
            camera.vibration = std::make_shared<const models::MotionProgram>(
                own->loaded->model, models::program_parameters(*own));
        });
}

/// Reads `shutter = { model = "FILE.tim", PARAMETER = VALUE }`; `word` as in read_vibration().
void read_shutter(Camera& camera, const std::string& word, const config::ReadTable& table) {
    if (!word.empty())
        table.refuse("shutter", "allowed is a table: write shutter = { model = \"FILE.tim\" }");
    if (const auto own = models::read_model(table, "shutter", "timing"))
        table.refuse_if_thrown("shutter", [&] {
            camera.timing = std::make_shared<const models::TimingProgram>(own->loaded->model,
                                                                          models::program_parameters(*own));
        });
}

/// Reads `psf = { model = "FILE.psf", PARAMETER = VALUE }`.
void read_psf(PointSpread& psf, const config::ReadTable& table) {
    if (auto own = models::read_model(table, "psf", "psf")) {
        psf.model = PointSpread::Model::model;
        psf.own = *std::move(own);
    } else if (psf.model == PointSpread::Model::model) {
        table.refuse("psf", "a function of your own has a table: write psf = { model = \"FILE.psf\" }");
    }
}

/// Reads `projection = { model = "FILE.prj", PARAMETER = VALUE }`.
void read_projection(Camera& camera, const config::ReadTable& table) {
    if (auto own = models::read_model(table, "projection", "projection")) {
        camera.projection = Projection::model;
        camera.own_projection = *std::move(own);
    } else if (camera.projection == Projection::model) {
        table.refuse("projection",
                     "a projection of your own has a table: write projection = { model = \"FILE.prj\" }");
    }
    if (camera.projection != Projection::model) return;
    for (const std::string_view key :
         {"distortion", "distortion_coefficients", "distortion_ideal_mm", "distortion_real_mm"})
        if (table.has(key))
            table.refuse(key, "a projection of your own has its own distortion: leave the key out");
}

} // namespace

config::Section camera_section(Camera& camera, const std::shared_ptr<KernelKeys>& kernels) {
    const auto read = std::make_shared<CameraPlace>();
    read->place.epoch = kernels->epoch;
    config::Keys place_keys = camera_place_keys(read->place);
    for (const config::Keys& more : {keys_of(read->joint), keys_of(read->kernel, true)})
        place_keys.insert(place_keys.end(), more.begin(), more.end());
    config::Section section{"camera", "The camera: sensor, optics, position, attitude and motion."};
    section.keys = keys_of(camera);
    section.keys.push_back(
        config::key("vibration", &read->vibration)
            .or_table()
            .help(
                "Small motion on top of the pose: vibration = { model = \"FILE.mot\", PARAMETER = VALUE }, see models.md"));
    section.keys.push_back(
        config::key("shutter", &read->shutter)
            .or_table()
            .help(
                "When rows or pixels are exposed, in pictures without a sensor: shutter = { model = \"FILE.tim\", PARAMETER = VALUE }, see models.md"));
    section.keys.insert(section.keys.end(), place_keys.begin(), place_keys.end());
    section.check = [&camera, read, place_keys, kernels](const config::ReadTable& table) {
        if (camera.psf.model == PointSpread::Model::table && camera.psf.file.empty())
            table.refuse_table("the key \"psf_file\" is missing");
        read_psf(camera.psf, table);
        read_vibration(camera, read->vibration, table);
        read_shutter(camera, read->shutter, table);
        read_projection(camera, table);
        if (const std::string why = explain_invalid_row_pitch(camera.pixel_pitch_m, camera.pixel_pitch_y_m);
            !why.empty())
            table.refuse("pixel_pitch_y_um", why);
        camera.position = table.position_text();
        const bool placed = std::any_of(place_keys.begin(), place_keys.end(),
                                        [&](const config::Key& key) { return table.has(key.name); });
        if (!placed) return;
        camera.joint = joint_of(read->joint, table);
        read->place.kernels = !kernels->files.empty();
        camera.motion = motion_of(read->place, table);
        set_parent(read->joint, table, camera.parent, camera.motion);
        (void)follow_kernels(camera.motion, camera.parent, read->kernel, true, *kernels, table);
    };
    return section;
}

} // namespace obscura::scene
