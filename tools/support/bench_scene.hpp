// The workload that `obscura bench` measures when it is given none.
#pragma once

#include "emulator/config/daemon_config.hpp"

namespace obscura::tools {

/// An asteroid over about a third of a 1024 x 1024 field and 200 stars; the same on every machine. Readout in
/// 21 ms, so that what is measured is the computer.
[[nodiscard]] emulator::DaemonConfig bench_config();

} // namespace obscura::tools
