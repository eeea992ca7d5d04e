// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/model_warnings.hpp"

#include "renderer/camera/model_psf.hpp"
#include "renderer/materials/model_material.hpp"

namespace obscura::renderer {

std::vector<std::string> model_warnings(const scene::Scene& scene) {
    std::vector<std::string> lines = model_material_warnings(scene);
    for (std::string& line : psf_warnings(scene.camera))
        lines.push_back(std::move(line));
    return lines;
}

} // namespace obscura::renderer
