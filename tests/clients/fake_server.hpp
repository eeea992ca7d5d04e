// SPDX-License-Identifier: Apache-2.0
// A server of the native protocol that says what a test wants it to say.
#pragma once

#include "service/limits.hpp"
#include "service/message.hpp"
#include "tests/support/temp_folder.hpp"

#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace obscura::test {

/// The server's side of one connection.
class FakeConnection {
public:
    struct Request {
        std::uint32_t id = 0;
        nlohmann::json head;
    };

    explicit FakeConnection(int socket) : socket_(socket) {}

    /// The next request; id 0: the client has gone.
    [[nodiscard]] Request read() const {
        const std::string start = read_bytes(service::Frame::bytes);
        if (start.size() < service::Frame::bytes) return {};
        const service::Limits limits;
        const service::Frame frame = service::read_frame(start, limits);
        return {frame.id, service::read_head(read_bytes(frame.head_bytes), limits)};
    }
    void send(std::string_view text) const {
        while (!text.empty()) {
            const ssize_t sent = ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
            if (sent <= 0) return;
            text.remove_prefix(static_cast<std::size_t>(sent));
        }
    }
    /// As send(), with files that go along with the first byte.
    void send_files(std::string_view text, const std::vector<int>& files) const {
        iovec part{const_cast<char*>(text.data()), 1};
        std::vector<char> control(CMSG_SPACE(files.size() * sizeof(int)));
        msghdr message{};
        message.msg_iov = &part;
        message.msg_iovlen = 1;
        message.msg_control = control.data();
        message.msg_controllen = control.size();
        cmsghdr* const rights = CMSG_FIRSTHDR(&message);
        rights->cmsg_level = SOL_SOCKET;
        rights->cmsg_type = SCM_RIGHTS;
        rights->cmsg_len = CMSG_LEN(files.size() * sizeof(int));
        std::memcpy(CMSG_DATA(rights), files.data(), files.size() * sizeof(int));
        if (::sendmsg(socket_, &message, MSG_NOSIGNAL) == 1) send(text.substr(1));
    }
    void answer(std::uint32_t id, const nlohmann::json& head = nlohmann::json::object(),
                std::string_view body = {}) const {
        send(message(service::MessageKind::answer, id, head, body));
    }
    void refuse(std::uint32_t id, const nlohmann::json& head) const {
        send(message(service::MessageKind::error, id, head));
    }
    /// A message as bytes; `head` need not be a map.
    static std::string message(service::MessageKind kind, std::uint32_t id, const nlohmann::json& head,
                               std::string_view body = {}) {
        std::string packed;
        nlohmann::json::to_msgpack(head, packed);
        return service::frame_text({kind, id, static_cast<std::uint32_t>(packed.size()), body.size()}) +
               packed + std::string(body);
    }
    /// Answers `hello`.
    void greet() const { answer(read().id, {{"server", "obscura"}, {"version", "fake"}}); }
    /// Waits until the client has gone.
    void wait_for_end() const {
        while (!read_bytes(1).empty()) {
        }
    }

private:
    [[nodiscard]] std::string read_bytes(std::size_t count) const {
        std::string text(count, '\0');
        std::size_t got = 0;
        while (got < count) {
            const ssize_t more = ::recv(socket_, text.data() + got, count - got, 0);
            if (more <= 0) break;
            got += static_cast<std::size_t>(more);
        }
        text.resize(got);
        return text;
    }

    int socket_;
};

/// Accepts one client after the other and plays `script` to each, on a thread of its own; then hangs up.
class FakeServer {
public:
    explicit FakeServer(std::function<void(const FakeConnection&)> script)
        : script_(std::move(script)), listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::memcpy(address.sun_path, this->address().c_str(), this->address().size() + 1);
        if (::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
            ::listen(listener_, 8) != 0)
            throw std::runtime_error("no socket");
        thread_ = std::thread([this] {
            int client = -1;
            while ((client = ::accept(listener_, nullptr, nullptr)) >= 0) {
                script_(FakeConnection(client));
                ::close(client);
            }
        });
    }
    ~FakeServer() {
        ::shutdown(listener_, SHUT_RDWR);
        thread_.join();
        ::close(listener_);
    }
    FakeServer(const FakeServer&) = delete;
    FakeServer& operator=(const FakeServer&) = delete;

    [[nodiscard]] std::string address() const { return (folder_.path() / "socket").string(); }

private:
    TempFolder folder_;
    std::function<void(const FakeConnection&)> script_;
    int listener_;
    std::thread thread_;
};

} // namespace obscura::test
