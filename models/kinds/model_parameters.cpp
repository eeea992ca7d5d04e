// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/model_parameters.hpp"

#include "core/error.hpp"
#include "models/lowering/lowering.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace obscura::models {
namespace {

constexpr std::size_t numbers_per_parameter = 4;

/// Nodes of all parameters: inputs for those that vary, one uniform for components that are all the same.
std::vector<NamedValue> parameter_nodes(const Model& model, const ModelParameters& parameters,
                                        std::int32_t first_varied, Graph& graph,
                                        const Surroundings& surroundings) {
    std::vector<NamedValue> names;
    for (std::size_t i = 0; i < model.parameters().size(); ++i) {
        const Parameter& p = model.parameters()[i];
        if (const auto given = surroundings.parameter ? surroundings.parameter(i) : std::nullopt) {
            names.push_back({p.name, *given});
            continue;
        }
        Value value{p.type, {}};
        value.nodes.fill(-1);
        const auto varied = std::find(parameters.varied.begin(), parameters.varied.end(), i);
        if (p.type == Type::texture) {
            value.nodes[0] = static_cast<NodeId>(i);
        } else if (varied != parameters.varied.end()) {
            const auto k = static_cast<std::int32_t>(varied - parameters.varied.begin());
            std::fill_n(value.nodes.begin(), components(p.type), graph.input(first_varied + k));
        } else {
            const auto& given = parameters.values[i];
            for (int c = 0; c < components(p.type); ++c) {
                const auto k = static_cast<std::size_t>(c);
                // vec2 and vec3 are positions and directions, vec4 the channels of a colour.
                const auto first =
                    static_cast<std::size_t>(std::find(given.begin(), given.end(), given[k]) - given.begin());
                value.nodes[k] = graph.uniform(uniform_index(i, p.type == Type::vec4 ? first : k));
            }
        }
        names.push_back({p.name, value});
    }
    return names;
}

} // namespace

ModelParameters default_parameters(const Model& model) {
    ModelParameters parameters;
    for (const Parameter& p : model.parameters()) {
        std::array<double, 4> values = p.value;
        for (double& value : values)
            value = p.type == Type::texture ? 1 : value * p.si();
        parameters.values.push_back(values);
        const bool same = std::all_of(values.begin(), values.end(), [&](double v) { return v == values[0]; });
        parameters.channels.push_back(p.type == Type::vec4 && !same
                                          ? std::vector(values.begin(), values.end())
                                          : std::vector<double>());
    }
    return parameters;
}

std::int32_t uniform_index(std::size_t parameter, std::size_t component) noexcept {
    return static_cast<std::int32_t>(parameter * numbers_per_parameter + component);
}

std::int32_t first_own_uniform(const Model& model) noexcept {
    return uniform_index(model.parameters().size(), 0);
}

std::vector<double> uniform_values(const ModelParameters& parameters, std::initializer_list<double> own) {
    std::vector<double> uniforms;
    for (const auto& values : parameters.values)
        uniforms.insert(uniforms.end(), values.begin(), values.end());
    uniforms.insert(uniforms.end(), own);
    return uniforms;
}

Value scalar_value(NodeId node) {
    return {Type::scalar, {node, -1, -1, -1}};
}

Value vector_value(std::initializer_list<NodeId> nodes) {
    Value value{vector_of(static_cast<int>(nodes.size())), {}};
    value.nodes.fill(-1);
    std::copy(nodes.begin(), nodes.end(), value.nodes.begin());
    return value;
}

void refuse(const Model& model, Place at, std::string_view what) {
    throw ConfigError(fmt::format("{}:{}:{}: {}", model.name(), at.line, at.column, what));
}

Value lowered(const Model& model, const Function& function, const ModelParameters& parameters,
              std::int32_t first_varied, Graph& graph, std::vector<Value> arguments,
              const Surroundings& surroundings) {
    arguments.resize(function.arguments.size());
    Findings findings;
    std::vector<NamedValue> names = parameter_nodes(model, parameters, first_varied, graph, surroundings);
    names.insert(names.end(), surroundings.constants.begin(), surroundings.constants.end());
    Lowering lowering(model.tree(), graph, findings, std::move(names), surroundings);
    const auto result = lowering.result_of_call(function, std::move(arguments));
    if (findings.has_errors() || !result) throw ConfigError(findings.text(model.name(), true));
    return *result;
}

BoundProgram bound_program(const Model& model, Place at, const Graph& graph, std::span<const NodeId> outputs,
                           std::span<const double> uniforms, std::int32_t inputs,
                           const Execution& execution) {
    BoundProgram bound;
    try {
        bound.program = std::make_unique<Program>(graph, outputs);
    } catch (const std::length_error& error) {
        refuse(model, at, error.what());
    }
    execution.make([&] {
        bound.program->make_native(execution.target, uniforms, inputs, bound.why_interpreted);
        bound.uniforms = bound.program->bind(uniforms);
        if (execution.max_ns > 0) bound.program->measure(bound.uniforms, inputs);
    });
    if (const double ns = bound.program->measured_ns(); execution.max_ns > 0 && ns > execution.max_ns)
        refuse(model, at,
               fmt::format("an evaluation takes {:.0f} ns on this machine; allowed are {:g} "
                           "(models.max_ns_per_evaluation)",
                           ns, execution.max_ns));
    return bound;
}

} // namespace obscura::models
