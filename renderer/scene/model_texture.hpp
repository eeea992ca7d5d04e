// SPDX-License-Identifier: Apache-2.0
// Texture that a user has written in SuMoL, as a scene holds it.
#pragma once

#include "models/values/model_values.hpp"

#include <string>
#include <vector>

namespace obscura::scene {

/// A texture model with values of its parameters and the images that it reads.
struct ModelTexture : models::ModelValues {
    /// Key of the image that is the argument `tex` of its functions.
    static constexpr std::string_view own_image = "tex";
    /// File of an image, for one of the textures that the model reads.
    struct Image {
        std::string name; ///< of the parameter, or own_image
        std::string file;
    };
    std::vector<Image> images{};
};

} // namespace obscura::scene
