// SPDX-License-Identifier: Apache-2.0
// Threads of this process as the kernel schedules them.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// One thread.
struct OwnThread {
    std::string name;
    std::string policy; ///< "other", "fifo", "rr", "batch" or "idle"
    int priority = 0;   ///< of fifo and rr
    int nice = 0;       ///< of the others
    double cpu_s = 0;   ///< processor time taken
    int processor = -1; ///< that it ran on last; -1: not known
    std::string cores;  ///< that it may run on, as "0-2,5"
};

/// Value of a line "NAME: VALUE" of a status file of proc(5); empty: there is none.
[[nodiscard]] std::string status_field(const std::filesystem::path& status, std::string_view name);

/// Reads `tasks`, of this process by default (proc(5)); threads that end meanwhile are left out.
[[nodiscard]] std::vector<OwnThread> own_threads(const std::filesystem::path& tasks = "/proc/self/task");

} // namespace obscura::emulator
