// SPDX-License-Identifier: Apache-2.0
#include "service/listener.hpp"

#include "core/error.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace obscura::service {
namespace {

constexpr int waiting_clients = 64;
constexpr int socket_flags = SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK;

[[noreturn]] void refuse_address(const std::string& address, const std::string& why) {
    throw HardwareError(fmt::format("{}: {}", address, why));
}

sockaddr_in parse(const std::string& text, bool needs_token) {
    const std::size_t colon = text.rfind(':');
    const std::string host = text.substr(0, colon);
    std::uint16_t port = 0;
    const std::string_view digits =
        colon == std::string::npos ? std::string_view() : std::string_view(text).substr(colon + 1);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size() ||
        ::inet_pton(AF_INET, host == "localhost" ? "127.0.0.1" : host.c_str(), &address.sin_addr) != 1)
        throw Error(exit_usage,
                    fmt::format("{}: no address, allowed ADDRESS:PORT such as 127.0.0.1:5152", text));
    if (!needs_token && ntohl(address.sin_addr.s_addr) >> 24 != IN_LOOPBACKNET)
        throw Error(
            exit_usage,
            fmt::format(
                "{}: only addresses of the loopback interface are allowed (127.0.0.1) without --token-file; "
                "from another machine: ssh -L {}:127.0.0.1:{} HOST",
                text, port, port));
    return address;
}

} // namespace

Listener::Listener(FileDescriptor socket, std::string address, std::filesystem::path file)
    : socket_(std::move(socket)), address_(std::move(address)), file_(std::move(file)) {}

Listener::~Listener() {
    if (!socket_ || file_.empty()) return;
    std::error_code error;
    std::filesystem::remove(file_, error);
}

Listener Listener::tcp(const std::string& text, bool needs_token) {
    sockaddr_in address = parse(text, needs_token);
    FileDescriptor socket(::socket(AF_INET, socket_flags, 0));
    const int on = 1;
    ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    socklen_t size = sizeof address;
    if (!socket || ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(socket.get(), waiting_clients) != 0 ||
        ::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0)
        refuse_address(text, std::strerror(errno));
    char host[INET_ADDRSTRLEN]{};
    ::inet_ntop(AF_INET, &address.sin_addr, host, sizeof host);
    return {std::move(socket), fmt::format("{}:{}", host, ntohs(address.sin_port)), {}};
}

Listener Listener::unix_socket(const std::filesystem::path& path) {
    const std::string& text = path.native();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (text.empty() || text.size() >= sizeof address.sun_path)
        refuse_address(text, fmt::format("a path of 1 to {} bytes is allowed", sizeof address.sun_path - 1));
    text.copy(address.sun_path, text.size());
    const auto* const raw = reinterpret_cast<const sockaddr*>(&address);
    std::error_code error;
    if (std::filesystem::exists(path, error)) {
        if (!std::filesystem::is_socket(path, error)) refuse_address(text, "exists, and is no socket");
        const FileDescriptor probe(::socket(AF_UNIX, socket_flags, 0));
        // EAGAIN: it has not accepted those before; EPROTOTYPE: it is no server of streams.
        if (::connect(probe.get(), raw, sizeof address) == 0 || errno == EAGAIN || errno == EPROTOTYPE)
            refuse_address(text, "another server listens there");
        std::filesystem::remove(path, error);
    }
    FileDescriptor socket(::socket(AF_UNIX, socket_flags, 0));
    // The umask may keep the group from writing, and so from connecting.
    if (!socket || ::bind(socket.get(), raw, sizeof address) != 0 || ::chmod(text.c_str(), 0660) != 0 ||
        ::listen(socket.get(), waiting_clients) != 0)
        refuse_address(text, std::strerror(errno));
    return {std::move(socket), text, path};
}

std::uint16_t port_of(const Listener& listener) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    const bool known = ::getsockname(listener.socket(), reinterpret_cast<sockaddr*>(&address), &size) == 0;
    return known && address.sin_family == AF_INET ? ntohs(address.sin_port) : 0;
}

Permission permission_of_peer(int socket, std::optional<gid_t> admin_group) {
    ucred peer{};
    socklen_t size = sizeof peer;
    if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return Permission::view;
    if (peer.uid == 0 || peer.uid == ::geteuid()) return Permission::admin;
    std::vector<gid_t> groups(NGROUPS_MAX);
    size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
    if (::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) != 0) size = 0;
    groups.resize(size / sizeof(gid_t));
    groups.push_back(peer.gid);
    const auto is_member = [&groups](gid_t group) {
        return std::find(groups.begin(), groups.end(), group) != groups.end();
    };
    if (admin_group && is_member(*admin_group)) return Permission::admin;
    return is_member(::getegid()) ? Permission::scene : Permission::view;
}

std::string address_of_peer(int socket) {
    sockaddr_in peer{};
    socklen_t size = sizeof peer;
    char text[INET_ADDRSTRLEN]{};
    if (::getpeername(socket, reinterpret_cast<sockaddr*>(&peer), &size) == 0)
        ::inet_ntop(AF_INET, &peer.sin_addr, text, sizeof text);
    return text;
}

FileDescriptor Listener::accept() const {
    FileDescriptor client(::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    const int on = 1; // no use, and no harm, for a Unix socket
    if (client) ::setsockopt(client.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return client;
}

} // namespace obscura::service
