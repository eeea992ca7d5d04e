// SPDX-License-Identifier: Apache-2.0
// Machine code of a program, for processors with AVX2 or AVX-512.
#pragma once

#include "models/graph/instruction.hpp"
#include "models/native/sealed_code.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace obscura::models {

/// Instruction sets that code is made for.
enum class NativeTarget : std::uint8_t { none, avx2, avx512 };
/// The best that this processor has; none: code cannot be made here.
[[nodiscard]] NativeTarget native_target() noexcept;

/// A uniform or constant, side by side, as the code reads it.
struct alignas(64) Copies {
    explicit Copies(double value) { std::fill(std::begin(values), std::end(values), value); }
    double values[8]{};
};

/// Immutable; thread-safe. Gives the bits of the interpreter: the same operations in the same order, none of
/// them fused.
class NativeCode {
public:
    /// Programs with more instructions are left to the interpreter: for them code gains nothing.
    static constexpr std::size_t max_instructions = 1000;

    /// Null, and `why` says why, where the program or the machine does not allow it.
    [[nodiscard]] static std::unique_ptr<const NativeCode> make(const std::vector<Instruction>& instructions,
                                                                const std::vector<Operand>& outputs,
                                                                NativeTarget target, std::string& why);

    /// As Program::run(). Real-time safe.
    void run(const std::vector<Copies>& uniforms, const double* const* inputs, double* const* outputs,
             std::size_t lanes) const noexcept;
    [[nodiscard]] std::size_t bytes() const noexcept { return code_.bytes(); }

private:
    using Entry = void (*)(const Copies* uniforms, const double* const* inputs, double* const* outputs,
                           std::size_t lanes, const Copies* constants);
    NativeCode() = default;

    SealedCode code_;
    std::vector<Copies> constants_;
};

} // namespace obscura::models
