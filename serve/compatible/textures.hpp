// SPDX-License-Identifier: Apache-2.0
// Textures with a name, and which of them objects wear.
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>

namespace obscura::serve::compatible {

struct Object;

/// A file, or texels that the client sends.
struct NamedTexture {
    std::int32_t width = 0, height = 0; ///< 0: a file
    bool gray = false;
    std::string file{};     ///< what scene files name
    nlohmann::json model{}; ///< table of a texture in SuMoL, in place of a file; null: none
    bool own = false;       ///< it is of the session's folder
    /// Sequence of pictures: name with a place for the number, the number of the file, and whether the first
    /// follows the last.
    std::string sequence{};
    std::int64_t number = 0;
    bool loop = false;
};

/// Value of a key of a scene file that names the texture.
[[nodiscard]] inline nlohmann::json key_of(const NamedTexture& texture) {
    return texture.model.is_null() ? nlohmann::json(texture.file) : texture.model;
}

/// Units of an object's textures: diffuse, specular, emission, normal.
constexpr int texture_units = 4;

/// Gives the object the texture of a unit; false: its shape or material has none of that unit.
bool wear(Object& object, int unit, const nlohmann::json& file);

} // namespace obscura::serve::compatible
