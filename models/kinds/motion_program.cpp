// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/motion_program.hpp"

#include "core/philox.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace obscura::models {
namespace {

/// Offset and rotation.
constexpr std::size_t motion_outputs = 6;
constexpr std::size_t path_instants = 128;
static_assert(path_instants % Program::lane_step == 0);

/// Values of each output at many times.
struct MotionRows {
    std::array<std::array<double, path_instants>, motion_outputs> values{};
    std::array<double*, motion_outputs> pointers{};
    MotionRows() noexcept {
        for (std::size_t k = 0; k < motion_outputs; ++k)
            pointers[k] = values[k].data();
    }
    [[nodiscard]] Vec3 vector(std::size_t first, std::size_t lane) const noexcept {
        return {values[first][lane], values[first + 1][lane], values[first + 2][lane]};
    }
};

Vec3 tamed(Vec3 v) noexcept {
    return is_finite(v) ? v : Vec3{};
}

} // namespace

MotionProgram::MotionProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters)
    : model_(std::move(model)) {
    Graph graph;
    const NodeId zero = graph.constant(0);
    Value offset = vector_value({zero, zero, zero});
    const std::vector<Value> arguments{scalar_value(graph.input(0))};
    if (const Function* const f = model_->function("offset"))
        offset = lowered(*model_, *f, parameters, 1, graph, arguments);
    const Function& turn = *model_->function("rotation");
    const Value rotation = lowered(*model_, turn, parameters, 1, graph, arguments);
    std::array<NodeId, motion_outputs> outputs{};
    std::copy_n(offset.nodes.begin(), 3, outputs.begin());
    std::copy_n(rotation.nodes.begin(), 3, outputs.begin() + 3);
    bound_ =
        bound_program(*model_, turn.at, graph, outputs, uniform_values(parameters), 1, parameters.target);
    constexpr double looked_at_s = 1000;
    for (std::uint32_t block = 0; block < 64; ++block) {
        std::array<double, path_instants> times{};
        for (std::uint32_t i = 0; i < path_instants; ++i)
            times[i] = looked_at_s * uniform_double(philox4x32({i, block, 0, 0}, philox_key(3))[0]);
        if (block == 0) times[0] = 0;
        MotionRows rows;
        run(times.data(), rows.pointers.data(), path_instants);
        for (std::size_t i = 0; i < path_instants; ++i) {
            const Vec3 o = rows.vector(0, i), r = rows.vector(3, i);
            if (!is_finite(o) || !is_finite(r))
                refuse(*model_, is_finite(r) ? model_->function("offset")->at : turn.at,
                       fmt::format("{}() is not finite at t = {:.6g} s", is_finite(r) ? "offset" : "rotation",
                                   times[i]));
            max_rotation_rad_ = std::max(max_rotation_rad_, length(r));
            max_offset_m_ = std::max(max_offset_m_, length(o));
        }
    }
}

void MotionProgram::run(const double* times, double* const* outputs, std::size_t lanes) const noexcept {
    bound_.program->run(bound_.uniforms, &times, outputs, lanes);
}

SmallMotion MotionProgram::at(double time_s) const noexcept {
    std::array<double, Program::lane_step> times{};
    times.fill(time_s);
    MotionRows rows;
    run(times.data(), rows.pointers.data(), times.size());
    return {tamed(rows.vector(0, 0)), tamed(rows.vector(3, 0))};
}

double MotionProgram::path_rad(double from_s, double to_s) const noexcept {
    std::array<double, path_instants> times{};
    for (std::size_t i = 0; i < path_instants; ++i)
        times[i] = from_s + (to_s - from_s) * static_cast<double>(i) / (path_instants - 1);
    MotionRows rows;
    run(times.data(), rows.pointers.data(), path_instants);
    double sum = 0;
    for (std::size_t i = 1; i < path_instants; ++i)
        sum += length(tamed(rows.vector(3, i)) - tamed(rows.vector(3, i - 1)));
    return sum;
}

} // namespace obscura::models
