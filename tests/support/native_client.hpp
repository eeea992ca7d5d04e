// SPDX-License-Identifier: Apache-2.0
// Client of the native protocol that sends what a test wants to send.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "service/limits.hpp"
#include "service/message.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/service_bench.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace obscura::test {

/// A message of the server.
struct Message {
    service::Frame frame;
    nlohmann::json head;
    std::string body;
};

/// The client's side of a connection of the native protocol.
class NativeClient {
public:
    explicit NativeClient(const std::string& path, bool greet = true)
        : socket_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path.copy(address.sun_path, path.size());
        connect(address);
        if (!greet) return;
        request(1, {{"call", "hello"}});
        const std::optional<Message> answer = next();
        if (!answer || answer->frame.kind != service::MessageKind::answer)
            throw std::runtime_error("no answer to hello");
    }
    /// From an address of the loopback interface, without hello.
    static NativeClient over_tcp(std::uint16_t port, const std::string& from = "127.0.0.1") {
        NativeClient client;
        client.socket_ = FileDescriptor(::socket(AF_INET, SOCK_STREAM, 0));
        sockaddr_in address{};
        address.sin_family = AF_INET;
        if (::inet_pton(AF_INET, from.c_str(), &address.sin_addr) != 1 ||
            ::bind(client.socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
            throw std::runtime_error("no address");
        address.sin_port = htons(port);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        client.connect(address);
        return client;
    }
    void write(std::string_view text) { send_all(socket_, text); }
    void request(std::uint32_t id, nlohmann::json head) {
        write(service::make_message(service::MessageKind::request, id, std::move(head)).start);
    }
    /// None: the server has ended the connection, or does not answer.
    std::optional<Message> next() {
        const auto start = read(service::Frame::bytes);
        if (!start) return {};
        service::Limits wide;
        wide.body_bytes = std::uint64_t{1} << 30;
        Message message{service::read_frame(*start, wide), {}, {}};
        message.head = service::read_head(read(message.frame.head_bytes).value(), wide);
        message.body = read(message.frame.body_bytes).value();
        return message;
    }
    /// The next message that is no event.
    Message answer(int* file = nullptr) {
        file_ = file;
        while (true) {
            std::optional<Message> message = next();
            REQUIRE(message);
            if (message->frame.kind != service::MessageKind::event) return *message;
        }
    }
    void hang_up() { socket_ = FileDescriptor(); }

private:
    NativeClient() = default;
    template<typename Address>
    void connect(const Address& address) {
        const timeval timeout{20, 0};
        ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
        // Thrown, not asserted, because other threads make clients too.
        if (::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
            throw std::runtime_error("no connection");
    }
    std::optional<std::string> read(std::size_t bytes) {
        std::string text(bytes, '\0');
        for (std::size_t at = 0; at < bytes;) {
            iovec part{text.data() + at, bytes - at};
            alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))];
            msghdr message{};
            message.msg_iov = &part;
            message.msg_iovlen = 1;
            message.msg_control = control;
            message.msg_controllen = sizeof control;
            const ssize_t got = ::recvmsg(socket_.get(), &message, MSG_CMSG_CLOEXEC);
            if (got <= 0) return {};
            if (const cmsghdr* const rights = CMSG_FIRSTHDR(&message); rights != nullptr && file_ != nullptr)
                std::memcpy(file_, CMSG_DATA(rights), sizeof *file_);
            at += static_cast<std::size_t>(got);
        }
        return text;
    }

    FileDescriptor socket_;
    int* file_ = nullptr; ///< takes a descriptor that comes along
};

} // namespace obscura::test
