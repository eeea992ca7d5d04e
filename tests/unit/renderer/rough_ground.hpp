// SPDX-License-Identifier: Apache-2.0
// Mean brightness of a plane of known roughness, by rays to it and from it to the Sun, at any level of
// detail.
#pragma once

#include "renderer/integrators/rough_ground.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/planets/detail_parameters.hpp"
#include "renderer/planets/terrain_shape.hpp"
#include "terrain_function.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>

namespace obscura::test {

/// Angles in degrees; azimuth of the viewer from the Sun's, 0: both on the same side.
struct Geometry {
    double incidence_deg, emission_deg, azimuth_deg;
};

/// Plane with noise of wavelengths of 1 to 4 m or so, whose slopes are those of a Gaussian: `slope_deg` is
/// the rms slope along a direction at short baselines.
class RoughGround {
public:
    static constexpr double half_edge_m = 1024, patch_m = 128;
    static constexpr int coarse_level = 0; ///< cells of 8 m: as if there was no noise
    static constexpr int fine_level = 8;   ///< of 3 cm

    RoughGround(double slope_deg, int level, bool facets, double crater_age_ga = 0) {
        renderer::DetailParameters detail;
        detail.terrain = renderer::DetailTerrain::own;
        const double slope = std::tan(slope_deg * degree);
        const auto over = [&](double factor) { return std::atan(slope / factor) / degree; };
        detail.baselines_m = {0.25, 0.5, 4, 16};
        detail.slopes_deg = {over(1), over(1), over(4), over(16)};
        detail.crater_age_ga = crater_age_ga;
        detail.crater_largest_m = 4;
        const auto domain = terrain::SurfaceDomain::plane(half_edge_m);
        renderer::TerrainShape::Settings settings = at_level(level);
        settings.tiles.lost_slopes = facets;
        shape_ = std::make_unique<renderer::TerrainShape>(
            domain, renderer::make_detail(detail, domain, false).layers, settings);
        pin_ = shape_->tiles()->pin();
    }

    struct Mean {
        double value = 0, error = 0; ///< standard error: points are taken for independent
    };
    /// Mean of the radiance per irradiance, over what a viewer far away sees of a part of it.
    [[nodiscard]] Mean reflectance(const renderer::Material& material, Geometry at, int packets) const {
        const auto direction = [](double zenith_deg, double azimuth_deg) {
            const double z = zenith_deg * degree, a = azimuth_deg * degree;
            return Vec3{std::sin(z) * std::cos(a), std::sin(z) * std::sin(a), std::cos(z)};
        };
        const Vec3 to_sun = direction(at.incidence_deg, 20);
        const Vec3 to_eye = direction(at.emission_deg, 20 + at.azimuth_deg);
        Directions random(7);
        double sum = 0, squares = 0, count = 0;
        for (int n = 0; n < packets; ++n) {
            renderer::RayPacket rays, shadow;
            renderer::HitPacket hits;
            hits.clear();
            renderer::Vec3s light;
            for (int i = 0; i < renderer::packet_size; ++i) {
                const Vec3 ground{patch_m * (random.number() - 0.5), patch_m * (random.number() - 0.5), 0};
                rays.origin.set(i, ground + 200 * to_eye);
                rays.direction.set(i, -to_eye);
                light.set(i, to_sun);
                rays.t_max[i] = shadow.t_max[i] = renderer::no_hit;
                rays.active.on[i] = -1;
                rays.level_u[i] = shadow.level_u[i] = 0.5;
            }
            shape_->intersect(rays, 0, hits);
            renderer::SurfacePacket surface;
            shape_->surface(rays, hits, 0, surface);
            renderer::Doubles unresolved, r;
            const bool rougher = shape_->unresolved_slopes(hits, 0, unresolved);
            renderer::ground_reflectance(material, surface, rays.direction, light, nullptr,
                                         rougher ? &unresolved : nullptr, r);
            shadow.origin = surface.shadow_origin;
            shadow.direction = light;
            for (int i = 0; i < renderer::packet_size; ++i)
                shadow.active.on[i] = r[i] > 0 ? -1 : 0;
            shape_->occlude(shadow);
            for (int i = 0; i < renderer::packet_size; ++i) {
                const double value = shadow.active.on[i] != 0 ? r[i] : 0;
                sum += value;
                squares += value * value;
                ++count;
            }
        }
        const double mean = sum / count;
        return {mean, std::sqrt(std::max(squares / count - mean * mean, 0.0) / count)};
    }

    [[nodiscard]] const renderer::SurfaceTiles& tiles() const { return *shape_->tiles(); }

private:
    static constexpr double degree = std::numbers::pi / 180;

    std::unique_ptr<renderer::TerrainShape> shape_;
    renderer::SurfaceTiles::Pin pin_;
};

} // namespace obscura::test
