// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/planetshine.hpp"

#include <algorithm>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Least irradiance over the Sun's: of fainter sources the light is left to random directions.
constexpr double min_ratio = 1e-7;
/// Largest squared sine of a source's angular radius.
constexpr double max_sine2 = 0.5;

/// Radiance of a surface lit and seen at 45 degrees, per collimated irradiance, times pi.
double brightness(const BodyState& body) {
    ScatterPacket scatter;
    for (int i = 0; i < packet_size; ++i) {
        scatter.cos_in[i] = scatter.cos_out[i] = std::numbers::sqrt2 / 2;
        scatter.cos_phase[i] = 0.5;
    }
    Doubles r;
    body.material->reflectance(scatter, r);
    return std::numbers::pi * r[0] * (body.built->textures ? body.built->textures->mean_factor() : 1);
}

} // namespace

void find_planetshine(RowState& row) {
    for (BodyState& body : row.bodies)
        body.planetshine.fill({});
    for (std::size_t b = 0; b < row.bodies.size(); ++b) {
        const BodyState& source = row.bodies[b];
        if (source.material == nullptr || source.material->mirror_reflectance() >= 0) continue;
        const double radius = source.shape->bounding_radius_m();
        const Vec3 to_sun = row.sun_m - source.seen.pose.position_m;
        double bright = -1; // evaluated where it is used
        for (std::size_t a = 0; a < row.bodies.size(); ++a) {
            BodyState& body = row.bodies[a];
            if (a == b || body.material == nullptr) continue;
            const Vec3 to_body = body.seen.pose.position_m - source.seen.pose.position_m;
            const double near = length(to_body) - body.shape->bounding_radius_m();
            if (!(radius * radius < max_sine2 * near * near && near > 0)) continue;
            // The irradiance of a sphere at 1 au is as uncertain as its law; this is for the choice only.
            if (bright < 0) bright = brightness(source);
            const double cos_phase = dot(to_sun, to_body) / (length(to_sun) * length(to_body));
            const double suns =
                length_squared(row.sun_m - body.seen.pose.position_m) / length_squared(to_sun);
            const double ratio = bright * radius * radius / (near * near) * (1.01 + cos_phase) / 2 * suns;
            auto& sources = body.planetshine;
            const auto place = std::find_if(sources.begin(), sources.end(),
                                            [&](const PlanetshineSource& s) { return ratio > s.ratio; });
            if (!(ratio > min_ratio) || place == sources.end()) continue;
            std::move_backward(place, sources.end() - 1, sources.end());
            *place = {static_cast<std::int32_t>(b), ratio};
        }
    }
}

} // namespace obscura::renderer
