// SPDX-License-Identifier: Apache-2.0
// What a law of a user's own reads at the points that are hit: time, texture coordinates and textures.
#pragma once

#include "models/kinds/material_program.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/textures/procedural_texture.hpp"
#include "renderer/textures/texture_lookup.hpp"

#include <cstddef>
#include <memory>
#include <vector>

namespace obscura::renderer {

/// Time of each sample, s of scene time, and the length of what it stands for.
struct SampleTimes {
    Doubles t;
    double duration_s = 0;
};

/// Image of a texture that a model has as a parameter, and the values of a texel of 0 and of 1.
struct ModelImage {
    PlacedTexture texture; ///< none: the parameter is no texture, or has a model
    double at_zero = 0, gain = 1;
    std::shared_ptr<const ProceduralTexture> model{}; ///< in place of an image, of four bands; null: none

    explicit operator bool() const { return bool{texture} || model; }
};

/// Fills the rows of a MaterialProgram that are not parameters. Immutable; thread-safe; real-time safe.
class ModelSurface {
public:
    /// `images`: for each parameter of the model.
    ModelSurface(std::shared_ptr<const models::MaterialProgram> law, std::vector<ModelImage> images);

    /// Sets the rows at `points`; other lanes are 0. The rows before are set.
    void fill(const TexturePoints& points, const UvPacket& at, const SampleTimes& time,
              ParameterPacket& rows) const;
    [[nodiscard]] const models::MaterialProgram& law() const { return *law_; }
    [[nodiscard]] const std::vector<ModelImage>& images() const { return images_; }

private:
    void read(std::size_t index, const TexturePoints& points, const UvPacket& at,
              ParameterPacket& rows) const;

    std::shared_ptr<const models::MaterialProgram> law_;
    std::vector<ModelImage> images_;
};

/// Means of the planes of an image as values of the four channels of a texture.
[[nodiscard]] std::array<double, 4> mean_channels(const ModelImage& image);

/// Where lanes read textures, with the footprints of rays along `direction` that are `width_m` wide.
[[nodiscard]] TexturePoints texture_points(const Lanes& here, const UvPacket& at,
                                           const SurfacePacket& surface, const Vec3s& direction,
                                           const Doubles& width_m);

/// Reads a texture at `u`, `v`: `longer` and `shorter` are the edges of the footprint there, which is scaled
/// to 2^level texels (geometric mean of its sides) unless `level` is NaN.
void read_scaled(const Texture& texture, double u, double v, TextureAxis longer, TextureAxis shorter,
                 double level, double* planes);

/// Level of detail of a footprint in texture coordinates: log2 of the geometric mean of its sides.
[[nodiscard]] double level_of(TextureAxis longer, TextureAxis shorter);

} // namespace obscura::renderer
