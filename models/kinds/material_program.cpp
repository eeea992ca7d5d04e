// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/material_program.hpp"

#include "core/error.hpp"
#include "core/philox.hpp"
#include "models/lowering/lowering.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace obscura::models {
namespace {

/// Inputs of the program. Varied parameters follow.
enum MaterialInput : std::int32_t {
    input_cos_in,
    input_cos_out,
    input_cos_phase,
    input_t,
    input_duration,
    input_u,
    input_v,
    input_w,
    input_lod_bias,
    input_varied,
};

Value vector_value(std::initializer_list<NodeId> nodes) {
    Value value{vector_of(static_cast<int>(nodes.size())), {}};
    value.nodes.fill(-1);
    std::copy(nodes.begin(), nodes.end(), value.nodes.begin());
    return value;
}

/// Directions of light, camera and normal in the local frame of the surface, by the three cosines.
struct Directions {
    Value light, camera, normal;
    NodeId cos_in = -1, cos_out = -1, cos_phase = -1;
};

Directions directions(Graph& g) {
    const NodeId zero = g.constant(0), one = g.constant(1);
    const NodeId mu0 = g.input(input_cos_in), mu = g.input(input_cos_out), phase = g.input(input_cos_phase);
    const auto apply = [&](Operation op, NodeId a, NodeId b = -1, NodeId c = -1) {
        return g.apply(op, a, b, c);
    };
    const auto sine_of = [&](NodeId cosine) {
        const NodeId rest = apply(Operation::subtract, one, apply(Operation::multiply, cosine, cosine));
        return apply(Operation::square_root, apply(Operation::maximum, rest, zero));
    };
    const NodeId sin_out = sine_of(mu), sin_in = sine_of(mu0);
    // i.x sin_out = cos_phase - mu0 mu, limited to what can be; towards x where the camera is at the zenith.
    const NodeId product = apply(Operation::subtract, phase, apply(Operation::multiply, mu0, mu));
    const NodeId free =
        apply(Operation::divide, product, apply(Operation::maximum, sin_out, g.constant(1e-12)));
    const NodeId limited =
        apply(Operation::maximum, apply(Operation::minimum, free, sin_in), apply(Operation::negate, sin_in));
    const NodeId at_zenith = apply(Operation::less, sin_out, g.constant(1e-9));
    const NodeId x = apply(Operation::select, at_zenith, sin_in, limited);
    const NodeId y2 = apply(Operation::subtract, apply(Operation::multiply, sin_in, sin_in),
                            apply(Operation::multiply, x, x));
    const NodeId y = apply(Operation::square_root, apply(Operation::maximum, y2, zero));
    return {vector_value({x, y, mu0}),
            vector_value({sin_out, zero, mu}),
            vector_value({zero, zero, one}),
            mu0,
            mu,
            phase};
}

bool same_nodes(const Value& a, const Value& b) {
    return a.type == b.type &&
           std::equal(a.nodes.begin(), a.nodes.begin() + components(a.type), b.nodes.begin());
}

/// What is known of the directions: their dot products and lengths. Refers to `d` and `graph`.
Surroundings surroundings_of(const Directions& d, Graph& graph) {
    Surroundings surroundings;
    surroundings.dot = [&](const Value& a, const Value& b) -> std::optional<NodeId> {
        const auto between = [&](const Value& x, const Value& y) {
            return (same_nodes(a, x) && same_nodes(b, y)) || (same_nodes(a, y) && same_nodes(b, x));
        };
        if (between(d.light, d.normal)) return d.cos_in;
        if (between(d.camera, d.normal)) return d.cos_out;
        if (between(d.light, d.camera)) return d.cos_phase;
        for (const Value* v : {&d.light, &d.camera, &d.normal})
            if (between(*v, *v)) return graph.constant(1);
        return {};
    };
    surroundings.is_unit = [&](const Value& v) {
        return same_nodes(v, d.light) || same_nodes(v, d.camera) || same_nodes(v, d.normal);
    };
    return surroundings;
}

constexpr std::size_t numbers_per_parameter = 4;

std::int32_t uniform_index(std::size_t parameter, std::size_t component) {
    return static_cast<std::int32_t>(parameter * numbers_per_parameter + component);
}

[[noreturn]] void refuse(const Model& model, Place at, std::string_view what) {
    throw ConfigError(fmt::format("{}:{}:{}: {}", model.name(), at.line, at.column, what));
}

/// Nodes of all parameters: inputs for those that vary, one uniform for components that are all the same.
std::vector<NamedValue> parameter_values(const Model& model, const MaterialParameters& parameters,
                                         Graph& graph) {
    std::vector<NamedValue> names;
    for (std::size_t i = 0; i < model.parameters().size(); ++i) {
        const Parameter& p = model.parameters()[i];
        Value value{p.type, {}};
        value.nodes.fill(-1);
        const auto varied = std::find(parameters.varied.begin(), parameters.varied.end(), i);
        if (p.type == Type::texture) {
            value.nodes[0] = static_cast<NodeId>(i);
        } else if (varied != parameters.varied.end()) {
            const auto k = static_cast<std::int32_t>(varied - parameters.varied.begin());
            std::fill_n(value.nodes.begin(), components(p.type), graph.input(input_varied + k));
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

MaterialParameters default_parameters(const Model& model) {
    MaterialParameters parameters;
    for (std::size_t i = 0; i < model.parameters().size(); ++i) {
        const Parameter& p = model.parameters()[i];
        std::array<double, 4> values = p.value;
        for (double& value : values)
            value = p.type == Type::texture ? 1 : value * p.si();
        parameters.values.push_back(values);
    }
    return parameters;
}

MaterialProgram::MaterialProgram(std::shared_ptr<const Model> model, const MaterialParameters& parameters)
    : model_(std::move(model)), varied_(parameters.varied.size()) {
    if (varied_ > max_varied)
        throw ConfigError(fmt::format("{}: {} parameters vary over the surface: allowed are {}",
                                      model_->name(), varied_, max_varied));
    compile(parameters);
    const auto inputs = static_cast<std::int32_t>(input_varied + varied_);
    program_->make_native(parameters.target, uniforms_of(parameters, 1), inputs, why_interpreted_);
    uniforms_ = program_->bind(uniforms_of(parameters, 1));
    find_proportion(parameters);
}

std::vector<double> MaterialProgram::uniforms_of(const MaterialParameters& parameters, double diffuse) const {
    std::vector<double> uniforms;
    for (const auto& values : parameters.values)
        uniforms.insert(uniforms.end(), values.begin(), values.end());
    uniforms.push_back(diffuse);
    uniforms.push_back(1); // specular
    uniforms.push_back(parameters.shininess);
    return uniforms;
}

void MaterialProgram::refuse_inputs(Place at) const {
    for (const auto& [input, name] : {std::pair{input_t, "t"}, {input_duration, "duration"}})
        if (program_->uses_input(input))
            refuse(*model_, at,
                   fmt::format("brdf() depends on '{}': laws that change with time are not rendered", name));
    for (const auto& [input, name] :
         {std::pair{input_u, "uv.x"}, {input_v, "uv.y"}, {input_w, "uv.z"}, {input_lod_bias, "lod_bias"}})
        if (program_->uses_input(input))
            refuse(*model_, at,
                   fmt::format("brdf() depends on '{}' itself: allowed is lookup3DLOD(NAME, uv, lod_bias)",
                               name));
}

void MaterialProgram::compile(const MaterialParameters& parameters) {
    Graph graph;
    Findings findings;
    const Function& brdf = *model_->function("brdf");
    const Directions d = directions(graph);
    const auto after = static_cast<std::int32_t>(model_->parameters().size() * numbers_per_parameter);
    const auto grey = [&](std::int32_t index) {
        const NodeId n = graph.uniform(index);
        return vector_value({n, n, n, n});
    };
    const auto scalar = [&](NodeId node) { return Value{Type::scalar, {node, -1, -1, -1}}; };
    const Value uv = vector_value({graph.input(input_u), graph.input(input_v), graph.input(input_w)});
    const Value lod_bias = scalar(graph.input(input_lod_bias));
    std::vector<Value> arguments{d.light,
                                 d.camera,
                                 d.normal,
                                 grey(after),
                                 grey(after + 1),
                                 scalar(graph.uniform(after + 2)),
                                 scalar(graph.input(input_t)),
                                 scalar(graph.input(input_duration)),
                                 uv,
                                 lod_bias};
    arguments.resize(brdf.arguments.size());

    Surroundings surroundings = surroundings_of(d, graph);
    surroundings.look_up = [&](std::string_view name, const std::vector<Value>& given,
                               std::string& why) -> std::optional<Value> {
        if (name != "lookup3DLOD" || given.size() != 3) return {};
        if (!same_nodes(given[1], uv) || !same_nodes(given[2], lod_bias)) {
            why =
                "a material reads its textures only at the point that is hit: lookup3DLOD(NAME, uv, lod_bias) with "
                "the uv and lod_bias of brdf()";
            return {};
        }
        const auto parameter = static_cast<std::size_t>(given[0].nodes[0]);
        const auto at = std::find(parameters.varied.begin(), parameters.varied.end(), parameter);
        const NodeId n =
            at == parameters.varied.end()
                ? graph.uniform(uniform_index(parameter, 0))
                : graph.input(input_varied + static_cast<std::int32_t>(at - parameters.varied.begin()));
        return vector_value({n, n, n, n});
    };
    Lowering lowering(model_->tree(), graph, findings, parameter_values(*model_, parameters, graph),
                      surroundings);
    const auto result = lowering.result_of_call(brdf, std::move(arguments));
    if (findings.has_errors() || !result) throw ConfigError(findings.text(model_->name(), true));
    const auto& nodes = result->nodes;
    if (std::any_of(nodes.begin() + 1, nodes.end(), [&](NodeId n) { return n != nodes[0]; }))
        refuse(*model_, brdf.at,
               "brdf() differs between its four channels: give each vec4 parameter one value for all "
               "channels, and colours by the keys of the body");
    try {
        program_ = std::make_unique<Program>(graph, std::span(nodes).first(1));
    } catch (const std::length_error& error) {
        refuse(*model_, brdf.at, error.what());
    }
    refuse_inputs(brdf.at);
}

void MaterialProgram::find_proportion(const MaterialParameters& parameters) {
    constexpr std::size_t lanes = 256;
    std::array<std::array<double, lanes>, 4> rows{};
    std::vector<std::array<double, lanes>> varied(varied_);
    const auto uniform = [](std::uint32_t i, std::uint32_t k) {
        return uniform_double(philox4x32({i, k, 0, 0}, philox_key(1))[0]);
    };
    for (std::uint32_t i = 0; i < lanes; ++i) {
        rows[0][i] = uniform(i, 0);
        rows[1][i] = 1e-3 + 0.999 * uniform(i, 1);
        const double sines = std::sqrt((1 - rows[0][i] * rows[0][i]) * (1 - rows[1][i] * rows[1][i]));
        rows[2][i] = rows[0][i] * rows[1][i] + sines * std::cos(std::numbers::pi * uniform(i, 2));
        for (std::size_t k = 0; k < varied_; ++k)
            varied[k][i] = uniform(i, static_cast<std::uint32_t>(3 + k));
    }
    std::vector<const double*> inputs(input_varied + varied_, rows[3].data());
    for (std::size_t k = 0; k < 3; ++k)
        inputs[k] = rows[k].data();
    for (std::size_t k = 0; k < varied_; ++k)
        inputs[input_varied + k] = varied[k].data();
    std::array<double, lanes> full{}, half{};
    double* out = full.data();
    program_->run(uniforms_, inputs.data(), &out, lanes);
    out = half.data();
    program_->run(program_->bind(uniforms_of(parameters, 0.5)), inputs.data(), &out, lanes);
    proportional_ = true;
    for (std::size_t i = 0; i < lanes; ++i)
        if (std::isfinite(full[i]) && std::abs(half[i] - 0.5 * full[i]) > 1e-12 * std::abs(full[i]))
            proportional_ = false;
}

void MaterialProgram::evaluate(const double* cos_in, const double* cos_out, const double* cos_phase,
                               const double* const* varied, double* r, std::size_t lanes) const noexcept {
    std::array<const double*, input_varied + max_varied> inputs{};
    inputs[input_cos_in] = cos_in;
    inputs[input_cos_out] = cos_out;
    inputs[input_cos_phase] = cos_phase;
    std::copy_n(varied, varied_, inputs.begin() + input_varied);
    program_->run(uniforms_, inputs.data(), &r, lanes);
}

} // namespace obscura::models
