// SPDX-License-Identifier: Apache-2.0
// A server on a thread of its own, and sockets of its clients.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "service/server.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

namespace obscura::test {

/// Serves from start() on until it is destroyed, which must be before what the server uses.
class ServerThread {
public:
    ~ServerThread() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
    }
    /// Path of a Unix socket.
    [[nodiscard]] std::string path() const { return (folder_.path() / "s").string(); }
    void start(std::unique_ptr<service::Server> server) {
        server_ = std::move(server);
        thread_ = std::thread([this] { server_->run([this] { return stop_.load(); }); });
    }

private:
    TempFolder folder_;
    std::unique_ptr<service::Server> server_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// Waits for what must come true soon.
inline void until(const std::function<bool()>& condition) {
    for (int i = 0; i < 120'000 && !condition(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    REQUIRE(condition());
}

/// Throws, does not assert, because other threads make clients too.
inline FileDescriptor connect_to(const std::string& path) {
    FileDescriptor client(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, path.size());
    const timeval timeout{20, 0};
    ::setsockopt(client.get(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    if (::connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        throw std::runtime_error("no connection");
    return client;
}

/// Sends all, or until the other side is gone.
inline void send_all(const FileDescriptor& client, std::string_view text) {
    while (!text.empty()) {
        const ssize_t bytes = ::send(client.get(), text.data(), text.size(), MSG_NOSIGNAL);
        if (bytes <= 0) return;
        text.remove_prefix(static_cast<std::size_t>(bytes));
    }
}

} // namespace obscura::test
