// SPDX-License-Identifier: Apache-2.0
#include "tools/model/psf_tools.hpp"

#include "images/writers/raw.hpp"
#include "models/kinds/psf_program.hpp"
#include "renderer/camera/psf_profile.hpp"
#include "renderer/scene/scene.hpp"
#include "tools/pictures/figure.hpp"
#include "tools/pictures/plot.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::string_view new_psf = R"(// {0}: a point spread function in SuMoL.
//
//   obscura model check {0}.psf            is it sound?
//   obscura model plot {0}.psf -o {0}.svg  cuts and encircled energy
//
// In a scene file, beside it:
//   [camera]
//   psf = {{ model = "{0}.psf", sigma = 0.9 }}

// A parameter is a key of the scene. Its comment gives unit, range and meaning.
parameter sigma 0.7;   //! px, 0.2..20, Standard deviation of the core
parameter halo 0.05;   //! , 0..0.5, Share of the light in the halo
parameter width 4;     //! px, 1..50, Standard deviation of the halo

// Functions stand before their use. All numbers are real: 1 / 2 is 0.5.
scalar gaussian(scalar radius2, scalar s)
{{
    return exp(-radius2 / (2 * s * s)) / (2 * M_PI * s * s);
}}

// Light of a point per square of the pixel pitch, 1 in all.
//   p           place from the point, in pitches of the columns: x to the right, y down
//   wavelength  of the light, m
// More arguments, if you want them: vec2 field, the point from the centre of the sensor, px; scalar pitch, of the
// columns, m; scalar f_number, focal length over aperture.
scalar density(vec2 p, scalar wavelength)
{{
    scalar radius2 = (p | p);
    return (1 - halo) * gaussian(radius2, sigma) + halo * gaussian(radius2, width);
}}
)";

constexpr double nm = 1e-9;

models::PsfProgram program_of(const models::ModelValues& p) {
    return {p.loaded->model, models::program_parameters(p)};
}

ModelCost psf_cost(const models::ModelValues& p) {
    const models::PsfProgram psf = program_of(p);
    ModelCost cost = cost_of(psf.program(), psf.why_interpreted());
    const auto fact = [&](std::string label, std::string name, bool depends, std::string_view otherwise) {
        cost.facts.push_back(
            {std::move(label), depends ? "depends on it" : std::string(otherwise), std::move(name), depends});
    };
    fact("wavelength", "depends_on_wavelength", psf.depends_on_wavelength(), "the same for all");
    fact("field", "depends_on_field", psf.depends_on_field(), "the same over the sensor");
    return cost;
}

ModelVerdict psf_check(const models::ModelValues& p) {
    const models::PsfProgram psf = program_of(p);
    const scene::PointSpread defaults;
    const models::PsfReport report = models::report_on(psf, {}, defaults.core_px, defaults.wings_px);
    return {psf.at(), models::refusal_by(report, defaults.core_px),
            models::warnings_by(report, defaults.core_px, defaults.wings_px),
            fmt::format("{} operations a sample, {:.4g} of the light within {:g} px", psf.program().cost(),
                        report.core_light, defaults.core_px)};
}

models::PsfConditions conditions_at(const ModelPoint& at) {
    return {at.at("wavelength") * nm, at.at("field_x"), at.at("field_y"), at.at("pitch") * 1e-6,
            at.at("f_number")};
}

double density_at(const models::PsfProgram& psf, const models::PsfConditions& conditions, double x,
                  double y) {
    double value = 0;
    psf.density(conditions, {&x, 1}, {&y, 1}, {&value, 1});
    return value;
}

ModelFacts psf_eval(const models::ModelValues& p, const ModelPoint& at) {
    const double value = density_at(program_of(p), conditions_at(at), at.at("x"), at.at("y"));
    return {{"density", fmt::format("{:.12g} 1/px2", value), "density_per_px2", value}};
}

/// Values on a square grid, row by row.
struct Grid {
    std::vector<double> x, y, values;
};
Grid grid_of_density(const models::PsfProgram& psf, const models::PsfConditions& conditions, double reach_px,
                     int side) {
    Grid grid;
    for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i) {
            grid.x.push_back(reach_px * (2.0 * i / (side - 1) - 1));
            grid.y.push_back(reach_px * (2.0 * j / (side - 1) - 1));
        }
    grid.values.resize(grid.x.size());
    psf.density(conditions, grid.x, grid.y, grid.values);
    return grid;
}

constexpr double plot_reach_px = 8;

Canvas density_picture(const models::PsfProgram& psf) {
    constexpr int side = 161;
    ColourScale scale;
    scale.map = ColourMap::viridis;
    scale.low = -5;
    scale.high = 0;
    scale.label = "log of peak";
    std::vector<Panel> panels;
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {700.0, 0.0}, {700.0, 700.0}}) {
        if (!panels.empty() && !psf.depends_on_field()) break;
        models::PsfConditions conditions;
        conditions.field_x_px = x;
        conditions.field_y_px = y;
        const Grid grid = grid_of_density(psf, conditions, plot_reach_px, side);
        const double peak = *std::max_element(grid.values.begin(), grid.values.end());
        Panel panel;
        panel.title = psf.depends_on_field() ? fmt::format("at {:g}, {:g} px", x, y)
                                             : fmt::format("{:g} px to each side", plot_reach_px);
        panel.width = panel.height = side;
        for (const double value : grid.values)
            panel.pixels.push_back(scale.colour_of(std::max(scale.low, std::log10(value / peak))));
        panels.push_back(std::move(panel));
    }
    panels.back().scale = scale;
    return draw_panels(panels);
}

/// Light within a radius, of rings of 64 points.
PlotSeries encircled_energy(const models::PsfProgram& psf) {
    constexpr std::size_t points = 64;
    constexpr int rings = 1600;
    std::array<double, points> x{}, y{}, value{};
    PlotSeries series;
    series.drawn = Drawn::line;
    double light = 0;
    const double step = 16.0 / rings;
    for (int k = 0; k < rings; ++k) {
        const double r = (k + 0.5) * step;
        for (std::size_t i = 0; i < points; ++i) {
            const double angle = 2 * std::numbers::pi * static_cast<double>(i) / points;
            x[i] = r * std::cos(angle);
            y[i] = r * std::sin(angle);
        }
        psf.density({}, x, y, value);
        for (const double v : value)
            light += v * 2 * std::numbers::pi * r * step / points;
        if (k % 10 == 9) series.points.emplace_back((k + 1) * step, light);
    }
    return series;
}

std::string density_svg(const models::PsfProgram& psf, std::string_view title) {
    Plot cuts;
    cuts.title = fmt::format("{}: cuts through the point", title);
    cuts.x_label = "distance, px";
    cuts.y_label = "light per px2";
    cuts.log_y = true;
    for (const bool down : {false, true}) {
        PlotSeries series;
        series.name = down ? "down" : "to the right";
        series.drawn = down ? Drawn::dashed : Drawn::line;
        for (int i = -200; i <= 200; ++i) {
            const double at = plot_reach_px * i / 200;
            series.points.emplace_back(at, density_at(psf, {}, down ? 0 : at, down ? at : 0));
        }
        cuts.series.push_back(std::move(series));
    }
    Plot energy;
    energy.title = fmt::format("{}: encircled energy", title);
    energy.x_label = "radius, px";
    energy.y_label = "light within";
    energy.series.push_back(encircled_energy(psf));
    return svg(std::vector{std::move(cuts), std::move(energy)});
}

std::string density_csv(const models::PsfProgram& psf) {
    const Grid grid = grid_of_density(psf, {}, plot_reach_px, 65);
    std::string text = "x_px,y_px,density_per_px2\n";
    for (std::size_t i = 0; i < grid.values.size(); ++i)
        fmt::format_to(std::back_inserter(text), "{},{},{:.17g}\n", grid.x[i], grid.y[i], grid.values[i]);
    return text;
}

void psf_plot(const models::ModelValues& p, std::string_view title, const std::filesystem::path& file) {
    const models::PsfProgram psf = program_of(p);
    if (file.extension() == ".png")
        density_picture(psf).write(file);
    else
        images::write_text(file, file.extension() == ".svg" ? density_svg(psf, title) : density_csv(psf));
}

ModelFacts psf_bench(const models::ModelValues& p) {
    const models::PsfProgram psf = program_of(p);
    constexpr std::size_t samples = 4096;
    std::vector<double> x(samples), y(samples), values(samples);
    for (std::size_t i = 0; i < samples; ++i) {
        x[i] = 8 * std::cos(static_cast<double>(i));
        y[i] = 8 * std::sin(1.7 * static_cast<double>(i));
    }
    const auto fact = [](std::string label, std::string name, double ns) {
        return ModelFact{std::move(label), fmt::format("{:8.2f}", ns), std::move(name), ns};
    };
    const double own = nanoseconds_a_sample(samples, [&] { psf.density({}, x, y, values); });
    const models::PsfConditions conditions;
    const renderer::Aperture aperture{conditions.f_number, 0, conditions.pitch_m};
    const double airy = nanoseconds_a_sample(samples, [&] {
        for (std::size_t i = 0; i < samples; ++i)
            values[i] = renderer::airy_psf(aperture, conditions.wavelength_m, std::hypot(x[i], y[i]));
    });
    return {fact("", "model_ns", own), fact("built-in airy", "airy", airy)};
}

} // namespace

const KindTools& psf_tools() {
    constexpr double far = 1e4;
    static const KindTools tools{
        "psf",
        new_psf,
        psf_cost,
        psf_check,
        {{"x", "px", "From the point to the right", 0, -far, far},
         {"y", "px", "From the point down", 0, -far, far},
         {"wavelength", "nm", "Of the light", 550, 10, 1e6},
         {"field_x", "px", "Of the point, from the centre of the sensor to the right", 0, -1e5, 1e5},
         {"field_y", "px", "Of the point, from the centre of the sensor down", 0, -1e5, 1e5},
         {"pitch", "um", "Of the columns", 10, 0.1, 1000},
         {"f_number", "", "Focal length over aperture", 4, 0.1, 1e4}},
        psf_eval,
        {{".png",
          "light per px2 in logarithms, within 8 px of points in the middle and, if it depends on the field, off it"},
         {".svg", "cuts along rows and columns, and encircled energy"},
         {".csv", "a table of 65 x 65 points within 8 px"}},
        psf_plot,
        psf_bench};
    return tools;
}

} // namespace obscura::tools
