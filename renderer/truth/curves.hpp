// SPDX-License-Identifier: Apache-2.0
// Limb and terminator of a body as points in the body frame.
#pragma once

#include "core/camera/scene_truth.hpp"
#include "renderer/truth/row_states.hpp"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <numbers>
#include <optional>
#include <vector>

namespace obscura::renderer {

/// Azimuths of points of a curve about the direction from its viewer to the body's origin.
struct CurveSpan {
    double from_rad = 0, width_rad = 0;
    std::uint32_t steps = 1;  ///< of the width
    std::uint32_t points = 0; ///< the first at from_rad

    /// The whole turn.
    [[nodiscard]] static CurveSpan turn(std::uint32_t points) {
        return {0, 2 * std::numbers::pi, points, points};
    }
    /// Part of the turn, both ends included.
    [[nodiscard]] static CurveSpan part(double from_rad, double width_rad, std::uint32_t points) {
        return {from_rad, width_rad, points - 1, points};
    }
    [[nodiscard]] double azimuth_rad(std::uint32_t i) const { return from_rad + width_rad * i / steps; }
};

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
    BodyCurve(const TruthScene& scene, std::size_t body, TruthKind kind, const CurveSpan& span,
              RowStates& states);

    /// Where a limb is about, body frame, without a search: exact of an ellipsoid, of a terrain the limb of
    /// the sphere half way between its lowest and highest ground; empty: not known, of other shapes and from
    /// inside.
    [[nodiscard]] static std::optional<Vec3> about_m(const TruthScene& scene, std::size_t body,
                                                     const TruthState& state, double azimuth_rad);

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
    CurveSpan span_;
    Vec3 radii_m_;                                ///< 0: not an ellipsoid
    std::pmr::vector<std::optional<Vec3>> found_; ///< by rays
};

} // namespace obscura::renderer
