// SPDX-License-Identifier: Apache-2.0
// Paths of the local sockets of the daemons on this machine.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::host {

/// Values of monitor.socket that are no path.
constexpr const char* automatic_monitor = "auto";
constexpr const char* no_monitor = "off";

/// Most bytes of a socket's path (unix(7)).
[[nodiscard]] std::size_t max_socket_path_bytes() noexcept;

/// Folder of this process's monitor socket for monitor.socket = "auto": RUNTIME_DIRECTORY as systemd sets it,
/// the folder obscura in XDG_RUNTIME_DIR, /run/obscura for root, or a folder of this user's in /tmp.
[[nodiscard]] std::filesystem::path own_monitor_folder();
/// The socket in it: its name has the process's number, so that daemons can stand side by side.
[[nodiscard]] std::filesystem::path own_monitor_socket();

/// Value of control.unix_socket that is no path.
constexpr const char* automatic_calls = "auto";
/// The socket of calls for it: `calls` in the folder that systemd made for this service, so that its path
/// stays; else beside the monitor socket, with the process's number.
[[nodiscard]] std::filesystem::path own_calls_socket();

/// Creates the folder of a socket, for the user and the group of this process, where it is missing. Returns
/// why it will not do: the system's reason, or that it belongs to another user; empty: it does.
[[nodiscard]] std::string prepare_socket_folder(const std::filesystem::path& folder);

/// Removes sockets of those names from `folder` whose processes have gone, as after SIGKILL.
void remove_left_over_sockets(const std::filesystem::path& folder);

/// Monitor sockets in all folders that own_monitor_folder() may give to daemons of services and of this user,
/// in order of their names; some may be left over from daemons that have gone.
[[nodiscard]] std::vector<std::filesystem::path> monitor_sockets();

} // namespace obscura::host
