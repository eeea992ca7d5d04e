// SPDX-License-Identifier: Apache-2.0
// Image motion during an exposure, and the instants at which a row is therefore rendered.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/world/row_state.hpp"

#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// Upper bound, in pixels, of the image motion between reset and read anywhere in the field: the rotation of
/// the camera, and for each body near the field its transverse and radial motion and its own rotation.
/// Shadows and light from other bodies are assumed to move no faster.
[[nodiscard]] double motion_px(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                               const Projection& projection, double reach_px, const RowTime& row);

/// The same between two states of the scene; infinite if a GroundTruth has no room for all its bodies. Lamps
/// and the Sun are not looked at.
[[nodiscard]] double change_px(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                               const Projection& projection, double reach_px, const GroundTruth& from,
                               const GroundTruth& to);

/// Instants that share the exposure of one row, each in the middle of its interval. Stars and sub-pixel
/// bodies are splatted at each of them; each sample of a pixel takes one.
struct Exposure {
    RowTime row;
    std::uint32_t instants = 1;

    /// Instants at most half a pixel of motion apart, and at most `most` of them.
    [[nodiscard]] static Exposure of(const RowTime& row, double motion_px, std::uint32_t most);
    /// Scene time of an instant; the spacing gives uniform motion the mean and the variance of the whole
    /// exposure.
    [[nodiscard]] double time_s(std::uint32_t i) const;
};

} // namespace obscura::renderer
