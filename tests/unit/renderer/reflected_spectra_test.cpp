// SPDX-License-Identifier: Apache-2.0
// Light that coloured bodies reflect one after the other: the integral over wavelength of the source's
// spectrum, all curves and the detector's efficiency, by sums of the test's own.
#include "core/solar_spectrum.hpp"
#include "renderer/lights/colour_products.hpp"
#include "renderer/lights/detector_response.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/linear_curve.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

namespace reflected_spectra_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinRel;
using Curve = std::vector<SpectralPoint>;

namespace {

const Curve red{{400e-9, 0.05}, {600e-9, 0.1}, {700e-9, 0.7}, {900e-9, 0.9}};
const Curve blue{{400e-9, 0.9}, {500e-9, 0.6}, {620e-9, 0.1}, {900e-9, 0.05}};
const Curve green{{480e-9, 0.1}, {540e-9, 0.8}, {600e-9, 0.1}};
const Curve hot{{400e-9, 0.01}, {700e-9, 0.3}, {900e-9, 1.0}};
const Curve efficiency{{350e-9, 0.1}, {550e-9, 0.7}, {800e-9, 0.3}, {950e-9, 0.05}};

/// Electrons of light that all these curves reflect over those without: sum in steps of 0.02 nm. No `source`:
/// the Sun.
double share(const Curve* source, const std::vector<Curve>& curves, const SpectralBand& band, bool counted) {
    double lit = 0;
    double all = 0;
    for (double at = band.from_m + 0.01e-9; at < band.to_m; at += 0.02e-9) {
        const double electrons = counted ? linear(efficiency, at) * at : 1;
        double light =
            (source != nullptr ? linear(*source, at) : solar_spectral_irradiance_w_m3(at)) * electrons;
        all += light;
        for (const Curve& curve : curves)
            light *= linear(curve, at);
        lit += light;
    }
    return lit / all;
}

std::vector<SpectralBand> bands() {
    return {{400e-9, 900e-9}, {500e-9, 700e-9}};
}

scene::Body ball(double radius_m, Vec3 position_m, const Curve* curve) {
    scene::Body body{"ball",
                     renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}},
                     renderer::LambertParameters{0.8},
                     {}};
    body.motion.samples[0].pose.position_m = position_m;
    if (curve != nullptr) {
        body.colour_curve = *curve;
        for (const SpectralBand& band : bands())
            body.colour.push_back(renderer::sunlit_mean(*curve, band));
    }
    return body;
}

/// The camera looks at a ball of 1 m about the origin, from +x.
scene::Scene scene_of(const Curve* curve) {
    scene::Scene s;
    s.quantity = scene::Quantity::radiance;
    s.bands = bands();
    s.bodies.push_back(ball(1, {}, curve));
    s.camera = camera_at({5, 0, 0}, 8, 0.02);
    s.camera.psf_sigma_px = 0;
    return s;
}

/// Light in each band, with the response of the detector if `counted`.
std::vector<double> light(scene::Scene s, std::uint32_t bounces, bool counted) {
    if (counted) renderer::set_detector_response(s, efficiency);
    renderer::RenderSettings settings{64, 2, 5};
    settings.max_bounces = bounces;
    const std::vector<float> image =
        render_window(renderer::Renderer(s, settings), {0, 0, s.camera.width, s.camera.height});
    const std::size_t bands = s.bands.size(), pixels = image.size() / bands;
    std::vector<double> sums(bands, 0.0);
    for (std::size_t b = 0; b < bands; ++b)
        for (std::size_t k = 0; k < pixels; ++k)
            sums[b] += static_cast<double>(image[b * pixels + k]);
    return sums;
}

/// Electrons of a second ball's light on the dark side of the first.
std::vector<double> planetshine(const Curve* receiver, const Curve* sender, bool counted) {
    scene::Scene s = scene_of(receiver);
    s.sun.position_m = {-astronomical_unit_m, 0, 0};
    s.bodies.push_back(ball(3, {9, 7, 0}, sender));
    return light(s, 1, counted);
}

} // namespace

TEST_CASE("planetshine has the spectra of the Sun and of both bodies") {
    for (const bool counted : {false, true}) {
        const std::vector<double> grey = planetshine(nullptr, nullptr, counted),
                                  coloured = planetshine(&blue, &red, counted);
        for (std::size_t b = 0; b < grey.size(); ++b) {
            const SpectralBand band = bands()[b];
            INFO("band " << b << (counted ? ", electrons" : ", W/m2"));
            REQUIRE(grey[b] > 0);
            const double wanted = share(nullptr, {red, blue}, band, counted);
            CHECK_THAT(coloured[b] / grey[b], WithinRel(wanted, 3e-3));
            // Far from the product of the means.
            CHECK(share(nullptr, {red}, band, counted) * share(nullptr, {blue}, band, counted) >
                  1.3 * wanted);
        }
    }
}

TEST_CASE("lamps and glowing bodies light coloured ones by their own spectra") {
    const auto lit = [](const Curve* receiver, bool glows, bool counted) {
        scene::Scene s = scene_of(receiver);
        s.sun.irradiance_scale = 0;
        if (glows) {
            s.bodies.push_back(ball(0.5, {3, 3, 0}, nullptr));
            s.bodies[1].emission_w_m2_sr = {10, 10};
            s.bodies[1].emission_spectrum = hot;
        } else {
            scene::Lamp lamp;
            lamp.intensity_w_sr = {10, 10};
            lamp.spectrum = hot;
            lamp.motion.samples[0].pose.position_m = {3, 3, 0};
            s.lamps.push_back(lamp);
        }
        return light(s, glows ? 1 : 0, counted);
    };
    for (const bool glows : {false, true})
        for (const bool counted : {false, true}) {
            const std::vector<double> grey = lit(nullptr, glows, counted),
                                      coloured = lit(&blue, glows, counted);
            for (std::size_t b = 0; b < grey.size(); ++b) {
                const SpectralBand band = bands()[b];
                INFO("band " << b << (glows ? ", body" : ", lamp") << (counted ? ", electrons" : ", W/m2"));
                REQUIRE(grey[b] > 0);
                const double wanted = share(&hot, {blue}, band, counted);
                CHECK_THAT(coloured[b] / grey[b], WithinRel(wanted, 1e-3));
                CHECK(share(nullptr, {blue}, band, counted) > 1.1 * wanted);
            }
        }
}

TEST_CASE("chains of coloured surfaces count in any order, as often as they were met") {
    scene::Scene s;
    s.bands = bands();
    for (const Curve* curve : {&red, &green, &blue})
        s.bodies.push_back(ball(1, {}, curve));
    scene::Lamp lamp;
    lamp.intensity_w_sr = {1, 1};
    lamp.spectrum = hot;
    s.lamps.push_back(lamp);
    const renderer::ColourProducts products(s, 2);
    REQUIRE_FALSE(products.empty());
    const auto after = [&](std::initializer_list<std::int32_t> bodies) {
        renderer::ColourProducts::Chain chain = renderer::ColourProducts::none;
        for (const std::int32_t body : bodies)
            chain = products.next(chain, body);
        return chain;
    };
    CHECK(after({0, 1, 2}) == after({2, 0, 1}));
    CHECK(after({0, 0, 1}) != after({0, 1, 1}));
    CHECK(after({3}) == renderer::ColourProducts::none); // the Sun
    for (std::size_t b = 0; b < s.bands.size(); ++b) {
        const auto mean = [&](const Curve& curve) { return renderer::sunlit_mean(curve, s.bands[b]); };
        CHECK_THAT(products.factor(after({1, 0, 0}), products.source_of_lamp(0), b) * mean(red) * mean(red) *
                       mean(green),
                   WithinRel(share(&hot, {red, red, green}, s.bands[b], false), 1e-3));
        CHECK_THAT(products.factor(after({1, 2}), renderer::ColourProducts::sun, b) * mean(green) *
                       mean(blue),
                   WithinRel(share(nullptr, {green, blue}, s.bands[b], false), 1e-3));
        CHECK(products.factor(after({2}), renderer::ColourProducts::sun, b) == 1);
    }
    // What a single reflection of sunlight needs no table for.
    s.lamps.clear();
    CHECK(renderer::ColourProducts(s, 0).empty());
}

} // namespace reflected_spectra_test
