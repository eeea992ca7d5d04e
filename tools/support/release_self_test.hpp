// SPDX-License-Identifier: Apache-2.0
// Self-test of the machine: how late the daemon's row release thread releases rows.
#pragma once

#include <string>

namespace obscura::tools {

/// Releases rows at 10 and 100 Hz, with and without polling, `seconds` each, and returns a table of their
/// lateness. With SCHED_FIFO where that is permitted: it can make rows of a camera on this machine late.
[[nodiscard]] std::string release_self_test(double seconds);

} // namespace obscura::tools
