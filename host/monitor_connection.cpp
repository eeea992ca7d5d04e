// SPDX-License-Identifier: Apache-2.0
#include "host/monitor_connection.hpp"

#include "host/monitor_paths.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace obscura::host {
namespace {

/// Room for the descriptors of an answer beside its bytes.
struct Ancillary {
    alignas(cmsghdr) std::array<char, CMSG_SPACE(monitor_descriptors * sizeof(int))> bytes{};
};

/// Result of a call of a socket with a time-out, made again where a stop of the process (SIGSTOP, then
/// SIGCONT) has ended it with EINTR, as Linux does also without a handler. It then has its whole time again.
template<typename Call>
auto unless_interrupted(Call call) {
    auto result = call();
    while (result < 0 && errno == EINTR)
        result = call();
    return result;
}

} // namespace

sockaddr_un monitor_address(const std::filesystem::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string& text = path.native();
    std::memcpy(address.sun_path, text.data(), std::min(text.size(), max_socket_path_bytes()));
    return address;
}

bool send_request(int socket, std::string_view request) {
    return unless_interrupted([&] { return ::send(socket, request.data(), request.size(), MSG_NOSIGNAL); }) >=
           0;
}

ssize_t receive_answer(int socket, std::span<char> answer, std::vector<FileDescriptor>* descriptors) {
    iovec text{answer.data(), answer.size()};
    Ancillary ancillary;
    msghdr message{};
    message.msg_iov = &text;
    message.msg_iovlen = 1;
    message.msg_control = ancillary.bytes.data();
    message.msg_controllen = ancillary.bytes.size();
    const ssize_t bytes = unless_interrupted([&] { return ::recvmsg(socket, &message, MSG_CMSG_CLOEXEC); });
    if (bytes < 0) return bytes;
    for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
        if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
        for (std::size_t at = 0; CMSG_LEN(at + sizeof(int)) <= part->cmsg_len; at += sizeof(int)) {
            int descriptor = -1;
            std::memcpy(&descriptor, CMSG_DATA(part) + at, sizeof descriptor);
            FileDescriptor owned(descriptor);
            if (descriptors != nullptr) descriptors->push_back(std::move(owned));
        }
    }
    return bytes;
}

FileDescriptor connect_to_monitor(const std::filesystem::path& path, bool wait) {
    FileDescriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | (wait ? 0 : SOCK_NONBLOCK), 0));
    const sockaddr_un address = monitor_address(path);
    // Also of connect(), which waits while the server has not accepted those before.
    const timeval timeout{monitor_timeout_s, 0};
    ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
    const auto connect = [&] {
        return ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
    };
    if (unless_interrupted(connect) != 0) return FileDescriptor();
    if (!wait) ::fcntl(socket.get(), F_SETFL, 0);
    return socket;
}

} // namespace obscura::host
