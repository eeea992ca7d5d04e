// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/own_threads.hpp"

#include "core/io/path_state.hpp"

#include <sched.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>

namespace obscura::emulator {
namespace {

std::string policy_name(int policy) {
    switch (policy) {
    case SCHED_FIFO:
        return "fifo";
    case SCHED_RR:
        return "rr";
    case SCHED_BATCH:
        return "batch";
    case SCHED_IDLE:
        return "idle";
    default:
        return "other";
    }
}

} // namespace

std::string status_field(const std::filesystem::path& status, std::string_view name) {
    std::ifstream in(status);
    for (std::string line; std::getline(in, line);)
        if (line.size() > name.size() && line[name.size()] == ':' &&
            std::string_view(line).starts_with(name)) {
            const std::size_t value = line.find_first_not_of(" \t", name.size() + 1);
            return value == std::string::npos ? std::string() : line.substr(value);
        }
    return {};
}

std::vector<OwnThread> own_threads(const std::filesystem::path& tasks) {
    std::vector<OwnThread> threads;
    std::error_code error;
    for (const std::filesystem::path& task : paths_in(tasks, error)) {
        std::ifstream in(task / "stat");
        const std::string stat{std::istreambuf_iterator<char>(in), {}};
        // The name, in parentheses, may itself hold any character.
        const std::size_t open = stat.find('('), close = stat.rfind(')');
        if (open == std::string::npos || close == std::string::npos) continue;
        OwnThread thread;
        thread.name = stat.substr(open + 1, close - open - 1);
        // Numbers of the fields as in proc(5).
        constexpr int state = 3, utime = 14, stime = 15, nice = 19, processor = 39, rt_priority = 40,
                      policy = 41;
        std::istringstream fields(stat.substr(close + 2));
        std::string field;
        double ticks = 0;
        for (int number = state; number <= policy && fields >> field; ++number) {
            if (number == utime || number == stime) ticks += std::stod(field);
            if (number == nice) thread.nice = std::stoi(field);
            if (number == processor) thread.processor = std::stoi(field);
            if (number == rt_priority) thread.priority = std::stoi(field);
            if (number == policy) thread.policy = policy_name(std::stoi(field));
        }
        thread.cpu_s = ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
        thread.cores = status_field(task / "status", "Cpus_allowed_list");
        threads.push_back(std::move(thread));
    }
    return threads;
}

} // namespace obscura::emulator
