// SPDX-License-Identifier: Apache-2.0
// Listening sockets, TCP and Unix.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "service/permission.hpp"

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace obscura::service {

/// A socket that clients connect to. A Unix socket is removed at the end.
class Listener {
public:
    /// Listens at "127.0.0.1:5152"; port 0: any free one. Throws Error (exit_usage) for an address that is
    /// not of the loopback interface unless clients need a token, HardwareError if it cannot be used.
    [[nodiscard]] static Listener tcp(const std::string& address, bool needs_token = false);
    /// Creates a socket for the user and the group of this process. One that is left over at that path is
    /// replaced, one that is served is not. Throws HardwareError.
    [[nodiscard]] static Listener unix_socket(const std::filesystem::path& path);
    ~Listener();
    Listener(Listener&&) noexcept = default;
    Listener& operator=(Listener&&) = delete;

    [[nodiscard]] int socket() const noexcept { return socket_.get(); }
    /// "127.0.0.1:5152", or the path.
    [[nodiscard]] const std::string& address() const noexcept { return address_; }
    /// Whether it is a Unix socket, whose clients the kernel identifies.
    [[nodiscard]] bool is_unix() const noexcept { return !file_.empty(); }
    /// The next client, non-blocking; empty: none waits.
    [[nodiscard]] FileDescriptor accept() const;

private:
    Listener(FileDescriptor socket, std::string address, std::filesystem::path file);

    FileDescriptor socket_;
    std::string address_;
    std::filesystem::path file_;
};

/// Port of a TCP listener.
[[nodiscard]] std::uint16_t port_of(const Listener& listener);
/// What the program at the other end of a Unix socket may do: admin as root, the user of this process or a
/// member of `admin_group`, scene as a member of this process's group, else view.
[[nodiscard]] Permission permission_of_peer(int socket, std::optional<gid_t> admin_group = {});
/// Address of the client of a TCP socket, without its port.
[[nodiscard]] std::string address_of_peer(int socket);

} // namespace obscura::service
