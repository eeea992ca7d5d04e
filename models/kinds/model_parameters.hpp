// SPDX-License-Identifier: Apache-2.0
// What all kinds of models share: their parameters as numbers, and their functions as programs.
#pragma once

#include "models/model/model.hpp"
#include "models/program/execution.hpp"
#include "models/program/program.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::models {

/// Parameters of a model: `values` has four numbers for each of Model::parameters() (the first ones of
/// smaller types), as the text sees them; those listed in `varied` come lane by lane instead. A texture that
/// does not vary has the same value everywhere.
struct ModelParameters {
    std::vector<std::array<double, 4>> values{};
    std::vector<std::size_t> varied{}; ///< indices in Model::parameters()
    /// Values of a vec4 whose channels differ, for each of Model::parameters(); empty: `values` has it.
    std::vector<std::vector<double>> channels{};
    Execution target{};
};
/// The defaults of `model`, angles in radians; textures are 1.
[[nodiscard]] ModelParameters default_parameters(const Model& model);

/// Uniform of a program that holds a component of a parameter.
[[nodiscard]] std::int32_t uniform_index(std::size_t parameter, std::size_t component) noexcept;
/// First uniform behind those of the parameters, for a kind's own.
[[nodiscard]] std::int32_t first_own_uniform(const Model& model) noexcept;
/// Uniforms of a program: the parameters, then `own`.
[[nodiscard]] std::vector<double> uniform_values(const ModelParameters& parameters,
                                                 std::initializer_list<double> own = {});

[[nodiscard]] Value scalar_value(NodeId node);
/// A vector of as many components as nodes.
[[nodiscard]] Value vector_value(std::initializer_list<NodeId> nodes);

/// Throws ConfigError `file:line:column: what`.
[[noreturn]] void refuse(const Model& model, Place at, std::string_view what);

/// What `function` returns for `arguments`, as nodes of `graph`; surplus arguments are left out. Varied
/// parameters are inputs from `first_varied` on. Throws ConfigError with all mistakes.
[[nodiscard]] Value lowered(const Model& model, const Function& function, const ModelParameters& parameters,
                            std::int32_t first_varied, Graph& graph, std::vector<Value> arguments,
                            const Surroundings& surroundings = {});

/// A program with its uniforms. Immutable; thread-safe.
struct BoundProgram {
    std::unique_ptr<Program> program;
    Uniforms uniforms;
    std::string why_interpreted; ///< empty: machine code runs
};
/// The nodes `outputs` of `graph` as a program of `inputs` inputs. Throws ConfigError at `at` where it is too
/// large, or an evaluation costs too much.
[[nodiscard]] BoundProgram bound_program(const Model& model, Place at, const Graph& graph,
                                         std::span<const NodeId> outputs, std::span<const double> uniforms,
                                         std::int32_t inputs, const Execution& execution);

} // namespace obscura::models
