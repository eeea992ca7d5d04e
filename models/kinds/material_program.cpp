// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/material_program.hpp"

#include "core/error.hpp"
#include "core/philox.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace obscura::models {
namespace {

/// Argument `specular` of brdf(): a body has no colour of its own for it.
constexpr double specular = 1;

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

} // namespace

MaterialProgram::MaterialProgram(std::shared_ptr<const Model> model, const MaterialParameters& parameters)
    : model_(std::move(model)), varied_(parameters.varied.size()) {
    if (varied_ > max_varied)
        throw ConfigError(fmt::format("{}: {} parameters vary over the surface: allowed are {}",
                                      model_->name(), varied_, max_varied));
    compile(parameters);
    find_proportion(parameters);
}

std::vector<double> MaterialProgram::uniforms_of(const MaterialParameters& parameters, double diffuse) {
    return uniform_values(parameters, {diffuse, specular, parameters.shininess});
}

void MaterialProgram::refuse_inputs(Place at) const {
    for (const auto& [input, name] : {std::pair{input_t, "t"}, {input_duration, "duration"}})
        if (bound_.program->uses_input(input))
            refuse(*model_, at,
                   fmt::format("brdf() depends on '{}': laws that change with time are not rendered", name));
    for (const auto& [input, name] :
         {std::pair{input_u, "uv.x"}, {input_v, "uv.y"}, {input_w, "uv.z"}, {input_lod_bias, "lod_bias"}})
        if (bound_.program->uses_input(input))
            refuse(*model_, at,
                   fmt::format("brdf() depends on '{}' itself: allowed is lookup3DLOD(NAME, uv, lod_bias)",
                               name));
}

void MaterialProgram::compile(const MaterialParameters& parameters) {
    Graph graph;
    const Function& brdf = *model_->function("brdf");
    const Directions d = directions(graph);
    const std::int32_t own = first_own_uniform(*model_);
    const auto grey = [&](std::int32_t index) {
        const NodeId n = graph.uniform(index);
        return vector_value({n, n, n, n});
    };
    const Value uv = vector_value({graph.input(input_u), graph.input(input_v), graph.input(input_w)});
    const Value lod_bias = scalar_value(graph.input(input_lod_bias));
    std::vector<Value> arguments{d.light,
                                 d.camera,
                                 d.normal,
                                 grey(own),
                                 grey(own + 1),
                                 scalar_value(graph.uniform(own + 2)),
                                 scalar_value(graph.input(input_t)),
                                 scalar_value(graph.input(input_duration)),
                                 uv,
                                 lod_bias};

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
    const Value result =
        lowered(*model_, brdf, parameters, input_varied, graph, std::move(arguments), surroundings);
    const auto& nodes = result.nodes;
    if (std::any_of(nodes.begin() + 1, nodes.end(), [&](NodeId n) { return n != nodes[0]; }))
        refuse(*model_, brdf.at,
               "brdf() differs between its four channels: give each vec4 parameter one value for all "
               "channels, and colours by the keys of the body");
    bound_ = bound_program(*model_, brdf.at, graph, std::span(nodes).first(1), uniforms_of(parameters, 1),
                           static_cast<std::int32_t>(input_varied + varied_), parameters.target);
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
    bound_.program->run(bound_.uniforms, inputs.data(), &out, lanes);
    out = half.data();
    bound_.program->run(bound_.program->bind(uniforms_of(parameters, 0.5)), inputs.data(), &out, lanes);
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
    bound_.program->run(bound_.uniforms, inputs.data(), &r, lanes);
}

} // namespace obscura::models
