// Measures the GigE Vision stream alone, with frames that are ready when they are submitted.
#pragma once

#include "emulator/config/daemon_config.hpp"

#include <cstdint>
#include <vector>

namespace obscura::tools {

struct StreamFigures {
    std::vector<double>
        limited_ms; ///< submission to completion in a libaravis client, default throughput limit
    std::vector<double> unlimited_ms; ///< the same without the limit
};

/// Sends `frames` frames of the configuration's size, one at a time, on its loopback address. Throws Error.
[[nodiscard]] StreamFigures bench_stream(const emulator::DaemonConfig& config, std::uint64_t frames);

} // namespace obscura::tools
