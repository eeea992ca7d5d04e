// SPDX-License-Identifier: Apache-2.0
// The materials of a body's mesh file: Lambert with their diffuse colours and textures.
#pragma once

#include "renderer/materials/lambert.hpp"

namespace obscura::renderer {

/// Parameters of FileMaterials: none.
struct FileMaterialsParameters {
    static constexpr std::string_view kind = "file";
    static constexpr std::string_view help =
        "Materials of the body's mesh file: Lambert's law with their diffuse colours and textures.";
    using Family = scene::MaterialFamily;
};
[[nodiscard]] scene::ParameterList declare(FileMaterialsParameters& p);

/// The colours come with the body's SurfaceTextures, as factors on an albedo of 1.
class FileMaterials final : public Lambert {
public:
    using Parameters = FileMaterialsParameters;

    explicit FileMaterials(const FileMaterialsParameters& /*p*/) : Lambert({1}) {}
};

} // namespace obscura::renderer
