// SPDX-License-Identifier: Apache-2.0
// Cone of what a frame's camera may see of a body while the rows are exposed, for culling.
#pragma once

#include "renderer/truth/row_states.hpp"

#include <array>
#include <cstddef>

namespace obscura::renderer {

/// The field about the boresight in the middle of the frame, wider by how boresight and eye move in the
/// body's frame until the first and the last row.
class FieldCone {
public:
    FieldCone(const TruthScene& scene, RowStates& states, std::size_t body);

    /// First, middle and last row.
    [[nodiscard]] const std::array<const TruthState*, 3>& rows() const { return rows_; }
    [[nodiscard]] Vec3 eye_m() const { return eye_m_; } ///< body frame
    [[nodiscard]] double moved_m() const { return moved_m_; }

    /// Whether anything of a ball, body frame, may be in the field.
    [[nodiscard]] bool may_show(Vec3 centre_m, double radius_m) const;

private:
    std::array<const TruthState*, 3> rows_{};
    Vec3 eye_m_, boresight_;
    double moved_m_ = 0;   ///< of the eye
    double field_rad_ = 0; ///< half angle
};

/// Unit heights between which a terrain on an ellipsoid is, at all and at a place.
struct HeightBounds {
    double least = 0, highest_here = 0;
};

/// Whether some of what is above a part of an ellipsoid's surface, within `radius_m` of a place of it, may
/// rise over the horizon of an eye: beyond the tangent from there to the least sphere, in scaled space.
[[nodiscard]] bool may_rise(Vec3 radii_m, Vec3 eye_m, Vec3 place_m, double radius_m, HeightBounds heights);

} // namespace obscura::renderer
