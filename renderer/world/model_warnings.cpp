// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/model_warnings.hpp"

#include "core/units.hpp"
#include "renderer/camera/model_psf.hpp"
#include "renderer/materials/model_material.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::renderer {

std::vector<std::string> model_warnings(const scene::Scene& scene) {
    std::vector<std::string> lines = model_material_warnings(scene);
    for (std::string& line : psf_warnings(scene.camera))
        lines.push_back(std::move(line));
    constexpr double large_rad = 5 * degree;
    if (const auto& vibration = scene.camera.vibration;
        vibration && vibration->max_rotation_rad() > large_rad)
        lines.push_back(fmt::format("camera: vibration: it turns the camera by up to {:.3g} deg",
                                    vibration->max_rotation_rad() / degree));
    return lines;
}

} // namespace obscura::renderer
