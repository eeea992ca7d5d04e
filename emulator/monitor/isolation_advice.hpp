// SPDX-License-Identifier: Apache-2.0
// Advice for a machine whose rows leave late: what of docs/tuning.md, "Set up the machine", is not done.
#pragma once

#include "core/realtime/realtime.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::emulator {

/// What the advice depends on.
struct MachineFacts {
    int highest_priority = 0;        ///< granted to a thread of the daemon; 0: none
    bool memory_locked = false;      ///< no page of the daemon can be swapped out
    CoreSet release_cores, isolated; ///< of the release thread; kept free by the kernel
    bool realtime_kernel = false, virtual_machine = false;
    std::string governor; ///< of the processor's frequency; empty: not known
};

/// Reads what the machine tells; `root` stands for "/".
[[nodiscard]] MachineFacts machine_facts(const CoreSet& release_cores, int highest_priority,
                                         const std::filesystem::path& root = "/");
/// One sentence for each thing that could be better, the most effective first.
[[nodiscard]] std::vector<std::string> isolation_advice(const MachineFacts& facts);

} // namespace obscura::emulator
