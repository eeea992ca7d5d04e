// SPDX-License-Identifier: Apache-2.0
// V magnitudes and colours of rendered planets and moons against published photometry.
#include "renderer/lights/star_spectra.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace planet_magnitudes_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double deg = std::numbers::pi / 180;

// Bessell, UBVRI passbands, PASP 102, 1181 (1990), table 2: every 10 nm.
struct Passband {
    double from_nm;
    std::vector<double> values;
};
const Passband band_b{360, {0,   .03,  .134, .567, .92,  .978, 1,    .978, .935, .853, .74,
                            .64, .536, .424, .325, .235, .15,  .095, .043, .009, 0}};
const Passband band_v{470, {0,    .03,  .163, .458, .78,  .967, 1,    .973, .898, .792, .684, .574,
                            .461, .359, .27,  .197, .135, .081, .045, .025, .017, .013, .009, 0}};

std::string band_text(const Passband& band) {
    std::vector<std::string> points;
    for (std::size_t i = 0; i < band.values.size(); ++i)
        points.push_back(fmt::format("[{}, {}]", band.from_nm + 10 * static_cast<double>(i), band.values[i]));
    return fmt::format("[[band]]\nfrom_nm = {}\nto_nm = {}\ntransmission = [{}]\n", band.from_nm,
                       band.from_nm + 10 * static_cast<double>(band.values.size() - 1),
                       fmt::join(points, ", "));
}

/// Magnitude at 1 au from Sun and camera of a body of the preset `material`, in B and V: rendered from so far
/// that it is smaller than a pixel, against a star of V = 0 and the Sun's colour.
std::array<double, 2> magnitudes(const std::string& material, std::array<double, 3> radii_m,
                                 double phase_deg) {
    const double distance_m = 1000 * radii_m[0];
    const test::TempFolder folder;
    const scene::Scene s = scene::load_scene(folder.write(
        "s.toml",
        fmt::format(
            "[sun]\ndirection = [{}, {}, 0]\nradius_m = 1e6\n[camera]\nwidth = 16\nheight = "
            "16\npixel_pitch_um = "
            "10\nfocal_length_mm = 2\npsf_sigma_px = 0.5\nposition_m = [{}, 0, 0]\nlook_at_m = [0, 0, "
            "0]\nup = [0, 0, 1]\n[[body]]\nname = \"it\"\nshape = \"ellipsoid\"\nradii_m = [{}]\n"
            "material = \"{}\"\n",
            std::cos(phase_deg * deg), std::sin(phase_deg * deg), distance_m, fmt::join(radii_m, ", "),
            material) +
            band_text(band_b) + band_text(band_v)));
    const std::vector<float> planes = render_window(renderer::Renderer(s, {64, 2, 7}), {0, 0, 16, 16});
    const scene::Star star{0, 0, 0, 0.65};
    std::array<double, 2> out{};
    for (std::size_t band = 0; band < 2; ++band) {
        double flux = 0;
        for (std::size_t i = 0; i < 256; ++i)
            flux += static_cast<double>(planes[256 * band + i]);
        const double zero = renderer::star_irradiance_w_m2(star, s.bands[band]) *
                            (band == 0 ? std::pow(10, 0.4 * 0.65) : 1.0); // star of B = 0
        out[band] = -2.5 * std::log10(flux * std::pow(distance_m / astronomical_unit_m, 2) / zero);
    }
    return out;
}

struct Body {
    std::string name;
    std::array<double, 3> radii_m;
    double v_1_0;                              ///< published V at unit distances and phase 0
    std::function<double(double)> phase_curve; ///< published, magnitudes; from the phase angle in degrees
    double last_deg;                           ///< published up to this angle
    double allowed;                            ///< from the published curve, magnitudes
    double b_v = 0;                            ///< published
};

std::array<double, 3> ball(double km) {
    return {km * 1e3, km * 1e3, km * 1e3};
}

double polynomial(double x, const std::vector<double>& c) {
    double sum = 0;
    for (std::size_t i = c.size(); i-- > 0;)
        sum = sum * x + c[i];
    return sum;
}

/// Formulas as in the papers that renderer/materials/planet_presets.cpp names; python3-skyfield's
/// magnitudelib.py has the same ones of the planets.
std::vector<Body> bodies() {
    const auto mercury = [](double g) {
        return polynomial(g, {0, 6.3280e-02, -1.6336e-03, 3.3644e-05, -3.4265e-07, 1.6893e-09, -3.0334e-12});
    };
    const auto venus = [](double g) {
        return g < 163.7 ? polynomial(g, {0, -1.044e-03, 3.687e-04, -2.814e-06, 8.938e-09})
                         : polynomial(g, {236.05828 + 4.384, -2.81914, 8.39034e-03});
    };
    // Representative values of table of Mallama et al. 2017.
    const auto earth = [](double g) { return g == 0 ? 0 : g == 45 ? 1.123 : g == 90 ? 2.069 : 3.801; };
    const auto mars = [](double g) {
        return g <= 50 ? polynomial(g, {0, 2.267e-02, -1.302e-04})
                       : polynomial(g, {-0.367 + 1.601, -0.02573, 0.0003445});
    };
    const auto jupiter = [](double g) {
        return g <= 12
                   ? polynomial(g, {0, -3.7e-04, 6.16e-04})
                   : -0.033 -
                         2.5 * std::log10(polynomial(g / 180, {1, -1.507, -0.363, -0.062, 2.809, -1.876}));
    };
    const auto saturn = [](double g) {
        return g <= 6.5 ? polynomial(g, {0, -3.7e-04, 6.16e-04})
                        : 0.01 + polynomial(g, {0, 2.446e-4, 2.672e-4, -1.506e-6, 4.767e-9});
    };
    const auto quadratic = [](double a, double b) {
        return [a, b](double g) { return polynomial(g, {0, a, b}); };
    };
    return {
        {"mercury", ball(2439.7), -0.613, mercury, 170, 0.02, 0.97},
        {"venus", ball(6051.8), -4.384, venus, 175, 0.04, 0.70},
        {"earth", ball(6371.0), -3.99, earth, 135, 0.01, 0.47},
        {"mars", ball(3389.5), -1.601, mars, 120, 0.02, 1.36},
        // Oblate, seen from above the equator.
        {"jupiter", {71492e3, 71492e3, 66854e3}, -9.395, jupiter, 130, 0.01, 0.86},
        {"saturn", {60268e3, 60268e3, 54364e3}, -8.95, saturn, 150, 0.01, 1.07},
        {"io", ball(1821.6), 5.02 - 6.70, quadratic(0.046, -0.0010), 12, 0.01, 1.17},
        {"europa", ball(1560.8), 5.29 - 6.70, quadratic(0.0312, -0.00125), 12, 0.01, 0.87},
        {"ganymede", ball(2631.2), 4.61 - 6.70, quadratic(0.0323, -0.00066), 12, 0.01, 0.83},
        {"callisto", ball(2410.3), 5.65 - 6.70, quadratic(0.078, -0.00274), 12, 0.01, 0.86},
    };
}

} // namespace

TEST_CASE("Planets and moons have their published V at opposition") {
    for (const Body& body : bodies()) {
        const auto [b, v] = magnitudes(body.name, body.radii_m, 0);
        UNSCOPED_INFO(fmt::format("{:9} V(1,0) {:6.3f}, published {:6.3f}; B-V {:.3f}, published {:.2f}",
                                  body.name, v, body.v_1_0, b - v, body.b_v));
        CHECK_THAT(v, WithinAbs(body.v_1_0, 0.1));
        CHECK_THAT(b - v, WithinAbs(body.b_v, 0.1));
    }
}

TEST_CASE("Planets and moons follow their published phase curves") {
    for (const Body& body : bodies()) {
        const double zero = magnitudes(body.name, body.radii_m, 0)[1];
        double worst = 0;
        double worst_deg = 0;
        for (const double phase_deg :
             {0.5,  1.0,  3.0,   5.0,   8.0,   12.0,  17.0,  25.0,  35.0,  45.0,  55.0,  65.0,
              75.0, 90.0, 105.0, 118.0, 128.0, 135.0, 148.0, 155.0, 162.0, 166.0, 169.0, 174.0}) {
            if (phase_deg > body.last_deg) break;
            if (body.name == "earth" && phase_deg != 45 && phase_deg != 90 && phase_deg != 135) continue;
            const double v = magnitudes(body.name, body.radii_m, phase_deg)[1] - zero;
            const double off = v - body.phase_curve(phase_deg);
            if (std::abs(off) > std::abs(worst)) {
                worst = off;
                worst_deg = phase_deg;
            }
        }
        INFO(fmt::format("{:9} to {:3} deg: worst {:+.3f} mag at {} deg", body.name, body.last_deg, worst,
                         worst_deg));
        CHECK(std::abs(worst) < body.allowed);
    }
}

} // namespace planet_magnitudes_test
