// SPDX-License-Identifier: Apache-2.0
#include "tools/support/web_links.hpp"

#include "emulator/monitor/monitor_paths.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <charconv>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <map>
#include <string_view>
#include <system_error>

namespace obscura::tools {
namespace {

constexpr std::string_view prefix = "obscura-web-", suffix = ".link";

/// The process of a file of that name; 0: it is none.
pid_t process_of(const std::string& name) {
    if (name.rfind(prefix, 0) != 0 || !name.ends_with(suffix)) return 0;
    const char* const end = name.data() + name.size() - suffix.size();
    std::int32_t pid = 0;
    const auto [stop, error] = std::from_chars(name.data() + prefix.size(), end, pid);
    return error == std::errc{} && stop == end && pid > 0 ? pid : 0;
}

bool is_own(const std::filesystem::path& path) {
    struct stat status {};
    return ::lstat(path.c_str(), &status) == 0 && status.st_uid == ::geteuid() && !S_ISLNK(status.st_mode);
}

} // namespace

std::vector<std::string> web_links() {
    std::map<pid_t, std::string> links;
    std::error_code error;
    const std::filesystem::path folder = emulator::own_monitor_folder();
    if (!is_own(folder)) return {};
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        const pid_t pid = process_of(entry.path().filename().string());
        if (pid == 0 || !is_own(entry.path()) || ::kill(pid, 0) != 0) continue;
        std::ifstream in(entry.path());
        if (std::string line; std::getline(in, line)) links[pid] = line;
    }
    std::vector<std::string> all;
    for (const auto& [pid, link] : links)
        all.push_back(link);
    return all;
}

} // namespace obscura::tools
