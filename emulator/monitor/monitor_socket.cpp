// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/monitor_socket.hpp"

#include "core/error.hpp"
#include "host/monitor_connection.hpp"
#include "host/monitor_paths.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace obscura::emulator {
namespace {

// Requests of one client that are answered in one call of serve(), so that no client holds up the caller.
constexpr int max_requests = 16;

FileDescriptor packet_socket() {
    return FileDescriptor(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

/// Whether all of it was sent; does not wait.
bool send_answer(int client, const MonitorAnswer& answer) {
    iovec text{const_cast<char*>(answer.text.data()), answer.text.size()};
    msghdr message{};
    message.msg_iov = &text;
    message.msg_iovlen = 1;
    alignas(cmsghdr) std::array<char, CMSG_SPACE(host::monitor_descriptors * sizeof(int))> ancillary{};
    if (const std::size_t bytes = answer.descriptors.size() * sizeof(int); bytes > 0) {
        message.msg_control = ancillary.data();
        message.msg_controllen = CMSG_SPACE(bytes);
        cmsghdr* const rights = CMSG_FIRSTHDR(&message);
        rights->cmsg_level = SOL_SOCKET;
        rights->cmsg_type = SCM_RIGHTS;
        rights->cmsg_len = CMSG_LEN(bytes);
        std::memcpy(CMSG_DATA(rights), answer.descriptors.data(), bytes);
    }
    return ::sendmsg(client, &message, MSG_NOSIGNAL | MSG_DONTWAIT) ==
           static_cast<ssize_t>(answer.text.size());
}

} // namespace

MonitorSocket::MonitorSocket(std::filesystem::path path, Answer answer)
    : path_(std::move(path)), answer_(std::move(answer)), request_(host::monitor_request_bytes + 1) {}

MonitorSocket::~MonitorSocket() {
    stop();
}

void MonitorSocket::start() {
    const auto refuse = [this](const std::string& why) {
        throw HardwareError(fmt::format("monitor.socket: {}: {}", path_.string(), why));
    };
    if (path_.native().size() > host::max_socket_path_bytes())
        refuse(fmt::format("a path of at most {} bytes is allowed", host::max_socket_path_bytes()));
    if (const std::string why = host::prepare_socket_folder(path_.parent_path()); !why.empty()) refuse(why);
    std::error_code error;
    if (std::filesystem::exists(path_, error)) {
        if (!std::filesystem::is_socket(path_, error)) refuse("exists, and is no socket");
        if (host::connect_to_monitor(path_)) refuse("another daemon serves it");
        std::filesystem::remove(path_, error);
    }
    FileDescriptor listener = packet_socket();
    const sockaddr_un address = host::monitor_address(path_);
    if (!listener || ::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        refuse(std::strerror(errno));
    // The umask of a service keeps its group from writing, and so from connecting.
    if (::chmod(path_.c_str(), 0660) != 0 || ::listen(listener.get(), max_clients) != 0)
        refuse(std::strerror(errno));
    listener_ = std::move(listener);
}

void MonitorSocket::stop() {
    clients_.clear();
    if (!listener_) return;
    listener_ = FileDescriptor();
    std::error_code error;
    std::filesystem::remove(path_, error);
}

void MonitorSocket::serve(Time now) {
    if (!listener_) return;
    // Answer first: clients with a request are not idle.
    std::erase_if(clients_, [this, now](Client& client) { return !answer_client(client, now); });
    accept_clients(now);
}

void MonitorSocket::accept_clients(Time now) {
    while (clients_.size() < max_clients || make_room(now)) {
        FileDescriptor socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
        if (!socket) return;
        Client client{std::move(socket), now};
        if (answer_client(client, now)) clients_.push_back(std::move(client));
    }
}

/// Disconnects the client that may go first, if its time has come and another one waits.
bool MonitorSocket::make_room(Time now) {
    pollfd waiting{listener_.get(), POLLIN, 0};
    if (::poll(&waiting, 1, 0) != 1) return false;
    const auto first =
        std::min_element(clients_.begin(), clients_.end(),
                         [](const Client& a, const Client& b) { return a.may_go() < b.may_go(); });
    if (now < first->may_go()) return false;
    clients_.erase(first);
    return true;
}

bool MonitorSocket::answer_client(Client& client, Time now) {
    for (int i = 0; i < max_requests; ++i) {
        const ssize_t bytes = ::recv(client.socket.get(), request_.data(), request_.size(), 0);
        if (bytes < 0) return errno == EAGAIN || errno == EINTR;
        if (bytes == 0) return false;
        client.asked = now;
        client.mute = false;
        // One byte more than allowed is read of a longer packet; its text is refused as such.
        if (!send_answer(client.socket.get(), answer_({request_.data(), static_cast<std::size_t>(bytes)})))
            return false;
    }
    return true;
}

} // namespace obscura::emulator
