// SPDX-License-Identifier: Apache-2.0
// Textures that a function of a model reads: what it reads where, and values in place of the reads.
#pragma once

#include "models/kinds/model_parameters.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::models {

/// One read of a texture. Its place is nodes of a graph: they do not depend on later reads.
struct LookUp {
    std::size_t texture;      ///< index in Model::parameters()
    std::size_t group;        ///< the four channels that are read: 0 is the first four
    bool own_place;           ///< at the place that the function is asked for, unchanged
    std::array<NodeId, 3> at; ///< u, v, level of detail
};

/// Reads of textures in a graph: the caller gives their values as inputs, four for each. Thread-bound.
class LookUps {
public:
    explicit LookUps(std::int32_t first_input) : first_input_(first_input) {}

    /// Value (vec4) of a read; the same read again is the same value.
    Value value(Graph& graph, const LookUp& wanted);
    [[nodiscard]] const std::vector<LookUp>& list() const noexcept { return list_; }

private:
    std::int32_t first_input_;
    std::vector<LookUp> list_;
};

/// Programs that compute the places of reads that are not own_place. Immutable; thread-safe.
class LookUpPlaces {
public:
    LookUpPlaces() = default;
    /// Arguments as those of bound_program().
    LookUpPlaces(const Model& model, Place at, const Graph& graph, const std::vector<LookUp>& list,
                 std::span<const double> uniforms, std::int32_t inputs, const Execution& execution);

    /// Number of reads; each in turn needs the values of those before.
    [[nodiscard]] const std::vector<LookUp>& list() const noexcept { return list_; }
    /// Place of a read that is not own_place: u, v and level, from the inputs of the function. Real-time
    /// safe.
    void run(std::size_t read, const double* const* inputs, double* const* at,
             std::size_t lanes) const noexcept {
        programs_[read].program->run(programs_[read].uniforms, inputs, at, lanes);
    }
    [[nodiscard]] bool uses_input(std::int32_t input) const noexcept;

private:
    std::vector<LookUp> list_;
    std::vector<BoundProgram> programs_; ///< of each; without a program where own_place
};

} // namespace obscura::models
