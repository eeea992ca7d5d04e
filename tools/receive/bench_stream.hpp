// SPDX-License-Identifier: Apache-2.0
// Benchmark of the GigE Vision stream alone, with complete frames made in advance.
#pragma once

#include "emulator/config/daemon_config.hpp"

#include <cstdint>
#include <vector>

namespace obscura::tools {

/// Milliseconds from submission of each frame to its completion in a libaravis client.
struct StreamFigures {
    std::vector<double> limited_ms;   ///< with the default throughput limit
    std::vector<double> unlimited_ms; ///< without a limit
};

/// Sends `frames` frames of the configuration's size, one at a time, on its loopback address. Throws Error.
[[nodiscard]] StreamFigures bench_stream(const emulator::DaemonConfig& config, std::uint64_t frames);

} // namespace obscura::tools
