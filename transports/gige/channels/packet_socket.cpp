// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/packet_socket.hpp"

#include "core/error.hpp"

#include <fmt/format.h>
#include <linux/udp.h>

#include <cerrno>
#include <cstring>

namespace obscura::transports::gige {

SendBackend choose_backend(SendBackend wanted, const NetworkInterface& network) {
    if (wanted != SendBackend::automatic) return wanted;
    // Network cards have a device entry in sysfs; lo, veth, bridges and taps have none.
    const std::string device = "/sys/class/net/" + network.name + "/device";
    const bool card = !network.loopback && access(device.c_str(), F_OK) == 0;
    return card ? SendBackend::gso : SendBackend::sendmmsg;
}

void PacketSocket::open(const NetworkInterface& network, std::size_t send_buffer_bytes) {
    fd_ = FileDescriptor(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (fd_.get() < 0)
        throw HardwareError(fmt::format("gige: cannot open a stream socket: {}", std::strerror(errno)));
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
    // A stalled link must not block the sender for ever.
    timeval timeout{};
    timeout.tv_usec = 50'000;
    setsockopt(fd_.get(), SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
    in_addr interface {};
    interface.s_addr = htonl(network.address);
    setsockopt(fd_.get(), IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface);
}

void PacketSocket::set_destination(std::uint32_t ip, std::uint16_t port) noexcept {
    destination_ = {};
    destination_.sin_family = AF_INET;
    destination_.sin_addr.s_addr = htonl(ip);
    destination_.sin_port = htons(port);
    // Not undone for port 0: that would also take the socket's own port away.
    connected_ = port != 0 && connect(fd_.get(), reinterpret_cast<const sockaddr*>(&destination_),
                                      sizeof destination_) == 0;
}

void PacketSocket::address(msghdr& message) noexcept {
    message.msg_name = connected_ ? nullptr : &destination_;
    message.msg_namelen = connected_ ? 0 : sizeof destination_;
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
    address(message);
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

void PacketSocket::coalesce() noexcept {
    gso_count_ = 0;
    std::size_t used = 0;
    const auto bytes_of = [this](std::size_t i) {
        std::size_t n = 0;
        for (std::size_t k = 0; k < messages_[i].msg_hdr.msg_iovlen; ++k)
            n += pieces_[i][k].iov_len;
        return n;
    };
    for (std::size_t i = 0; i < queued_;) {
        const std::size_t size = bytes_of(i);
        const std::size_t most = std::min<std::size_t>(gso_segments, 65'000 / std::max<std::size_t>(size, 1));
        msghdr& message = gso_messages_[gso_count_].msg_hdr;
        message = {};
        address(message);
        message.msg_iov = &gso_pieces_[used];
        std::size_t packets = 0;
        // All segments have the size of the first; only the last may be shorter.
        for (bool open = true; open && i < queued_ && packets < std::max<std::size_t>(most, 1); ++i) {
            const std::size_t n = bytes_of(i);
            if (n > size) break;
            open = n == size;
            for (std::size_t k = 0; k < messages_[i].msg_hdr.msg_iovlen; ++k)
                gso_pieces_[used++] = pieces_[i][k];
            ++packets;
        }
        message.msg_iovlen = used - static_cast<std::size_t>(message.msg_iov - gso_pieces_.data());
        if (packets > 1) {
            message.msg_control = gso_sizes_[gso_count_].bytes.data();
            message.msg_controllen = sizeof gso_sizes_[gso_count_].bytes;
            cmsghdr* control = CMSG_FIRSTHDR(&message);
            control->cmsg_level = IPPROTO_UDP;
            control->cmsg_type = UDP_SEGMENT;
            control->cmsg_len = CMSG_LEN(sizeof(std::uint16_t));
            const auto segment = static_cast<std::uint16_t>(size);
            std::memcpy(CMSG_DATA(control), &segment, sizeof segment);
        }
        gso_packets_[gso_count_++] = static_cast<std::uint32_t>(packets);
    }
}

void PacketSocket::flush() noexcept {
    if (backend_ == SendBackend::gso && queued_ > 1) {
        coalesce();
        std::size_t done = 0, refusals = 0;
        while (done < gso_count_) {
            const int n = sendmmsg(fd_.get(), &gso_messages_[done], static_cast<unsigned>(gso_count_ - done),
                                   MSG_NOSIGNAL);
            if (n < 0 && (errno == EINTR || (errno == ECONNREFUSED && ++refusals <= gso_count_))) continue;
            if (n <= 0) break;
            for (std::size_t i = done; i < done + static_cast<std::size_t>(n); ++i) {
                packets_.fetch_add(gso_packets_[i], std::memory_order_relaxed);
                bytes_.fetch_add(gso_messages_[i].msg_len, std::memory_order_relaxed);
            }
            done += static_cast<std::size_t>(n);
        }
        if (done == gso_count_) {
            queued_ = 0;
            return;
        }
        // The path refuses super-packets, or this one: send the remaining packets singly and use no further
        // ones.
        backend_ = SendBackend::sendmmsg;
        std::size_t first = 0;
        for (std::size_t i = 0; i < done; ++i)
            first += gso_packets_[i];
        send_queued(first);
        return;
    }
    send_queued(0);
}

void PacketSocket::send_queued(std::size_t first) noexcept {
    int timeouts = 0;
    std::size_t refusals = 0;
    std::uint64_t bytes = 0, packets = 0, errors = 0;
    for (std::size_t done = first; done < queued_;) {
        const std::size_t n = send_from(done);
        for (std::size_t i = done; i < done + n; ++i)
            bytes += messages_[i].msg_len;
        packets += n;
        done += n;
        if (n != 0 || errno == EINTR) continue;
        // The kernel reports an earlier packet without a receiver in place of sending this one.
        if (errno == ECONNREFUSED && ++refusals <= queued_) continue;
        if ((errno == EAGAIN || errno == EWOULDBLOCK) && ++timeouts < 4) continue;
        // Count a packet that cannot be sent (link down, no route, too big) as lost, as it would be on the
        // wire.
        ++errors;
        ++done;
    }
    queued_ = 0;
    packets_.fetch_add(packets, std::memory_order_relaxed);
    bytes_.fetch_add(bytes, std::memory_order_relaxed);
    errors_.fetch_add(errors, std::memory_order_relaxed);
}

} // namespace obscura::transports::gige
