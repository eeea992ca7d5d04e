// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/psf_program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace obscura::models {
namespace {

enum PsfInput : std::int32_t { psf_x, psf_y, psf_inputs };
/// Uniforms behind those of the parameters.
enum PsfUniform : std::int32_t { psf_wavelength, psf_field_x, psf_field_y, psf_pitch, psf_f_number };

} // namespace

PsfProgram::PsfProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters)
    : model_(std::move(model)), parameters_(parameters) {
    Graph graph;
    const std::int32_t own = first_own_uniform(*model_);
    const Function& density = *model_->function("density");
    const Value light = lowered(
        *model_, density, parameters_, psf_inputs, graph,
        {vector_value({graph.input(psf_x), graph.input(psf_y)}),
         scalar_value(graph.uniform(own + psf_wavelength)),
         vector_value({graph.uniform(own + psf_field_x), graph.uniform(own + psf_field_y)}),
         scalar_value(graph.uniform(own + psf_pitch)), scalar_value(graph.uniform(own + psf_f_number))});
    const std::span<const NodeId> output = std::span(light.nodes).first(1);
    const auto depends_on = [&](PsfUniform uniform) {
        return graph.depends_on(output, Operation::uniform, own + uniform);
    };
    depends_on_wavelength_ = depends_on(psf_wavelength);
    depends_on_field_ = depends_on(psf_field_x) || depends_on(psf_field_y);
    bound_ =
        bound_program(*model_, density.at, graph, output, uniforms_of({}), psf_inputs, parameters.target);
}

Place PsfProgram::at() const noexcept {
    return model_->function("density")->at;
}

std::vector<double> PsfProgram::uniforms_of(const PsfConditions& c) const {
    return uniform_values(parameters_, {c.wavelength_m, c.field_x_px, c.field_y_px, c.pitch_m, c.f_number});
}

void PsfProgram::density(const PsfConditions& conditions, std::span<const double> x,
                         std::span<const double> y, std::span<double> values) const {
    const Uniforms uniforms = bound_.program->bind(uniforms_of(conditions));
    constexpr std::size_t block = 256;
    static_assert(block % Program::lane_step == 0);
    std::array<std::array<double, block>, 3> rows{};
    for (std::size_t first = 0; first < values.size(); first += block) {
        const std::size_t lanes = std::min(block, values.size() - first);
        std::copy_n(x.begin() + static_cast<std::ptrdiff_t>(first), lanes, rows[psf_x].begin());
        std::copy_n(y.begin() + static_cast<std::ptrdiff_t>(first), lanes, rows[psf_y].begin());
        const std::array<const double*, psf_inputs> in{rows[psf_x].data(), rows[psf_y].data()};
        double* out = rows[psf_inputs].data();
        const std::size_t whole = (lanes + Program::lane_step - 1) / Program::lane_step * Program::lane_step;
        bound_.program->run(uniforms, in.data(), &out, whole);
        std::copy_n(rows[psf_inputs].begin(), lanes, values.begin() + static_cast<std::ptrdiff_t>(first));
    }
}

PsfReport report_on(const PsfProgram& psf, const PsfConditions& conditions, double core_px, double wings_px) {
    constexpr std::size_t rings = 2048, points = 64;
    const double radius_px = std::max(core_px, wings_px);
    PsfReport report;
    std::array<double, points> x{}, y{}, value{};
    double moment_x = 0, moment_y = 0;
    for (std::size_t k = 0; k < rings; ++k) {
        // r = R t^4: narrow functions and wide wings both have many rings.
        const double t = (static_cast<double>(k) + 0.5) / rings;
        const double r = radius_px * t * t * t * t;
        const double area = 2 * std::numbers::pi * r * 4 * radius_px * t * t * t / rings / points;
        for (std::size_t i = 0; i < points; ++i) {
            const double angle = 2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / points;
            x[i] = r * std::cos(angle);
            y[i] = r * std::sin(angle);
        }
        psf.density(conditions, x, y, value);
        for (std::size_t i = 0; i < points; ++i) {
            const bool worse = report.finite && (!std::isfinite(value[i]) || value[i] < report.least);
            if (worse) {
                report.finite = std::isfinite(value[i]);
                report.least = std::isfinite(value[i]) ? value[i] : report.least;
                report.bad_x_px = x[i];
                report.bad_y_px = y[i];
            }
            const double light = value[i] * area;
            if (r < core_px) report.core_light += light;
            report.light += light;
            moment_x += light * x[i];
            moment_y += light * y[i];
        }
    }
    report.centroid_x_px = moment_x / report.light;
    report.centroid_y_px = moment_y / report.light;
    return report;
}

std::string refusal_by(const PsfReport& report, double core_px) {
    const auto at = [&] { return fmt::format("at ({:.3g}, {:.3g}) px", report.bad_x_px, report.bad_y_px); };
    if (!report.finite) return fmt::format("density() is not finite {}", at());
    if (report.least < 0)
        return fmt::format("density() is negative {}: {:.3g} of light per px2", at(), report.least);
    if (!(report.core_light >= 0.5))
        return fmt::format(
            "only {:.3g} of the light is within the core of {:g} px: allowed is half of it and more",
            report.core_light, core_px);
    return "";
}

std::vector<std::string> warnings_by(const PsfReport& report, double core_px, double wings_px) {
    std::vector<std::string> lines;
    if (!(std::abs(report.light - 1) <= 1e-3))
        lines.push_back(
            wings_px > core_px
                ? fmt::format("the integral of density() within {:g} px is {:.4g}, not 1", wings_px,
                              report.light)
                : fmt::format(
                      "the integral of density() within {:g} px is {:.4g}, not 1: all light is put into "
                      "this core; psf_wings_px adds wings beyond",
                      core_px, report.light));
    const double off = std::hypot(report.centroid_x_px, report.centroid_y_px);
    if (off > 0.01)
        lines.push_back(
            fmt::format("the centroid of the light is {:.3g} px away from the point, at ({:.3g}, {:.3g}) px",
                        off, report.centroid_x_px, report.centroid_y_px));
    return lines;
}

} // namespace obscura::models
