// SPDX-License-Identifier: Apache-2.0
// Runnable form of a model's graph: what is the same for all lanes is computed once, the rest lane by lane.
#pragma once

#include "models/graph/graph.hpp"
#include "models/graph/instruction.hpp"
#include "models/native/native_code.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::models {

/// Values that are the same for all lanes, for one set of parameters. Made by Program::bind().
class Uniforms {
public:
    [[nodiscard]] std::span<const double> values() const noexcept { return values_; }

private:
    friend class Program;
    std::vector<double> values_;
    std::vector<Copies> copies_; ///< of each, for machine code; empty without
};

/// Immutable; thread-safe. The interpreter is the reference: other ways to run the same instructions must
/// give the same bits.
class Program {
public:
    /// Lanes come in multiples of this.
    static constexpr std::size_t lane_step = 16;
    /// Lanes per block; fewer where a program has many values in use at once.
    static constexpr std::size_t max_lanes = 128;
    static constexpr std::size_t max_slots = 512;

    /// The values `outputs` of `graph`. Throws std::length_error: more than max_slots values in use at once.
    Program(const Graph& graph, std::span<const NodeId> outputs);

    /// Makes machine code for `target` and compares it with the interpreter on 4096 lanes of numbers of all
    /// kinds, with `uniforms`. Without it, or where they differ, the interpreter stays; then `why` says why.
    /// Not on a real-time thread.
    void make_native(NativeTarget target, std::span<const double> uniforms, std::int32_t inputs,
                     std::string& why);
    [[nodiscard]] bool is_native() const noexcept { return native_ != nullptr; }

    /// Measures the cost of an evaluation: processor time of the slowest of four sets of inputs. Not on a
    /// real-time thread.
    void measure(const Uniforms& uniforms, std::int32_t inputs);
    /// As measured, ns for each lane; 0: not measured.
    [[nodiscard]] double measured_ns() const noexcept { return measured_ns_; }

    /// Computes what depends only on `uniforms`, the values by the index of their nodes. Not on a real-time
    /// thread.
    [[nodiscard]] Uniforms bind(std::span<const double> uniforms) const;

    /// Computes `lanes` lanes: inputs[i] and outputs[i] are arrays of that length; inputs that
    /// uses_input() denies may be null. Real-time safe.
    void run(const Uniforms& uniforms, const double* const* inputs, double* const* outputs,
             std::size_t lanes) const noexcept;

    [[nodiscard]] bool uses_input(std::int32_t index) const noexcept;
    /// Operations for each lane.
    [[nodiscard]] std::size_t cost() const noexcept { return instructions_.size(); }
    [[nodiscard]] const std::vector<Instruction>& instructions() const noexcept { return instructions_; }
    [[nodiscard]] std::size_t outputs() const noexcept { return outputs_.size(); }
    [[nodiscard]] std::int32_t slots() const noexcept { return slots_; }

private:
    void run_block(const double* uniforms, const double* const* inputs, double* const* outputs,
                   std::size_t first, std::size_t lanes) const noexcept;

    void interpret(const Uniforms& uniforms, const double* const* inputs, double* const* outputs,
                   std::size_t lanes) const noexcept;

    std::unique_ptr<const NativeCode> native_; ///< null: interpreted
    std::vector<Node> uniform_nodes_;          ///< in order; operands are indices in this list
    std::vector<Instruction> instructions_;
    std::vector<Operand> outputs_;
    std::int32_t slots_ = 0;
    double measured_ns_ = 0;
};

} // namespace obscura::models
