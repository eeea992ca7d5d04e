// SPDX-License-Identifier: Apache-2.0
#include "tools/model/motion_tools.hpp"

#include "images/writers/raw.hpp"
#include "models/kinds/motion_program.hpp"
#include "tools/pictures/plot.hpp"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::string_view new_motion = R"(// {0}: a small motion of the camera in SuMoL.
//
//   obscura model check {0}.mot            is it sound?
//   obscura model plot {0}.mot -o {0}.svg  how does it turn?
//
// In a scene file, beside it:
//   [camera]
//   vibration = {{ model = "{0}.mot", amplitude_urad = 20 }}

// A parameter is a key of the scene. Its comment gives unit, range and meaning.
parameter amplitude_urad 10;  //! urad, 0..10000, Largest rotation about the axis x
parameter rate_hz 25;         //! Hz, 0.001..10000, Cycles in a second

// Rotation of the camera from its attitude, axis times angle in rad, in the camera's frame: x to the right, y down,
// z along the boresight. t is the time of the scene, s. A second function vec3 offset(scalar t), in m, may move it.
vec3 rotation(scalar t)
{{
    return vec3(sin(2 * M_PI * rate_hz * t), 0, 0) * (amplitude_urad * 1e-6);
}}
)";

constexpr double micro = 1e-6;
constexpr std::array<std::string_view, 3> axes{"x", "y", "z"};

models::MotionProgram motion_program(const models::ModelValues& p) {
    return {p.loaded->model, models::program_parameters(p)};
}
std::array<double, 3> numbers(Vec3 v) {
    return {v.x / micro, v.y / micro, v.z / micro};
}

ModelCost motion_cost(const models::ModelValues& p) {
    const models::MotionProgram motion = motion_program(p);
    ModelCost cost = cost_of(motion.program(), motion.why_interpreted());
    cost.facts = {{"rotation", fmt::format("up to {:.4g} urad", motion.max_rotation_rad() / micro),
                   "max_rotation_rad", motion.max_rotation_rad()},
                  {"offset", fmt::format("up to {:.4g} um", motion.max_offset_m() / micro), "max_offset_m",
                   motion.max_offset_m()}};
    return cost;
}

ModelVerdict motion_check(const models::ModelValues& p) {
    const models::MotionProgram motion = motion_program(p);
    return {motion.place(),
            "",
            {},
            fmt::format(
                "{} operations an instant, turns by up to {:.4g} urad, moves by up to {:.4g} um in 1000 s",
                motion.program().cost(), motion.max_rotation_rad() / micro, motion.max_offset_m() / micro)};
}

ModelFacts motion_eval(const models::ModelValues& p, const ModelPoint& at) {
    const models::SmallMotion motion = motion_program(p).at(at.at("t"));
    ModelFacts facts;
    for (std::size_t k = 0; k < axes.size(); ++k) {
        const double rotation = numbers(motion.rotation_rad)[k], offset = numbers(motion.offset_m)[k];
        facts.push_back({fmt::format("rotation {}", axes[k]), fmt::format("{:.12g} urad", rotation),
                         fmt::format("rotation_{}_urad", axes[k]), rotation});
        facts.push_back({fmt::format("offset {}", axes[k]), fmt::format("{:.12g} um", offset),
                         fmt::format("offset_{}_um", axes[k]), offset});
    }
    return facts;
}

void motion_plot(const models::ModelValues& p, std::string_view title, const std::filesystem::path& file) {
    const models::MotionProgram motion = motion_program(p);
    constexpr int instants = 2000;
    constexpr double step_s = 1e-3 / 4;
    std::string text =
        "time_s,rotation_x_urad,rotation_y_urad,rotation_z_urad,offset_x_um,offset_y_um,offset_z_um\n";
    std::array<PlotSeries, 3> turns, moves;
    for (int i = 0; i <= instants; ++i) {
        const double t = i * step_s;
        const models::SmallMotion m = motion.at(t);
        const auto rotation = numbers(m.rotation_rad), offset = numbers(m.offset_m);
        fmt::format_to(std::back_inserter(text), "{:.6g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n",
                       t, rotation[0], rotation[1], rotation[2], offset[0], offset[1], offset[2]);
        for (std::size_t k = 0; k < axes.size(); ++k) {
            turns[k].points.emplace_back(t, rotation[k]);
            moves[k].points.emplace_back(t, offset[k]);
        }
    }
    if (file.extension() == ".csv") {
        images::write_text(file, text);
        return;
    }
    std::vector<Plot> plots;
    for (const auto& [series, quantity] : {std::pair{&turns, "rotation, urad"}, {&moves, "offset, um"}}) {
        if (series == &moves && motion.max_offset_m() == 0) continue;
        Plot plot;
        plot.title = std::string(title);
        plot.x_label = "time, s";
        plot.y_label = quantity;
        for (std::size_t k = 0; k < axes.size(); ++k) {
            (*series)[k].name = axes[k];
            (*series)[k].drawn = Drawn::line;
            plot.series.push_back(std::move((*series)[k]));
        }
        plots.push_back(std::move(plot));
    }
    images::write_text(file, svg(plots));
}

} // namespace

const KindTools& motion_tools() {
    static const KindTools tools{"motion",
                                 new_motion,
                                 motion_cost,
                                 motion_check,
                                 {{"t", "s", "Time of the scene", 0, -1e9, 1e9}},
                                 motion_eval,
                                 {{".svg", "rotation and offset over half a second"},
                                  {".csv", "a table of them, four instants in a millisecond"}},
                                 motion_plot,
                                 nullptr};
    return tools;
}

} // namespace obscura::tools
