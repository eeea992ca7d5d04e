// SPDX-License-Identifier: Apache-2.0
// Self-test of the machine: how late the daemon's row release thread releases rows.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::emulator {

/// How late rows were released, which waited for their times in one way.
struct ReleaseLateness {
    std::string name; ///< the way
    double rate_hz = 0;
    std::uint64_t rows = 0;
    double p50_us = 0, p99_us = 0, max_us = 0;
};

struct ReleaseSelfTest {
    std::string scheduling; ///< a line: which scheduling was had, and why no better one
    std::vector<ReleaseLateness> rows;
    double p99_us = 0; ///< the larger one of the last two rows, which wait best
};

/// Releases rows at 10 and 100 Hz, `seconds` each. With `realtime` also with SCHED_FIFO, where that is
/// permitted, and with polling: that can make rows of a camera on this machine late. Without it the rows are
/// those of an ordinary thread of this process, which sleeps nearly all of the time.
[[nodiscard]] ReleaseSelfTest release_self_test(double seconds, bool realtime);
/// As a table.
[[nodiscard]] std::string text_of(const ReleaseSelfTest& test);

} // namespace obscura::emulator
