// SPDX-License-Identifier: Apache-2.0
// Positions of bodies in the image of a frame, from the poses that stand in the frame.
#pragma once

#include "core/frame.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::renderer {
class Projection;
class Renderer;
} // namespace obscura::renderer

namespace obscura::emulator {

/// A body at mid-exposure of its frame.
struct BodyPosition {
    std::string name;
    /// Its origin in the image, px, pixel centres at integers; also outside of the image. None: behind the
    /// camera or far outside.
    std::optional<double> x_px, y_px;
    std::optional<double> radius_px; ///< of its bounding sphere; none: not known, or the camera is inside
    double range_m = 0;              ///< from the camera to its origin
    Vec3 position_m;                 ///< inertial
};

/// Projects by the lens of the scene that is shown now. Rows of a rolling shutter are exposed at other times
/// than mid-exposure: the positions are those of the one instant. Thread-bound.
class BodyPositions {
public:
    /// Throws ConfigError.
    explicit BodyPositions(const renderer::Renderer& renderer);
    ~BodyPositions();

    /// Of the bodies whose poses the frame has, at most max_truth_bodies.
    [[nodiscard]] std::vector<BodyPosition> of(const FrameInfo& frame) const;
    /// Bodies of the scene.
    [[nodiscard]] std::size_t bodies() const noexcept { return radius_m_.size(); }

private:
    std::unique_ptr<const renderer::Projection> lens_;
    std::map<std::string, double> radius_m_; ///< of bounding spheres
};

} // namespace obscura::emulator
