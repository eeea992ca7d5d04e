// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/model_warnings.hpp"

#include "core/time.hpp"
#include "core/units.hpp"
#include "models/kinds/timing_program.hpp"
#include "renderer/camera/model_projection.hpp"
#include "renderer/camera/model_psf.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/shapes/model_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::renderer {

namespace {

/// Whether a model has a global of that name.
bool has_global(const models::ModelValues& model, const std::string& name) {
    const auto& all = model.loaded->model->parameters();
    return std::any_of(all.begin(), all.end(),
                       [&](const models::Parameter& p) { return p.global && p.name == name; });
}

std::vector<const models::ModelValues*> models_of(const scene::Scene& scene) {
    std::vector<const models::ModelValues*> all;
    const auto add = [&](const models::ModelValues* model) {
        if (model != nullptr && model->loaded != nullptr) all.push_back(model);
    };
    for (const scene::Body& body : scene.bodies) {
        add(body.material.get_if<ModelMaterialParameters>());
        add(body.shape.get_if<ModelShapeParameters>());
        add(body.textures.albedo_model.get());
        add(body.textures.emission_model.get());
        for (const scene::Textures::Parameter& map : body.textures.parameters)
            add(map.model.get());
    }
    return all;
}

} // namespace

std::vector<std::string> model_warnings(const scene::Scene& scene) {
    std::vector<std::string> lines = model_material_warnings(scene);
    for (std::string& line : psf_warnings(scene.camera))
        lines.push_back(std::move(line));
    constexpr double large_rad = 5 * degree;
    if (const auto& vibration = scene.camera.vibration;
        vibration && vibration->max_rotation_rad() > large_rad)
        lines.push_back(fmt::format("camera: vibration: it turns the camera by up to {:.3g} deg",
                                    vibration->max_rotation_rad() / degree));
    if (const auto& timing = scene.camera.timing) {
        const models::TimedFrame usual{scene.camera.height, scene.camera.width, ns_per_ms};
        if (const std::string why = timing->explain(usual); !why.empty())
            lines.push_back("camera: shutter: an exposure of 1 ms is refused: " + why);
    }
    const std::vector<const models::ModelValues*> models = models_of(scene);
    for (const models::Global& global : scene.globals)
        if (std::none_of(models.begin(), models.end(),
                         [&](const models::ModelValues* model) { return has_global(*model, global.name); }))
            lines.push_back(fmt::format(
                "global \"{}\": no material, texture or shape of the scene has it, so that it has no effect",
                global.name));
    for (std::string& line : model_projection_warnings(scene.camera))
        lines.push_back(std::move(line));
    return lines;
}

} // namespace obscura::renderer
