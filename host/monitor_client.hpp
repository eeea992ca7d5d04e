// SPDX-License-Identifier: Apache-2.0
// Clients of the daemons of this machine: connection to a monitor socket, search for the daemons.
#pragma once

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "host/call_client.hpp"

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

/// Why nothing takes connections at a Unix socket; empty: something does, and may answer. Does not wait.
[[nodiscard]] std::string refusal_of_socket(const std::filesystem::path& socket);

/// A connection to the monitor socket of one daemon, which takes the calls of the permission view.
/// Thread-bound.
class MonitorClient {
public:
    /// Waits for 5 s at most. Throws HardwareError if nothing serves the socket, NoAnswer if that is too
    /// busy.
    explicit MonitorClient(const std::filesystem::path& socket);

    /// Makes a call and waits for its answer, for 5 s at most. Throws HardwareError if the daemon goes, is
    /// silent (NoAnswer) or refuses.
    [[nodiscard]] CallClient::Answer call(const std::string& name,
                                          const nlohmann::ordered_json& fields = nullptr);
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

private:
    std::filesystem::path path_;
    CallClient client_;
};

constexpr const char* no_daemon_here =
    "no daemon with a monitor socket runs here (monitor.socket; --socket PATH)";

/// What daemons do, as their call `state` tells it.
struct DaemonStates {
    std::vector<nlohmann::ordered_json> states;
    /// One line for each daemon that runs and does not answer, as one that is stopped or hangs.
    std::vector<std::string> silent;
};
/// Help of an option that says which daemon is meant, for all of these functions.
constexpr const char* which_daemon_help =
    "Which daemon is meant: the path of its monitor.socket, or the name of its configuration, as \"demo\" of demo.toml";

/// Asks the daemon that `socket` means: a path, or the name of its configuration, the file without folder and
/// ending; if that is empty, all daemons of this machine that this user may ask, each for 5 s at most. Throws
/// HardwareError if none answers, with the reason.
[[nodiscard]] DaemonStates daemon_states(const std::string& socket);

/// The daemon that `socket` means as in daemon_states(); if that is empty, the only one of this machine that
/// this user may ask. Throws HardwareError if there is none, Error (exit_usage) with their sockets if there
/// are several; `program` stands in front of the messages.
[[nodiscard]] MonitorClient connect_to_daemon(const std::string& program, const std::string& socket);

} // namespace obscura::host
