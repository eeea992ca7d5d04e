// SPDX-License-Identifier: Apache-2.0
// Instructions of a program: one operation each, for all lanes.
#pragma once

#include "models/graph/operation.hpp"

#include <array>
#include <cstdint>

namespace obscura::models {

/// Where an instruction finds an operand.
struct Operand {
    enum class Kind : std::uint8_t { slot, uniform, input };
    Kind kind = Kind::uniform;
    std::int32_t index = 0;
};

/// One operation for all lanes.
struct Instruction {
    Operation operation = Operation::constant;
    std::array<Operand, 3> operands{};
    std::int32_t slot = 0; ///< of the result
};

} // namespace obscura::models
