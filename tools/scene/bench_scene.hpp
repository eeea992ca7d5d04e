// SPDX-License-Identifier: Apache-2.0
// Built-in workload of `obscura bench`.
#pragma once

#include "emulator/config/daemon_config.hpp"

namespace obscura::tools {

/// An asteroid over about a third of a field of 1024 x 1024 pixels and 200 stars; identical on every machine.
/// The readout takes 21 ms, short enough for the computer to be the limit.
[[nodiscard]] emulator::DaemonConfig bench_config();

} // namespace obscura::tools
