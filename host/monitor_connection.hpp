// SPDX-License-Identifier: Apache-2.0
// Client side of the monitor socket: connection, requests, answers with descriptors.
#pragma once

#include "core/io/file_descriptor.hpp"

#include <sys/types.h>
#include <sys/un.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace obscura::host {

/// Largest request and largest answer, bytes. The state of 16 cameras whose counters are large takes half of
/// it, and Linux sends packets of 208 KiB unless it is configured otherwise.
constexpr std::size_t monitor_request_bytes = 4096, monitor_answer_bytes = 192 << 10;
/// Most descriptors of an answer.
constexpr std::size_t monitor_descriptors = 2;

/// Address of a monitor socket, whose path is cut at max_socket_path_bytes().
[[nodiscard]] sockaddr_un monitor_address(const std::filesystem::path& path);

/// Longest wait of a client for the server, s.
constexpr int monitor_timeout_s = 5;
/// Connects to a monitor socket; an empty descriptor if that is not possible, with the reason in errno. Its
/// calls wait for monitor_timeout_s at most. They and those below go on where the process is stopped and
/// continued meanwhile. `wait`: also for a daemon that has not accepted those before.
[[nodiscard]] FileDescriptor connect_to_monitor(const std::filesystem::path& path, bool wait = true);
/// Sends a request; false: not sent, with the reason in errno.
[[nodiscard]] bool send_request(int socket, std::string_view request);
/// Receives an answer as recv(2) does; descriptors that come with it are appended to `descriptors`, or closed
/// if that is null.
[[nodiscard]] ssize_t receive_answer(int socket, std::span<char> answer,
                                     std::vector<FileDescriptor>* descriptors);

} // namespace obscura::host
