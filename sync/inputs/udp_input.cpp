// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/udp_input.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "sync/clock_reading.hpp"
#include "sync/inputs/ipv4_endpoint.hpp"
#include "sync/inputs/rate_limit.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace obscura::sync {
namespace {

constexpr std::uint16_t lowest_port = 1;
constexpr const char* example_address = "127.0.0.1:5002";
constexpr std::array<std::uint8_t, 4> magic{'O', 'B', 'T', 'R'};

class UdpInput final : public EdgeInput {
public:
    UdpInput(const std::string& table, const std::string& text, const UdpTriggers& triggers)
        : triggers_(triggers),
          limit_(triggers.max_rate_hz),
          fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
        const std::string key = table + ".listen";
        const sockaddr_in address = parse_ipv4_endpoint(key, text, lowest_port, example_address);
        if (!fd_ || ::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
            throw HardwareError(fmt::format("{}: {}: {}", key, text, std::strerror(errno)));
        const int on = 1;
        ::setsockopt(fd_.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
        ::setsockopt(fd_.get(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
    }

    int wait(std::int64_t timeout_ns, std::span<Edge> edges) noexcept override {
        pollfd poll{fd_.get(), POLLIN, 0};
        const timespec limit{timeout_ns / ns_per_s, timeout_ns % ns_per_s};
        if (::ppoll(&poll, 1, &limit, nullptr) <= 0) return 0;
        int count = 0, datagrams = udp_datagrams_per_wait;
        while (count < static_cast<int>(edges.size()) &&
               receive(edges[static_cast<std::size_t>(count)], datagrams))
            ++count;
        if (datagrams < 0 && count == 0) {
            const timespec rest{0, udp_rest_ns};
            ::clock_nanosleep(CLOCK_MONOTONIC, 0, &rest, nullptr);
        }
        return count;
    }

    [[nodiscard]] std::uint64_t refused() const noexcept override { return refused_; }

private:
    // Find the next trigger in the queue; drop other datagrams before it, but look at no more than
    // `datagrams`, so that a flood of them cannot keep the thread here.
    bool receive(Edge& edge, int& datagrams) noexcept {
        while (datagrams-- > 0) {
            std::array<std::uint8_t, 64> bytes;
            alignas(cmsghdr) std::array<char, 128> control;
            iovec data{bytes.data(), bytes.size()};
            msghdr header{};
            header.msg_iov = &data;
            header.msg_iovlen = 1;
            header.msg_control = control.data();
            header.msg_controllen = control.size();
            const ssize_t size = ::recvmsg(fd_.get(), &header, MSG_DONTWAIT);
            if (size < 0) return false;
            count_overflow(header);
            UdpTriggerMessage message;
            const bool empty = triggers_.accept_empty && size == 0;
            if (!empty && !decode({bytes.data(), static_cast<std::size_t>(size)}, message)) {
                ++refused_;
                continue;
            }
            timespec now{};
            clock_gettime(CLOCK_MONOTONIC, &now);
            const Time seen{to_ns(now)};
            if (!limit_.allows(seen)) {
                ++refused_;
                continue;
            }
            edge.sequence = message.sequence;
            edge.at = message.tai_ns != 0
                          ? tai_edge(message.tai_ns, seen)
                          : plausible_edge(arrival_ns(header), monotonic_minus(CLOCK_REALTIME), seen);
            return true;
        }
        return false;
    }

    // A sender's CLOCK_TAI may lack the offset from UTC that this machine's clock knows, or the reverse: they
    // are seconds apart, and at most one is plausible.
    [[nodiscard]] Time tai_edge(std::int64_t tai_ns, Time seen) const noexcept {
        if (triggers_.clock != nullptr)
            if (const Time edge = plausible_edge(tai_ns, -triggers_.clock->tai_offset_ns(), seen);
                edge != seen)
                return edge;
        return plausible_edge(tai_ns, monotonic_minus(CLOCK_TAI), seen);
    }

    /// Sets `value` to what the kernel says of the datagram under `type`; false: nothing.
    template<typename T>
    static bool read_control(msghdr& header, int type, T& value) noexcept {
        for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
            if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != type) continue;
            std::memcpy(&value, CMSG_DATA(c), sizeof value);
            return true;
        }
        return false;
    }

    // CLOCK_REALTIME; 0 (never plausible) without a kernel stamp.
    static std::int64_t arrival_ns(msghdr& header) noexcept {
        timespec stamp{};
        return read_control(header, SCM_TIMESTAMPNS, stamp) ? to_ns(stamp) : 0;
    }

    // The kernel counts, modulo 2^32, the datagrams for which the socket had no room.
    void count_overflow(msghdr& header) noexcept {
        std::uint32_t overflow = 0;
        if (!read_control(header, SO_RXQ_OVFL, overflow)) return;
        refused_ += overflow - overflow_;
        overflow_ = overflow;
    }

    const UdpTriggers triggers_;
    RateLimit limit_;
    FileDescriptor fd_;
    std::uint64_t refused_ = 0;
    std::uint32_t overflow_ = 0;
};

} // namespace

bool decode(std::span<const std::uint8_t> bytes, UdpTriggerMessage& message) noexcept {
    if (bytes.size() != udp_trigger_bytes || !std::equal(magic.begin(), magic.end(), bytes.begin()))
        return false;
    std::uint32_t sequence = 0;
    for (std::size_t i = 4; i < 8; ++i)
        sequence = sequence << 8 | bytes[i];
    std::uint64_t tai = 0;
    for (std::size_t i = 8; i < 16; ++i)
        tai = tai << 8 | bytes[i];
    // Accept time stamps up to the year 2116: later ones are invalid, and sums with them could overflow.
    if (tai >= std::uint64_t{1} << 62) return false;
    message = {sequence, static_cast<std::int64_t>(tai)};
    return true;
}

std::array<std::uint8_t, udp_trigger_bytes> encode(const UdpTriggerMessage& message) noexcept {
    std::array<std::uint8_t, udp_trigger_bytes> bytes{};
    std::copy(magic.begin(), magic.end(), bytes.begin());
    for (std::size_t i = 0; i < 4; ++i)
        bytes[4 + i] = static_cast<std::uint8_t>(message.sequence >> (24 - 8 * i));
    for (std::size_t i = 0; i < 8; ++i)
        bytes[8 + i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(message.tai_ns) >> (56 - 8 * i));
    return bytes;
}

sockaddr_in parse_udp_address(const std::string& text) {
    return parse_ipv4_endpoint(text, lowest_port, example_address);
}

std::unique_ptr<EdgeInput> open_udp(const std::string& table, const std::string& address,
                                    const UdpTriggers& triggers) {
    return std::make_unique<UdpInput>(table, address, triggers);
}

} // namespace obscura::sync
