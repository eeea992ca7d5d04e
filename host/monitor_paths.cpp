// SPDX-License-Identifier: Apache-2.0
#include "host/monitor_paths.hpp"

#include "core/io/path_state.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <system_error>

namespace obscura::host {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view prefix = "obscurad-", suffix = ".socket", calls_suffix = ".calls";

std::string environment(const char* name) {
    const char* const value = std::getenv(name);
    return value == nullptr ? std::string() : std::string(value);
}

fs::path session_folder() {
    const std::string runtime = environment("XDG_RUNTIME_DIR");
    return runtime.empty() ? fs::path() : fs::path(runtime) / "obscura";
}

fs::path temporary_folder() {
    return fmt::format("/tmp/obscura-{}", ::geteuid());
}

/// Every user can make folders in /tmp: only one of this user's own is searched.
bool trusted(const fs::path& folder) {
    struct stat status {};
    return folder != temporary_folder() ||
           (::lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == ::geteuid());
}

/// Whether `name` is "obscurad-", something, `end`.
bool is_socket_name(const std::string& name, std::string_view end) {
    return name.rfind(prefix, 0) == 0 && name.size() > prefix.size() + end.size() && name.ends_with(end);
}

/// The process in the name of a socket; 0: there is none.
pid_t process_of(const std::string& name) {
    const std::string_view end = name.ends_with(suffix) ? suffix : calls_suffix;
    if (!is_socket_name(name, end)) return 0;
    const char* const last = name.data() + name.size() - end.size();
    pid_t pid = 0;
    const auto [stop, bad] = std::from_chars(name.data() + prefix.size(), last, pid);
    return bad == std::errc{} && stop == last && pid > 0 ? pid : 0;
}

} // namespace

std::size_t max_socket_path_bytes() noexcept {
    return sizeof sockaddr_un{}.sun_path - 1;
}

fs::path own_monitor_folder() {
    // systemd lists several folders with colons between them.
    if (const std::string runtime = environment("RUNTIME_DIRECTORY"); !runtime.empty())
        return runtime.substr(0, runtime.find(':'));
    if (const fs::path session = session_folder(); !session.empty()) return session;
    return ::geteuid() == 0 ? fs::path("/run/obscura") : temporary_folder();
}

fs::path own_monitor_socket() {
    return own_monitor_folder() / fmt::format("{}{}{}", prefix, ::getpid(), suffix);
}

fs::path own_calls_socket() {
    if (!environment("RUNTIME_DIRECTORY").empty()) return own_monitor_folder() / "calls";
    return own_monitor_folder() / fmt::format("{}{}{}", prefix, ::getpid(), calls_suffix);
}

std::string prepare_socket_folder(const fs::path& folder) {
    std::error_code error;
    if (fs::create_directories(folder, error))
        fs::permissions(folder, fs::perms::owner_all | fs::perms::group_read | fs::perms::group_exec, error);
    if (error) return error.message();
    struct stat status {};
    if (::stat(folder.c_str(), &status) != 0) return std::strerror(errno);
    return status.st_uid != ::geteuid() && status.st_uid != 0 ? "the folder belongs to another user" : "";
}

void remove_left_over_sockets(const fs::path& folder) {
    std::error_code error;
    std::vector<fs::path> left_over;
    for (const std::filesystem::path& entry : paths_in(folder, error)) {
        const pid_t pid = process_of(entry.filename().string());
        if (pid > 0 && ::kill(pid, 0) != 0 && errno == ESRCH) left_over.push_back(entry);
    }
    for (const fs::path& socket : left_over)
        fs::remove(socket, error);
}

std::vector<fs::path> monitor_sockets() {
    std::error_code error;
    std::vector<fs::path> folders{session_folder(), temporary_folder()};
    // Each unit has a folder of its own below /run, obscura or obscura-INSTANCE.
    for (const std::filesystem::path& entry : paths_in("/run", error))
        if (entry.filename().string().rfind("obscura", 0) == 0) folders.push_back(entry);
    std::vector<fs::path> found;
    for (const fs::path& folder : folders) {
        if (folder.empty() || !trusted(folder)) continue;
        for (const std::filesystem::path& entry : paths_in(folder, error)) {
            if (is_socket_name(entry.filename().string(), suffix)) found.push_back(entry);
        }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

} // namespace obscura::host
