// SPDX-License-Identifier: Apache-2.0
#include "host/web_links.hpp"

#include "core/io/file_descriptor.hpp"
#include "core/io/path_state.hpp"
#include "host/monitor_paths.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <map>
#include <string_view>
#include <system_error>

namespace obscura::host {
namespace {

constexpr std::string_view link_prefix = "obscura-web-", suffix = ".link";

/// The process of a file of that name; 0: it is none.
pid_t process_of_link(const std::string& name) {
    if (name.rfind(link_prefix, 0) != 0 || !name.ends_with(suffix)) return 0;
    const char* const end = name.data() + name.size() - suffix.size();
    std::int32_t pid = 0;
    const auto [stop, error] = std::from_chars(name.data() + link_prefix.size(), end, pid);
    return error == std::errc{} && stop == end && pid > 0 ? pid : 0;
}

bool is_own(const std::filesystem::path& path) {
    struct stat status {};
    return ::lstat(path.c_str(), &status) == 0 && status.st_uid == ::geteuid() && !S_ISLNK(status.st_mode);
}

/// Whether the server that has written this file runs. The number in its name may be that of another process
/// by now.
bool is_held(const std::filesystem::path& path) {
    const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    return file && ::flock(file.get(), LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

/// Files of links of this user in its folder, in order of their processes.
std::map<pid_t, std::filesystem::path> link_files() {
    std::map<pid_t, std::filesystem::path> files;
    std::error_code error;
    const std::filesystem::path folder = own_monitor_folder();
    if (!is_own(folder)) return files;
    for (const std::filesystem::path& entry : paths_in(folder, error)) {
        const pid_t pid = process_of_link(entry.filename().string());
        if (pid != 0 && is_own(entry)) files[pid] = entry;
    }
    return files;
}

} // namespace

std::vector<std::string> web_links() {
    std::vector<std::string> links;
    for (const auto& [pid, file] : link_files()) {
        if (!is_held(file)) continue;
        std::ifstream in(file);
        if (std::string line; std::getline(in, line)) links.push_back(line);
    }
    return links;
}

void remove_left_over_web_links() {
    std::error_code ignored;
    for (const auto& [pid, file] : link_files())
        if (!is_held(file)) std::filesystem::remove(file, ignored);
}

} // namespace obscura::host
