// SPDX-License-Identifier: Apache-2.0
// Reference page of the SCPI commands, made from their table.
#pragma once

#include <string>

namespace obscura::instrument {

/// docs/reference/scpi.md
[[nodiscard]] std::string scpi_reference();

} // namespace obscura::instrument
