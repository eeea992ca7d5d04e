// SPDX-License-Identifier: Apache-2.0
// How far the picture moves during an exposure, and at which instants it is therefore rendered.
#pragma once

#include "core/frame.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/world/row_state.hpp"

#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// An upper estimate of how far anything in the field moves in the picture between reset and read, in pixels:
/// the turn of the camera, and for each body near the field its way across, its way towards the camera and
/// its turn about itself. Shadows and light from other bodies are taken to move no faster.
[[nodiscard]] double motion_px(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                               const Projection& projection, double reach_px, const RowTime& row);

/// The instants that share the light of one row's exposure, each at the middle of its part of it.
struct Exposure {
    RowTime row;
    std::uint32_t points = 1; ///< instants for stars and bodies smaller than pixels, which are splatted
    std::uint32_t pixels = 1; ///< instants that the samples of pixels are shared out to: at most `points`
    double shift =
        0.5; ///< where in its part each of `pixels` lies; chance when there are fewer than `points`

    /// Half a pixel of motion or less from one instant to the next, and at most `most` instants. `samples`:
    /// what a pixel's samples can be shared out to.
    [[nodiscard]] static Exposure of(const RowTime& row, double motion_px, std::uint32_t most,
                                     std::uint32_t samples, double chance);
    /// Spread so that what moves uniformly has the mean and the variance of its whole way.
    [[nodiscard]] double point_s(std::uint32_t i) const;
    [[nodiscard]] double pixel_s(std::uint32_t i) const { return at((i + shift) / pixels); }

private:
    [[nodiscard]] double at(double share) const;
};

} // namespace obscura::renderer
