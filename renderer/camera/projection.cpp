// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/projection.hpp"

#include "renderer/camera/lens.hpp"
#include "renderer/camera/model_projection.hpp"
#include "renderer/camera/pinhole.hpp"
#include "renderer/packets/vector_math.hpp"

#include <algorithm>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Margin beyond the sensor within which directions are projected, for bodies and stars that reach in.
constexpr double min_margin_px = 32;

} // namespace

std::unique_ptr<Projection> make_projection(const scene::Camera& camera) {
    if (camera.projection == scene::Projection::model) return std::make_unique<ModelProjection>(camera);
    const bool plain = camera.projection == scene::Projection::pinhole &&
                       camera.distortion.model == scene::Distortion::Model::none &&
                       camera.distortion.coefficients.empty() && camera.distortion.ideal_mm.empty() &&
                       camera.distortion.real_mm.empty() && camera.principal_offset_px[0] == 0 &&
                       camera.principal_offset_px[1] == 0 && camera.sensor_rotation_rad == 0 &&
                       !camera.pupil_cosine;
    if (plain) return std::make_unique<Pinhole>(camera);
    return std::make_unique<Lens>(camera);
}

double projected_margin_px(const scene::Camera& camera) {
    // The wings are an ellipse in rectangular pixels.
    const double wings_px = camera.psf.wings_px * std::max(1.0, 1 / camera.pixel_aspect());
    return std::max(min_margin_px, wings_px + 1);
}

std::array<Vec3, 5> directions_around(Vec3 unit, double step) {
    Vec3 a;
    Vec3 b;
    orthonormal_basis(unit, a, b);
    return {unit, unit + step * a, unit + step * b, unit + step * ((a + b) / std::numbers::sqrt2),
            unit + step * ((a - b) / std::numbers::sqrt2)};
}

} // namespace obscura::renderer
