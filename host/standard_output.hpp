// SPDX-License-Identifier: Apache-2.0
// Standard output at a program's end: what was printed must have arrived.
#pragma once

#include "core/error.hpp"

#include <functional>

namespace obscura::host {

/// Runs `program`, whose printing goes to stdout, and flushes that. Throws OutputError if something could not
/// be written (a full disk); an error that `program` throws goes first, unless it is that one.
int with_standard_output(const std::function<int()>& program);

} // namespace obscura::host
