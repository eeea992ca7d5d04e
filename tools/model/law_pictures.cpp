// SPDX-License-Identifier: Apache-2.0
#include "tools/model/law_pictures.hpp"

#include "core/geometry.hpp"
#include "core/units.hpp"
#include "tools/model/law_angles.hpp"
#include "tools/pictures/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

namespace obscura::tools {
namespace {

constexpr std::int32_t sphere_size = 200;

Panel sphere(const renderer::Material& law, double phase_deg, double largest) {
    Panel panel;
    panel.title = fmt::format("phase {:.0f} deg", phase_deg);
    panel.width = panel.height = sphere_size;
    // Normals of a sphere that is seen along -z and lit from the phase angle towards +x.
    const double phase = phase_deg * degree;
    const Vec3 light{std::sin(phase), 0, std::cos(phase)};
    std::vector<LawCosines> points;
    for (std::int32_t y = 0; y < sphere_size; ++y)
        for (std::int32_t x = 0; x < sphere_size; ++x) {
            const double u = (x + 0.5) / sphere_size * 2.1 - 1.05, v = (y + 0.5) / sphere_size * 2.1 - 1.05;
            const double z2 = 1 - u * u - v * v;
            const double z = z2 > 0 ? std::sqrt(z2) : 0;
            points.push_back({z > 0 ? dot({u, v, z}, light) : -1, std::max(z, 1e-6), light.z});
        }
    ColourScale scale;
    scale.high = largest;
    scale.label = "I/F";
    for (const double r : law_values(law, points))
        panel.pixels.push_back(scale.colour_of(std::numbers::pi * r));
    panel.scale = scale;
    return panel;
}

} // namespace

double sphere_brightness(const renderer::Material& law, double phase_deg) {
    // Luminance longitude between terminator and limb, and latitude: midpoints of 200 x 100 cells.
    const double phase = phase_deg * degree;
    constexpr int across = 200, along = 100;
    std::vector<LawCosines> points;
    std::vector<double> weights;
    for (int i = 0; i < across; ++i)
        for (int k = 0; k < along; ++k) {
            const double longitude =
                phase - std::numbers::pi / 2 + (std::numbers::pi - phase) * (i + 0.5) / across;
            const double latitude = std::numbers::pi / 2 * (k + 0.5) / along;
            const double c = std::cos(latitude);
            points.push_back({c * std::cos(longitude - phase), c * std::cos(longitude), std::cos(phase)});
            // Twice, for both hemispheres; solid angle of the cell times the cosine of emission.
            weights.push_back(2 * (std::numbers::pi - phase) / across * (std::numbers::pi / 2 / along) * c *
                              points.back().out);
        }
    const std::vector<double> r = law_values(law, points);
    double sum = 0;
    for (std::size_t i = 0; i < r.size(); ++i)
        sum += std::numbers::pi * r[i] * weights[i];
    return sum;
}

std::string law_svg(const renderer::Material& law, std::string_view title) {
    Plot lobes;
    lobes.title = fmt::format("{}: plane of incidence", title);
    lobes.x_label = "emission, deg (negative: on the side of the light)";
    lobes.y_label = "BRDF x cos i, 1/sr";
    for (const double incidence : {0.0, 30.0, 60.0}) {
        PlotSeries series;
        series.name = fmt::format("incidence {:.0f} deg", incidence);
        series.drawn = Drawn::line;
        std::vector<LawCosines> directions;
        for (int e = -89; e <= 89; ++e)
            directions.push_back(
                LawAngles{incidence, std::abs(static_cast<double>(e)), e < 0 ? 0.0 : 180.0}.cosines());
        const std::vector<double> values = law_values(law, directions);
        for (std::size_t i = 0; i < values.size(); ++i)
            series.points.emplace_back(static_cast<double>(i) - 89, values[i]);
        lobes.series.push_back(std::move(series));
    }
    Plot phases;
    phases.title = fmt::format("{}: a sphere", title);
    phases.x_label = "phase angle, deg";
    phases.y_label = "magnitudes below full phase";
    PlotSeries curve;
    curve.drawn = Drawn::line;
    const double full = sphere_brightness(law, 0);
    for (int g = 0; g <= 150; g += 2)
        curve.points.emplace_back(g, 2.5 * std::log10(full / sphere_brightness(law, g)));
    phases.series.push_back(std::move(curve));

    return svg(std::vector{std::move(lobes), std::move(phases)});
}

Canvas law_spheres(const renderer::Material& law) {
    constexpr std::array<double, 4> phases_deg{5, 30, 60, 100};
    // Full scale is the brightest of what a sphere shows at small phase angles, without limbs that shine.
    const std::vector<double> r =
        law_values(law, {LawAngles{5, 0, 0}.cosines(), LawAngles{45, 40, 0}.cosines()});
    const double largest = std::numbers::pi * std::max(r[0], r[1]) * 1.25;
    std::vector<Panel> panels;
    for (const double phase_deg : phases_deg)
        panels.push_back(sphere(law, phase_deg, largest > 0 ? largest : 1));
    for (std::size_t i = 0; i + 1 < panels.size(); ++i)
        panels[i].scale.reset();
    return draw_panels(panels);
}

std::string law_csv(const renderer::Material& law) {
    std::vector<LawAngles> angles;
    std::vector<LawCosines> directions;
    for (int i = 0; i <= 85; i += 5)
        for (int e = 0; e <= 85; e += 5)
            for (int a = 0; a <= 180; a += 30) {
                angles.push_back({static_cast<double>(i), static_cast<double>(e), static_cast<double>(a)});
                directions.push_back(angles.back().cosines());
            }
    const std::vector<double> values = law_values(law, directions);
    std::string text = "incidence_deg,emission_deg,azimuth_deg,phase_deg,r_per_sr\n";
    for (std::size_t i = 0; i < angles.size(); ++i)
        fmt::format_to(std::back_inserter(text), "{},{},{},{:.9g},{:.17g}\n", angles[i].incidence_deg,
                       angles[i].emission_deg, angles[i].azimuth_deg, angles[i].phase_deg(), values[i]);
    return text;
}

} // namespace obscura::tools
