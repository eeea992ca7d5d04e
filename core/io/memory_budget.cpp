// SPDX-License-Identifier: Apache-2.0
#include "core/io/memory_budget.hpp"

#include "core/error.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>

namespace obscura {
namespace {

constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t mib = 1 << 20;
/// Left over for buffers, logs and libraries of the threads that run while something is loaded.
constexpr std::uint64_t reserve = 32 * mib;

std::optional<std::uint64_t> number_in(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_of("0123456789"), text.size()));
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} ? std::optional(value) : std::nullopt;
}

/// The number after `key` in a file of lines like "VmData:     1234 kB" or "file 1234".
std::optional<std::uint64_t> number_after(const std::filesystem::path& file, std::string_view key) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);)
        if (line.rfind(key, 0) == 0) return number_in(std::string_view(line).substr(key.size()));
    return std::nullopt;
}

std::uint64_t bytes_of(std::string_view key, const std::filesystem::path& file = "/proc/self/status") {
    return number_after(file, key).value_or(0) * 1024;
}

std::optional<std::uint64_t> number_of_file(const std::filesystem::path& file) {
    std::string line;
    std::ifstream in(file);
    if (!std::getline(in, line)) return std::nullopt;
    return number_in(line); // "max" is no number
}

/// Folder of the process's control group, version 2; empty: none.
std::filesystem::path control_group() {
    std::ifstream in("/proc/self/cgroup");
    for (std::string line; std::getline(in, line);)
        if (line.rfind("0::/", 0) == 0) return std::filesystem::path("/sys/fs/cgroup") / line.substr(4);
    return {};
}

/// Calls `visit(limit, used)` for each control group with a limit, from the process's own upwards.
template<typename Visit>
void for_each_group_limit(const Visit& visit) {
    const std::filesystem::path top = "/sys/fs/cgroup";
    for (std::filesystem::path group = control_group(); group.string().size() > top.string().size();
         group = group.parent_path()) {
        const auto limit = number_of_file(group / "memory.max");
        if (!limit) continue;
        // Pages of files are counted, but given back before the limit is enforced.
        const std::uint64_t current = number_of_file(group / "memory.current").value_or(0);
        const std::uint64_t of_files = number_after(group / "memory.stat", "file ").value_or(0);
        visit(*limit, current - std::min(current, of_files));
    }
}

std::uint64_t soft_limit(int resource) {
    rlimit limit{};
    if (getrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
        return unlimited;
    return limit.rlim_cur;
}

std::string in_mib(std::uint64_t bytes) {
    return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / static_cast<double>(mib));
}

} // namespace

MemoryLeft memory_left() {
    MemoryLeft left{unlimited, "no limit"};
    const auto consider = [&left](std::uint64_t limit, std::uint64_t used, const char* name) {
        if (limit == unlimited) return;
        const std::uint64_t bytes = limit > used ? limit - used : 0;
        if (bytes < left.bytes) left = {bytes, fmt::format("{} ({})", name, in_mib(limit))};
    };
    consider(soft_limit(RLIMIT_DATA), bytes_of("VmData:"), "the memory limit of the process");
    consider(soft_limit(RLIMIT_AS), bytes_of("VmSize:"), "the address space limit of the process");
    for_each_group_limit([&](std::uint64_t limit, std::uint64_t used) {
        consider(limit, used, "the memory limit of the control group");
    });
    const std::filesystem::path machine = "/proc/meminfo";
    if (const std::uint64_t available = bytes_of("MemAvailable:", machine); available > 0)
        consider(available + bytes_of("SwapFree:", machine), 0, "the machine's free memory");
    return left;
}

std::string describe(const MemoryLeft& left) {
    return fmt::format("{} of {}", in_mib(left.bytes), left.limit);
}

void require_memory(std::uint64_t bytes, std::string_view what) {
    MemoryLeft left = memory_left();
    left.bytes -= std::min(left.bytes, reserve);
    if (bytes <= left.bytes) return;
    throw InputError(fmt::format("{}: needs {} of memory; left are {}", what, in_mib(bytes), describe(left)));
}

void limit_memory(std::uint64_t bytes) {
    if (const std::uint64_t used = bytes_of("VmData:"); used > bytes)
        throw ConfigError(
            fmt::format("daemon.memory_limit_mib: {} is below what the program needs to start, {}",
                        in_mib(bytes), in_mib(used)));
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) == 0) limit.rlim_cur = std::min<rlim_t>(bytes, limit.rlim_max);
    if (limit.rlim_cur == 0 || setrlimit(RLIMIT_DATA, &limit) != 0)
        throw Error(exit_software, fmt::format("daemon.memory_limit_mib: {}", std::strerror(errno)));
}

} // namespace obscura
