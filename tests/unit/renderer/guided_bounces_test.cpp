// SPDX-License-Identifier: Apache-2.0
// Guided bounce rays against cosine-weighted ones: the same light, less noise.
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/shapes/elevation_guide.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <array>

namespace guided_bounces_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

const renderer::ProceduralBodyParameters asteroid{500, {1, 0.8, 0.7}, 3, 5};

/// Total of a frame, its variance from frame to frame over all pixels, and the rays of all frames.
struct Light {
    double total = 0;
    double variance = 0;
    double rays = 0;
};

Light light(const scene::Material& material, std::uint32_t bounces) {
    scene::Scene s = sphere_scene(renderer::LambertParameters{1}, 1.0, 24, 48);
    s.bodies[0].shape = asteroid;
    s.bodies[0].material = material;
    s.bodies[0].colour = {1};
    Light out;
    constexpr int frames = 24;
    std::vector<double> sum(48 * 48);
    std::vector<double> squares(48 * 48);
    for (int k = 0; k < frames; ++k) {
        renderer::RenderSettings settings{16, 2, static_cast<std::uint64_t>(k) + 1};
        settings.max_bounces = bounces;
        const renderer::Renderer renderer(s, settings);
        const Image image = render(renderer);
        out.rays += static_cast<double>(renderer.rays_traced());
        for (std::size_t i = 0; i < sum.size(); ++i) {
            const double value = static_cast<double>(image.values[i]);
            sum[i] += value;
            squares[i] += value * value;
        }
    }
    for (std::size_t i = 0; i < sum.size(); ++i) {
        out.total += sum[i] / frames;
        out.variance += (squares[i] - sum[i] * sum[i] / frames) / (frames - 1);
    }
    return out;
}

} // namespace

TEST_CASE("Elevations of guided rays have their stated density") {
    renderer::ShapeContext context;
    const auto shape = renderer::make_shape(asteroid, context);
    const renderer::ElevationGuide guide(*shape, true);
    REQUIRE(guide.guides());
    // The low elevations are favoured, and the density is that of probabilities.
    CHECK(guide.density(1e-4) > 2);
    CHECK(guide.density(0.9) < 1);
    double integral = 0;
    constexpr int steps = 1 << 16;
    for (int i = 0; i < steps; ++i)
        integral += guide.density((i + 0.5) / steps) / steps;
    CHECK_THAT(integral, WithinAbs(1, 1e-12));
    // Uniform numbers in equal steps: the share below any elevation is the integral of the density.
    constexpr std::array bounds{0.0005, 0.003, 0.02, 0.1, 0.3, 0.7};
    std::array<int, bounds.size()> below{};
    for (int i = 0; i < steps; i += renderer::packet_size) {
        renderer::Doubles u;
        renderer::Doubles cos2;
        renderer::Doubles density;
        renderer::Doubles expectation;
        for (int lane = 0; lane < renderer::packet_size; ++lane)
            u[lane] = (i + lane + 0.5) / steps;
        guide.sample(u, cos2, density, expectation);
        for (int lane = 0; lane < renderer::packet_size; ++lane) {
            REQUIRE(density[lane] == guide.density(cos2[lane]));
            for (std::size_t b = 0; b < bounds.size(); ++b)
                below[b] += cos2[lane] < bounds[b] ? 1 : 0;
        }
    }
    for (std::size_t b = 0; b < bounds.size(); ++b) {
        double expected = 0;
        for (int i = 0; i < steps; ++i)
            expected += guide.density((i + 0.5) * bounds[b] / steps) * bounds[b] / steps;
        CHECK_THAT(static_cast<double>(below[b]) / steps, WithinAbs(expected, 1e-4));
    }
}

TEST_CASE("Guided bounces bring the same light with less noise") {
    // Phong's law without a lobe is Lambert's, but has a sampling method of its own, which is not guided.
    const Light guided = light(renderer::LambertParameters{0.9}, 2);
    const Light plain = light(renderer::PhongParameters{0.9, 0, 1}, 2);
    const Light direct = light(renderer::LambertParameters{0.9}, 0);
    const double indirect = plain.total - direct.total;
    // Noise for a number of rays, both beyond those of direct light.
    const double guided_cost = (guided.variance - direct.variance) * (guided.rays - direct.rays);
    const double plain_cost = (plain.variance - direct.variance) * (plain.rays - direct.rays);
    INFO("variances " << guided.variance << ' ' << plain.variance << ' ' << direct.variance << ", rays "
                      << guided.rays << ' ' << plain.rays << ' ' << direct.rays);
    REQUIRE(indirect > 0.002 * direct.total);
    CHECK_THAT(guided.total - direct.total, WithinRel(indirect, 0.06));
    CHECK(guided_cost < 0.7 * plain_cost);
}

} // namespace guided_bounces_test
