// SPDX-License-Identifier: Apache-2.0
// Image motion during an exposure, and the instants at which a row is therefore rendered.
#pragma once

#include "core/frame.hpp"
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

/// Instants that share the exposure of one row, each in the middle of its interval.
struct Exposure {
    RowTime row;
    std::uint32_t points = 1; ///< instants of splatted stars and sub-pixel bodies
    std::uint32_t pixels = 1; ///< instants of pixel samples: at most `points`
    /// Position of each of the `pixels` instants in its interval, 0 to 1; random if they are fewer than
    /// `points`.
    double shift = 0.5;

    /// Instants at most half a pixel of motion apart, and at most `most` of them. `samples`: samples of a
    /// pixel, which the instants share. `jitter`: uniform in [0,1), for `shift`.
    [[nodiscard]] static Exposure of(const RowTime& row, double motion_px, std::uint32_t most,
                                     std::uint32_t samples, double jitter);
    /// Scene time of an instant of points; the spacing gives uniform motion the mean and the variance of the
    /// whole exposure.
    [[nodiscard]] double point_s(std::uint32_t i) const;
    [[nodiscard]] double pixel_s(std::uint32_t i) const { return at((i + shift) / pixels); }

private:
    [[nodiscard]] double at(double fraction) const;
};

} // namespace obscura::renderer
