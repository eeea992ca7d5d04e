// SPDX-License-Identifier: Apache-2.0
// Brightness of ground whose slopes are too fine for its cells, against the same ground resolved.
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "rough_ground.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <memory>

namespace unresolved_slopes_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr int packets = 2048, few = 16;

std::unique_ptr<renderer::Material> material_of(int law) {
    renderer::HapkeParameters p;
    p.single_scattering_albedo = 0.3;
    if (law == 0) return std::make_unique<renderer::Hapke>(p);
    return std::make_unique<renderer::Lambert>(renderer::LambertParameters{0.5});
}

} // namespace

TEST_CASE("Ground has the brightness of its unresolved slopes") {
    const double slope_deg = 10;
    const RoughGround fine(slope_deg, RoughGround::fine_level, false),
        bare(slope_deg, RoughGround::coarse_level, false), facets(slope_deg, RoughGround::coarse_level, true);
    const auto law = GENERATE(0, 1);
    const std::unique_ptr<renderer::Material> material = material_of(law);
    double worst = 0, worst_bare = 0;
    for (const Geometry at : {Geometry{0, 0, 0},
                              {30, 0, 0},
                              {60, 0, 0},
                              {60, 30, 0},
                              {60, 60, 0},
                              {60, 60, 90},
                              {60, 60, 180},
                              {75, 0, 0},
                              {75, 60, 180}}) {
        const double truth = fine.reflectance(*material, at, packets).value,
                     with = facets.reflectance(*material, at, few).value,
                     without = bare.reflectance(*material, at, few).value;
        INFO("law " << law << ", incidence " << at.incidence_deg << ", emission " << at.emission_deg << ": "
                    << without / truth << " without, " << with / truth << " with");
        CHECK_THAT(with, WithinRel(truth, at.incidence_deg > 60 ? 0.03 : 0.015));
        worst = std::max(worst, std::abs(with / truth - 1));
        worst_bare = std::max(worst_bare, std::abs(without / truth - 1));
    }
    CHECK(worst < worst_bare / 5);
}

TEST_CASE("The light of facets is the mean over a Gaussian of slopes") {
    constexpr int lane = 3;
    const double variance = 0.02; // along a direction
    const Vec3 normal = normalized(Vec3{0.3, -0.2, 0.8}), to_sun = normalized(Vec3{0.6, 0.3, 0.7}),
               to_eye = normalized(Vec3{-0.1, -0.5, 0.9});
    Vec3 x, y;
    orthonormal_basis(normal, x, y);
    renderer::SurfacePacket surface;
    renderer::Vec3s view, light;
    renderer::Doubles unresolved, r, own;
    for (int i = 0; i < renderer::packet_size; ++i) {
        surface.normal.set(i, i == lane ? normal : Vec3{0, 0, 1});
        view.set(i, i == lane ? -to_eye : Vec3{0, 0, -1});
        light.set(i, i == lane ? to_sun : Vec3{0, 0, 1});
        unresolved[i] = i == lane ? 2 * variance : 0;
    }
    const std::unique_ptr<renderer::Material> material = material_of(0);
    renderer::ground_reflectance(*material, surface, view, light, nullptr, &unresolved, r);
    // No facet is near a shadow here: its mean is a plain integral.
    double sum = 0, area = 0;
    constexpr int steps = 61;
    for (int j = 0; j < steps; ++j)
        for (int i = 0; i < steps; ++i) {
            const double u = 8.0 * (i + 0.5) / steps - 4, v = 8.0 * (j + 0.5) / steps - 4;
            const Vec3 facet = normal - std::sqrt(variance) * (u * x + v * y);
            renderer::ScatterPacket s;
            for (int k = 0; k < renderer::packet_size; ++k) {
                s.cos_in[k] = dot(normalized(facet), to_sun);
                s.cos_out[k] = dot(normalized(facet), to_eye);
                s.cos_phase[k] = dot(to_sun, to_eye);
            }
            material->reflectance(s, own);
            const double seen = std::exp(-(u * u + v * v) / 2) * dot(facet, to_eye);
            sum += seen * own[0];
            area += seen;
        }
    CHECK_THAT(r[lane], WithinRel(sum / area, 1e-3));
    renderer::ground_reflectance(*material, surface, view, light, nullptr, nullptr, own);
    CHECK(std::abs(own[lane] / r[lane] - 1) > 0.01);
    // Lanes without slopes, the light in the zenith, are as the level ground.
    CHECK_THAT(r[0], WithinRel(own[0], 1e-9));
}

TEST_CASE("Rendered ground has the light of its unresolved slopes, however it finds its shadows") {
    const auto mean = [](renderer::UnresolvedSlopes slopes, renderer::SunVisibilityKind kind,
                         std::uint32_t bounces, std::uint32_t cells) {
        scene::Scene s;
        renderer::TerrainParameters ground;
        ground.half_edge_m = 64;
        ground.relief.detail.terrain = renderer::DetailTerrain::own;
        ground.relief.detail.baselines_m = {0.25, 0.5, 2};
        ground.relief.detail.slopes_deg = {12, 12, 3};
        ground.relief.unresolved_slopes = slopes;
        ground.relief.sun_visibility = kind;
        ground.relief.cells_per_face = cells;
        s.bodies.push_back({"ground", ground, renderer::LambertParameters{0.3}, {}});
        s.sun.position_m = astronomical_unit_m * Vec3{std::sin(60 * degree), 0, std::cos(60 * degree)};
        s.camera = camera_at({1, 1, 1}, 32, 4e-4);
        const Vec3 eye{-1000 * std::sin(60 * degree), 0, 1000 * std::cos(60 * degree)};
        s.camera.motion.samples[0].pose = {eye, look_along(-1.0 * eye, {0, 1, 0})};
        renderer::RenderSettings settings{cells > 256 ? 16u : 4u, 2, 1};
        settings.max_bounces = bounces;
        return render(renderer::Renderer(s, settings)).sum();
    };
    using renderer::SunVisibilityKind;
    using Slopes = renderer::UnresolvedSlopes;
    const double fine = mean(Slopes::facets, SunVisibilityKind::traced, 0, 4096);
    const double bare = mean(Slopes::in_material, SunVisibilityKind::traced, 0, 256);
    const double traced = mean(Slopes::facets, SunVisibilityKind::traced, 0, 256);
    CHECK(std::abs(bare / fine - 1) > 0.04);
    CHECK_THAT(traced, WithinRel(fine, 0.03));
    // Their texels are means over two cells each way.
    CHECK_THAT(mean(Slopes::facets, SunVisibilityKind::tiles, 0, 256), WithinRel(traced, 0.04));
    CHECK_THAT(mean(Slopes::facets, SunVisibilityKind::traced, 1, 256), WithinRel(traced, 0.02));
}

} // namespace unresolved_slopes_test
