// SPDX-License-Identifier: Apache-2.0
// Client of a daemon's monitor socket.
#pragma once

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::host {

/// A daemon runs, and does not answer in time: it is stopped, hangs, or has too many clients.
class NoAnswer : public HardwareError {
public:
    using HardwareError::HardwareError;
};

/// A connection to one daemon. Thread-bound.
class MonitorClient {
public:
    /// Throws HardwareError if nothing serves the socket. `wait`: for 5 s, should the daemon be too busy to
    /// accept clients; then NoAnswer.
    explicit MonitorClient(const std::filesystem::path& socket, bool wait = true);

    /// Sends a request and waits for its answer, for 5 s at most. Throws HardwareError if the daemon goes, is
    /// silent (NoAnswer) or refuses.
    /// Descriptors that come with the answer are appended to `descriptors`, or closed if that is null.
    [[nodiscard]] nlohmann::ordered_json ask(const nlohmann::ordered_json& request,
                                             std::vector<FileDescriptor>* descriptors = nullptr) const;
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

private:
    std::filesystem::path path_;
    FileDescriptor socket_;
};

constexpr const char* no_daemon_here =
    "no daemon with a monitor socket runs here (monitor.socket; --socket PATH)";

/// What daemons do, as their verb "state" tells it.
struct DaemonStates {
    std::vector<nlohmann::ordered_json> states;
    /// One line for each daemon that runs and does not answer, as one that is stopped or hangs.
    std::vector<std::string> silent;
};
/// Asks the daemon at `socket`; if that is empty, all daemons of this machine that this user may ask, each
/// for 5 s at most. Throws HardwareError if none answers, with the reason.
[[nodiscard]] DaemonStates daemon_states(const std::string& socket);

/// The daemon at `socket`; if that is empty, the only one of this machine that this user may ask. Throws
/// HardwareError if there is none, Error (exit_usage) with their sockets if there are several; `program`
/// stands in front of the messages.
[[nodiscard]] MonitorClient connect_to_daemon(const std::string& program, const std::string& socket);

} // namespace obscura::host
