// SPDX-License-Identifier: Apache-2.0
// Keys of images that give parameters of a material over the surface of a body.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::scene {

/// Keys of a texture that gives one parameter of the material of a body.
struct ParameterTexture {
    std::string parameter;    ///< without the unit
    std::string constant_key; ///< the key of the constant
    std::string file_key, range_key, file_help, range_help;
    std::string_view unit;
    double si = 1; ///< the key's unit in SI
    std::string file;
    std::array<double, 2> range{0, 1};
};

/// One for each parameter that an image may give.
[[nodiscard]] std::vector<ParameterTexture> textures_of(const ParameterList& parameters);

/// `textures` must not move while the keys are used.
[[nodiscard]] config::Keys texture_keys(std::vector<ParameterTexture>& textures);

/// Checks the textures that were read from `table`, and adds them to those of the body.
void add_parameter_textures(const std::vector<ParameterTexture>& textures, Textures& body,
                            const config::ReadTable& table);

} // namespace obscura::scene
