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

/// Inputs of the program. Rows follow, the varied parameters first.
enum MaterialInput : std::int32_t { input_cos_in, input_cos_out, input_cos_phase, input_rows };

std::int32_t input_of(std::size_t row) {
    return input_rows + static_cast<std::int32_t>(row);
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

/// Uniforms that the kind has behind those of the parameters.
enum OwnUniform : std::int32_t { own_diffuse, own_specular, own_shininess, own_emission };

std::int32_t channel_uniform(const Model& model, std::size_t parameter, std::size_t band) {
    return first_own_uniform(model) + own_emission +
           static_cast<std::int32_t>(MaterialProgram::max_bands * (1 + parameter) + band);
}

std::vector<double> uniforms_of(const MaterialParameters& parameters, double diffuse) {
    std::vector<double> uniforms = uniform_values(parameters, {diffuse, specular, parameters.shininess});
    const auto add = [&](const std::vector<double>& values) {
        for (std::size_t band = 0; band < MaterialProgram::max_bands; ++band)
            uniforms.push_back(values.empty() ? 0 : values[std::min(band, values.size() - 1)]);
    };
    add(parameters.emission);
    for (const std::vector<double>& values : parameters.channels)
        add(values);
    return uniforms;
}

/// Index of the band that channel `c` of a group is, in a list of `count` values: four of them stand for each
/// four bands, and the last one for channels beyond the bands.
std::size_t channel_index(std::size_t group, std::size_t c, std::size_t count, std::size_t bands) {
    return count == 4 && bands != 4 ? c : std::min(4 * group + c, count - 1);
}

/// Value of a vec4 parameter in a group of four bands: one uniform for channels that are the same.
std::optional<Value> channel_values(const Model& model, const MaterialParameters& parameters,
                                    std::size_t parameter, std::size_t group, Graph& graph) {
    if (parameter >= parameters.channels.size() || parameters.channels[parameter].empty()) return {};
    const std::vector<double>& given = parameters.channels[parameter];
    Value value{Type::vec4, {}};
    for (std::size_t c = 0; c < 4; ++c) {
        const std::size_t index = channel_index(group, c, given.size(), parameters.bands);
        const auto first = std::find(given.begin(), given.end(), given[index]) - given.begin();
        value.nodes[c] = graph.uniform(channel_uniform(model, parameter, static_cast<std::size_t>(first)));
    }
    return value;
}

const Function& function_of(const Model& model, MaterialFunction which) {
    return *model.function(which == MaterialFunction::brdf ? "brdf" : "emission");
}

} // namespace

MaterialProgram::MaterialProgram(std::shared_ptr<const Model> model, const MaterialParameters& parameters,
                                 MaterialFunction function)
    : model_(std::move(model)), at_(function_of(*model_, function).at), varied_(parameters.varied.size()) {
    if (varied_ > max_varied)
        throw ConfigError(fmt::format("{}: {} parameters vary over the surface: allowed are {}",
                                      model_->name(), varied_, max_varied));
    const bool emits = function == MaterialFunction::emission;
    first_read_ = varied_ + surface_rows + (emits && parameters.emission_varies ? parameters.bands : 0);
    compile(parameters, function_of(*model_, function), emits);
    if (!emits) find_proportion(parameters);
}

void MaterialProgram::compile(const MaterialParameters& parameters, const Function& function, bool emits) {
    Graph graph;
    const Directions d = directions(graph);
    const std::int32_t own = first_own_uniform(*model_);
    const auto grey = [&](std::int32_t index) {
        const NodeId n = graph.uniform(own + index);
        return vector_value({n, n, n, n});
    };
    const auto at_point = [&](SurfaceRow which) { return graph.input(input_of(row(which))); };
    const NodeId u = at_point(SurfaceRow::u), v = at_point(SurfaceRow::v),
                 lod = at_point(SurfaceRow::lod_bias);
    LookUps reads(input_of(first_read_));

    Surroundings surroundings = surroundings_of(d, graph);
    std::size_t group = 0;
    surroundings.look_up = [&](std::string_view name, const std::vector<Value>& given,
                               std::string& why) -> std::optional<Value> {
        if (name != "lookup3DLOD" || given.size() != 3) return {};
        const LookUp read{static_cast<std::size_t>(given[0].nodes[0]),
                          0,
                          given[1].nodes[0] == u && given[1].nodes[1] == v && given[2].nodes[0] == lod,
                          {given[1].nodes[0], given[1].nodes[1], given[2].nodes[0]}};
        for (std::int32_t angle = 0; angle < input_rows; ++angle)
            if (graph.depends_on(read.at, Operation::input, angle)) {
                why = "the place of a texture that is read must not depend on directions";
                return {};
            }
        return reads.value(graph, read);
    };
    surroundings.parameter = [&](std::size_t parameter) -> std::optional<Value> {
        const auto& varied = parameters.varied;
        if (std::find(varied.begin(), varied.end(), parameter) != varied.end()) return {};
        return channel_values(*model_, parameters, parameter, group, graph);
    };
    std::vector<NodeId> outputs;
    for (; 4 * group < parameters.bands; ++group) {
        std::vector<Value> arguments{d.camera, d.normal};
        if (emits) {
            Value own_light{Type::vec4, {}};
            for (std::size_t c = 0; c < 4; ++c) {
                const std::size_t band = std::min(4 * group + c, parameters.bands - 1);
                own_light.nodes[c] =
                    parameters.emission_varies
                        ? graph.input(input_of(first_emission_row() + band))
                        : graph.uniform(own + own_emission + static_cast<std::int32_t>(band));
            }
            arguments.push_back(own_light);
        } else {
            arguments.insert(arguments.begin(), d.light);
        }
        arguments.insert(
            arguments.end(),
            {grey(own_diffuse), grey(own_specular), scalar_value(graph.uniform(own + own_shininess)),
             scalar_value(at_point(SurfaceRow::t)), scalar_value(at_point(SurfaceRow::duration)),
             emits ? vector_value({u, v}) : vector_value({u, v, graph.constant(0)}), scalar_value(lod)});
        const Value result =
            lowered(*model_, function, parameters, input_rows, graph, std::move(arguments), surroundings);
        for (std::size_t c = 0; c < 4 && outputs.size() < parameters.bands; ++c)
            outputs.push_back(result.nodes[c]);
    }
    if (std::all_of(outputs.begin(), outputs.end(), [&](NodeId n) { return n == outputs[0]; }))
        outputs.resize(1);
    outputs_ = outputs.size();
    const std::size_t all_rows = first_read_ + 4 * reads.list().size();
    if (all_rows > max_rows)
        refuse(*model_, at_,
               fmt::format("{}() reads textures at {} places: allowed are {}", function.name,
                           reads.list().size(), (max_rows - first_read_) / 4));
    const std::vector<double> uniforms = uniforms_of(parameters, 1);
    bound_ = bound_program(*model_, at_, graph, outputs, uniforms, input_of(all_rows), parameters.target);
    places_ =
        LookUpPlaces(*model_, at_, graph, reads.list(), uniforms, input_of(all_rows), parameters.target);
}

void MaterialProgram::find_proportion(const MaterialParameters& parameters) {
    constexpr std::size_t lanes = 256;
    using Row = std::array<double, lanes>;
    const auto uniform = [](std::uint32_t i, std::size_t k) {
        return uniform_double(philox4x32({i, static_cast<std::uint32_t>(k), 0, 0}, philox_key(1))[0]);
    };
    std::vector<Row> rows(static_cast<std::size_t>(input_of(this->rows())));
    for (std::uint32_t i = 0; i < lanes; ++i) {
        for (std::size_t k = input_rows; k < rows.size(); ++k)
            rows[k][i] = uniform(i, k);
        rows[0][i] = uniform(i, 0);
        rows[1][i] = 1e-3 + 0.999 * uniform(i, 1);
        const double sines = std::sqrt((1 - rows[0][i] * rows[0][i]) * (1 - rows[1][i] * rows[1][i]));
        rows[2][i] = rows[0][i] * rows[1][i] + sines * std::cos(std::numbers::pi * uniform(i, 2));
    }
    std::vector<const double*> inputs;
    for (const Row& row : rows)
        inputs.push_back(row.data());
    std::vector<Row> full(outputs_), half(outputs_);
    std::vector<double*> to_full, to_half;
    for (std::size_t k = 0; k < outputs_; ++k) {
        to_full.push_back(full[k].data());
        to_half.push_back(half[k].data());
    }
    bound_.program->run(bound_.uniforms, inputs.data(), to_full.data(), lanes);
    bound_.program->run(bound_.program->bind(uniforms_of(parameters, 0.5)), inputs.data(), to_half.data(),
                        lanes);
    proportional_ = true;
    for (std::size_t k = 0; k < outputs_; ++k)
        for (std::size_t i = 0; i < lanes; ++i)
            if (std::isfinite(full[k][i]) &&
                std::abs(half[k][i] - 0.5 * full[k][i]) > 1e-12 * std::abs(full[k][i]))
                proportional_ = false;
}

bool MaterialProgram::uses_row(std::size_t row) const noexcept {
    return bound_.program->uses_input(input_of(row)) || places_.uses_input(input_of(row));
}

bool MaterialProgram::differs_by_point() const noexcept {
    for (std::size_t k = varied_; k < rows(); ++k)
        if (bound_.program->uses_input(input_of(k))) return true;
    return false;
}

bool MaterialProgram::is_constant() const noexcept {
    for (std::size_t k = 0; k < static_cast<std::size_t>(input_of(rows())); ++k)
        if (bound_.program->uses_input(static_cast<std::int32_t>(k))) return false;
    return true;
}

void MaterialProgram::evaluate(const double* cos_in, const double* cos_out, const double* cos_phase,
                               const double* const* rows, double* const* r,
                               std::size_t lanes) const noexcept {
    std::array<const double*, input_rows + max_rows> inputs{};
    inputs[input_cos_in] = cos_in;
    inputs[input_cos_out] = cos_out;
    inputs[input_cos_phase] = cos_phase;
    std::copy_n(rows, this->rows(), inputs.begin() + input_rows);
    bound_.program->run(bound_.uniforms, inputs.data(), r, lanes);
}

void MaterialProgram::read_at(std::size_t read, const double* const* rows, double* const* at,
                              std::size_t lanes) const noexcept {
    std::array<const double*, input_rows + max_rows> inputs{};
    std::copy_n(rows, this->rows(), inputs.begin() + input_rows);
    places_.run(read, inputs.data(), at, lanes);
}

} // namespace obscura::models
