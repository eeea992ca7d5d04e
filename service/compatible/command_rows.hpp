// SPDX-License-Identifier: Apache-2.0
// Rows of the table of the published client's commands.
#pragma once

#include "service/compatible/commands.hpp"

#include <vector>

namespace obscura::service::compatible {

/// All rows, by name; commands() keeps them.
[[nodiscard]] std::vector<Command> make_commands();

} // namespace obscura::service::compatible
