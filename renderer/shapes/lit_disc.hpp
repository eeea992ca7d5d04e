// SPDX-License-Identifier: Apache-2.0
// Sunlit and dark part of an ellipsoid's disc: sampling of directions, uniform in projected area.
#pragma once

#include "core/geometry.hpp"
#include "renderer/shapes/shape.hpp"

#include <cstdint>

namespace obscura::renderer {

/// Visible disc of an ellipsoid from one position, divided along the terminator into a lit and a dark part.
///
/// The ellipsoid is scaled to a unit sphere, whose disc in the plane perpendicular to the direction of its
/// centre (gnomonic projection) is a circle, and whose terminator there is an ellipse. The lit part holds
/// every point that sees some of the Sun's disc. Chords parallel to the Sun's direction are cut at the
/// terminator; the unit disc is mapped to the pieces chord by chord, so that both parts are sampled without
/// rejection, with their exact solid angles. Of a shape that is no ellipsoid the bounding sphere is taken,
/// and its lit part is never less than the half towards the Sun.
class LitDisc {
public:
    enum class Part : std::uint8_t { lit, dark };

    /// No disc: all solid angles are 0.
    LitDisc() = default;
    /// The disc of `shape` from `observer_m`; the Sun at `sun_m` (body frame). 0 as `sun_radius_m`: all of
    /// the disc counts as lit. Without a disc if the observer is inside.
    LitDisc(const Shape& shape, Vec3 observer_m, Vec3 sun_m, double sun_radius_m);

    /// Samples a unit direction (body frame) from u, v in [0,1); returns the inverse of its pdf, sr; 0: none.
    double sample(Part part, double u, double v, Vec3& direction) const;
    /// Inverse of the pdf of `direction` (unit, body frame) by sample(), sr; 0: outside the part.
    [[nodiscard]] double inverse_pdf_sr(Part part, Vec3 direction) const;
    /// Approximate share of the disc that is lit, 0 to 1; of a shape that is no ellipsoid, as if it were one.
    [[nodiscard]] double lit_share() const { return lit_share_; }
    /// Whether the shape is an ellipsoid: nothing of its disc is missed, and the Sun lights its lit part
    /// only.
    [[nodiscard]] bool exact() const { return limb_tangent_ > 0 && !half_at_least_; }
    /// Whether `direction` (unit, body frame) is one of the lit part's.
    [[nodiscard]] bool lit(Vec3 direction) const { return inverse_pdf_sr(Part::lit, direction) > 0; }

private:
    /// Position of the terminator on the chord at `y`, which reaches from -half to half.
    [[nodiscard]] double terminator(double y, double half) const;
    /// Piece of a chord, from `from` to `from` + `width`.
    struct Piece {
        double from, width;
    };
    [[nodiscard]] Piece piece(Part part, double y, double half) const;

    Vec3 radii_m_{1, 1, 1};
    /// Unit axes in the scaled frame: x towards the Sun's side, z towards the centre.
    Vec3 x_axis_, y_axis_, z_axis_;
    double limb_tangent_ = 0; ///< tangent of the disc's angular radius in the scaled frame; 0: no disc
    double scale_m3_ = 0;     ///< product of the radii times the squared tangent
    double lit_share_ = 1;
    bool all_lit_ = true;
    bool half_at_least_ = false; ///< the lit part is at least the half towards the Sun
    // Terminator: the points whose normal makes the angle acos(c) with the Sun's direction (s_x, 0, s_z) in
    // the axes above, for an observer at D > 1 radii: x = (s_x m + k sqrt(1 - c^2 - a y^2)) / a with
    // m = (s_z + c D) / sqrt(D^2 - 1), k = (c + D s_z) / sqrt(D^2 - 1), a = s_x^2 + k^2. It meets the limb at
    // x = m / s_x.
    double sun_x_ = 0, limb_ = 0, slant_ = 0, inverse_square_ = 0, square_ = 0, rest_ = 0;
};

} // namespace obscura::renderer
