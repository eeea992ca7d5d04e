// SPDX-License-Identifier: Apache-2.0
// Verb `obscura release`: takes control of the cameras of a running daemon away from their clients.
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/types.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {
namespace {

constexpr std::string_view daemon_name = "obscurad";

std::string first_line(const std::filesystem::path& file) {
    std::string line;
    std::ifstream in(file);
    std::getline(in, line);
    return line;
}

bool blocks_signal(const std::filesystem::path& thread) {
    std::ifstream status(thread / "status");
    for (std::string line; std::getline(status, line);) {
        constexpr std::string_view blocked = "SigBlk:\t";
        if (line.rfind(blocked, 0) != 0) continue;
        std::uint64_t mask = 0;
        std::from_chars(line.data() + blocked.size(), line.data() + line.size(), mask, 16);
        return (mask >> (SIGUSR2 - 1) & 1) != 0;
    }
    return false;
}

// A daemon that has not started its threads, or none any more, would be ended by SIGUSR2. The thread that
// waits for signals does not block them while it waits, but all others do.
bool waits_for_signal(const std::filesystem::path& process) {
    std::error_code error;
    for (const std::filesystem::path& thread : paths_in(process / "task", error))
        if (blocks_signal(thread)) return true;
    return false;
}

bool is_daemon(const std::filesystem::path& process) {
    return first_line(process / "comm") == daemon_name && waits_for_signal(process);
}

std::filesystem::path process_folder(std::int32_t pid) {
    return std::filesystem::path("/proc") / std::to_string(pid);
}

std::vector<std::int32_t> running_daemons() {
    std::vector<std::int32_t> found;
    std::error_code error;
    for (const std::filesystem::path& entry : paths_in("/proc", error)) {
        const std::string name = entry.filename();
        std::int32_t pid = 0;
        const auto [stop, bad] = std::from_chars(name.data(), name.data() + name.size(), pid);
        if (bad == std::errc{} && stop == name.data() + name.size() && is_daemon(entry)) found.push_back(pid);
    }
    return found;
}

class Release final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "takes control of a running daemon's cameras away from their clients";
        line.description =
            "Frees a GigE Vision camera of this machine that a client holds: the client's acquisition ends, GevHeartbeatTimeout goes back to gige.heartbeat_timeout_ms, and the next client may take control. "
            "Sends SIGUSR2 to obscurad, which its user and root may do.";
        line.number("--pid", &pid_, "PID", "Process id of the daemon, where several run", 1, 4'194'304);
        line.examples = {"obscura release", "obscura release --pid 4711",
                         "sudo systemctl kill --signal=SIGUSR2 obscurad"};
    }

    int run() override {
        if (pid_ == 0) {
            const std::vector<std::int32_t> daemons = running_daemons();
            if (daemons.empty()) throw HardwareError("obscura release: no obscurad runs on this machine");
            if (daemons.size() > 1)
                throw host::UsageError(
                    fmt::format("obscura release: several daemons run: choose one by --pid: {}",
                                fmt::join(daemons, ", ")));
            pid_ = daemons.front();
        } else if (!is_daemon(process_folder(pid_))) {
            throw HardwareError(fmt::format("obscura release: process {} is no running obscurad", pid_));
        }
        if (kill(static_cast<pid_t>(pid_), SIGUSR2) != 0)
            throw HardwareError(fmt::format("obscura release: process {}: {}{}", pid_, std::strerror(errno),
                                            errno == EPERM ? ": only root and the daemon's user may" : ""));
        fmt::print("the clients of obscurad (process {}) lose control of its cameras\n", pid_);
        return exit_ok;
    }

private:
    std::int32_t pid_ = 0;
};

} // namespace

std::unique_ptr<Verb> make_release() {
    return std::make_unique<Release>();
}

} // namespace obscura::tools
