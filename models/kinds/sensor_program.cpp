// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/sensor_program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace obscura::models {
namespace {

/// The number of a call of normal(), which must stand in the text; nothing: it does not, and `why` says so.
std::optional<std::int32_t> draw_number(const Graph& graph, const std::vector<Value>& arguments,
                                        std::string& why) {
    const bool constant = arguments.size() == 1 && arguments[0].type == Type::scalar &&
                          graph.is_constant(arguments[0].nodes[0]);
    const double n = constant ? graph.node(arguments[0].nodes[0]).value : -1;
    if (n >= 0 && n < SensorProgram::max_normals && n == std::floor(n)) return static_cast<std::int32_t>(n);
    why = fmt::format("normal() takes a whole number from 0 to {} that stands in the text",
                      SensorProgram::max_normals - 1);
    return {};
}

} // namespace

SensorProgram::SensorProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters,
                             double full_well_e)
    : model_(std::move(model)) {
    for (const SensorStage s : sensor_stages) {
        const Function* const function = model_->function(name_of(s));
        if (function == nullptr) continue;
        Stage& stage = stages_[static_cast<std::size_t>(s)];
        Graph graph;
        Surroundings surroundings;
        surroundings.constants = {{"full_well", scalar_value(graph.constant(full_well_e))}};
        surroundings.look_up = [&](std::string_view name, const std::vector<Value>& arguments,
                                   std::string& why) -> std::optional<Value> {
            if (name != "normal") return {};
            const auto n = draw_number(graph, arguments, why);
            if (!n) return {};
            stage.normals = std::max(stage.normals, *n + 1);
            return scalar_value(graph.input(first_normal + *n));
        };
        const Value result = lowered(
            *model_, *function, parameters, static_cast<std::int32_t>(max_inputs), graph,
            {scalar_value(graph.input(value)), scalar_value(graph.input(x)), scalar_value(graph.input(y))},
            surroundings);
        stage.bound =
            bound_program(*model_, function->at, graph, std::span(result.nodes).first(1),
                          uniform_values(parameters), first_normal + stage.normals, parameters.target);
    }
}

void SensorProgram::run(SensorStage stage, const std::array<const double*, max_inputs>& inputs,
                        double* results, std::size_t lanes) const noexcept {
    const BoundProgram& bound = of(stage).bound;
    bound.program->run(bound.uniforms, inputs.data(), &results, lanes);
}

std::string_view SensorProgram::name_of(SensorStage stage) noexcept {
    switch (stage) {
    case SensorStage::light:
        return "light";
    case SensorStage::collect:
        return "collect";
    case SensorStage::convert:
        break;
    }
    return "convert";
}

Place SensorProgram::at(SensorStage stage) const noexcept {
    if (const Function* const f = model_->function(name_of(stage))) return f->at;
    for (const SensorStage other : sensor_stages)
        if (const Function* const f = model_->function(name_of(other))) return f->at;
    return {};
}

} // namespace obscura::models
