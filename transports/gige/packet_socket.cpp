#include "transports/gige/packet_socket.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

namespace obscura::transports::gige {

void PacketSocket::open(const NetworkInterface& network, std::size_t send_buffer_bytes) {
    fd_ = FileDescriptor(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (fd_.get() < 0)
        throw HardwareError(fmt::format("gige: no socket to be had: {}", std::strerror(errno)));
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = htonl(network.address);
    if (bind(fd_.get(), reinterpret_cast<const sockaddr*>(&a), sizeof a) != 0)
        throw HardwareError(fmt::format("gige: cannot bind a stream socket to {}: {}",
                                        dotted(network.address), std::strerror(errno)));
    socklen_t bytes = sizeof a;
    getsockname(fd_.get(), reinterpret_cast<sockaddr*>(&a), &bytes);
    port_ = ntohs(a.sin_port);
    const int buffer = static_cast<int>(std::min<std::size_t>(send_buffer_bytes, 1U << 30));
    setsockopt(fd_.get(), SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
    // A link that stands still must not hold the sender for ever.
    timeval patience{};
    patience.tv_usec = 50'000;
    setsockopt(fd_.get(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    in_addr interface {};
    interface.s_addr = htonl(network.address);
    setsockopt(fd_.get(), IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface);
}

void PacketSocket::set_destination(std::uint32_t ip, std::uint16_t port) noexcept {
    destination_ = {};
    destination_.sin_family = AF_INET;
    destination_.sin_addr.s_addr = htonl(ip);
    destination_.sin_port = htons(port);
}

void PacketSocket::set_do_not_fragment(bool on) noexcept {
    const int mode = on ? IP_PMTUDISC_DO : IP_PMTUDISC_DONT;
    setsockopt(fd_.get(), IPPROTO_IP, IP_MTU_DISCOVER, &mode, sizeof mode);
}

void PacketSocket::add(std::span<const std::uint8_t> header, std::span<const std::uint8_t> first,
                       std::span<const std::uint8_t> second, std::span<const std::uint8_t> third) noexcept {
    if (queued_ == batch_packets) flush();
    auto& pieces = pieces_[queued_];
    std::size_t n = 0;
    for (const std::span<const std::uint8_t> piece : {header, first, second, third})
        if (!piece.empty()) pieces[n++] = {const_cast<std::uint8_t*>(piece.data()), piece.size()};
    msghdr& message = messages_[queued_].msg_hdr;
    message.msg_name = &destination_;
    message.msg_namelen = sizeof destination_;
    message.msg_iov = pieces.data();
    message.msg_iovlen = n;
    ++queued_;
}

std::size_t PacketSocket::send_from(std::size_t first) noexcept {
    if (backend_ == SendBackend::sendto) {
        const ssize_t n = sendmsg(fd_.get(), &messages_[first].msg_hdr, MSG_NOSIGNAL);
        if (n < 0) return 0;
        messages_[first].msg_len = static_cast<unsigned>(n);
        return 1;
    }
    const int n =
        sendmmsg(fd_.get(), &messages_[first], static_cast<unsigned>(queued_ - first), MSG_NOSIGNAL);
    return n < 0 ? 0 : static_cast<std::size_t>(n);
}

void PacketSocket::flush() noexcept {
    int timeouts = 0;
    std::uint64_t bytes = 0, packets = 0, errors = 0;
    for (std::size_t done = 0; done < queued_;) {
        const std::size_t n = send_from(done);
        for (std::size_t i = done; i < done + n; ++i)
            bytes += messages_[i].msg_len;
        packets += n;
        done += n;
        if (n != 0 || errno == EINTR) continue;
        if ((errno == EAGAIN || errno == EWOULDBLOCK) && ++timeouts < 4) continue;
        // This one cannot be sent (link down, no route, too big): it is lost as it would be on the wire.
        ++errors;
        ++done;
    }
    queued_ = 0;
    packets_.fetch_add(packets, std::memory_order_relaxed);
    bytes_.fetch_add(bytes, std::memory_order_relaxed);
    errors_.fetch_add(errors, std::memory_order_relaxed);
}

} // namespace obscura::transports::gige
