// SPDX-License-Identifier: Apache-2.0
// In place of native_code.cpp where machine code cannot be made.
#include "models/native/native_code.hpp"

namespace obscura::models {

NativeTarget native_target() noexcept {
    return NativeTarget::none;
}

std::unique_ptr<const NativeCode> NativeCode::make(const std::vector<Instruction>& /*instructions*/,
                                                   const std::vector<Operand>& /*outputs*/,
                                                   NativeTarget /*target*/, std::string& why) {
    why = "this build makes no machine code";
    return nullptr;
}

void NativeCode::run(const std::vector<Copies>& /*uniforms*/, const double* const* /*inputs*/,
                     double* const* /*outputs*/, std::size_t /*lanes*/) const noexcept {}

} // namespace obscura::models
