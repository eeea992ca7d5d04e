// SPDX-License-Identifier: Apache-2.0
// Limb and terminator of a body as points in the body frame.
#pragma once

#include "core/scene_truth.hpp"
#include "renderer/truth/row_states.hpp"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <vector>

namespace obscura::renderer {

/// Limb: the outline seen by the camera. Terminator: where the centre of the Sun is on the horizon. Of
/// ellipsoids both are exact: the points whose tangent planes hold the camera, or the centre of the Sun. Of
/// other shapes they are outlines seen by the camera and by the Sun, found by rays outwards from the
/// direction to the body's origin: the outermost surface in each. They hold at the middle of the first
/// window, and their points are taken along with the body. Points of terrains that cannot be in the frame's
/// field are left out; the rays of the others end within 1e-9 of the body's radius. Shadows within the
/// outline that the Sun sees have no part in the terminator.
class BodyCurve {
public:
    /// The arguments outlive this.
    BodyCurve(const TruthScene& scene, std::size_t body, TruthKind kind, std::uint32_t points,
              RowStates& states);

    /// Whether there is a point `i` of the curve: not from inside the body, nor without a Sun, nor outside
    /// the field.
    [[nodiscard]] bool has(const TruthState& state, std::uint32_t i) const;
    /// Body frame.
    [[nodiscard]] Vec3 point_m(const TruthState& state, std::uint32_t i) const;
    /// Whether the body itself does not hide it.
    [[nodiscard]] bool near_side(const TruthState& state, std::uint32_t i) const;
    /// Whether the centre of the Sun is above the horizon.
    [[nodiscard]] bool lit(const TruthState& state, std::uint32_t i) const;

private:
    /// Finds the points of a terrain on an ellipsoid.
    void find_on_heights(const SurfaceTiles& tiles, RowStates& states);
    /// Camera, or the Sun, in the frame of the body.
    [[nodiscard]] Vec3 viewer_m(const TruthState& state) const;

    const TruthScene& scene_;
    std::size_t body_;
    TruthKind kind_;
    std::uint32_t points_;
    Vec3 radii_m_;                                ///< 0: not an ellipsoid
    std::pmr::vector<std::optional<Vec3>> found_; ///< by rays
};

} // namespace obscura::renderer
