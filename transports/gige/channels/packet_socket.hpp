// SPDX-License-Identifier: Apache-2.0
// UDP socket of the stream: collects packets as header and body pieces and sends them in batches.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "transports/gige/channels/network_interface.hpp"
#include "transports/gige/wire/send_backend.hpp"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <span>

namespace obscura::transports::gige {

/// Backend for this interface; resolves SendBackend::automatic.
[[nodiscard]] SendBackend choose_backend(SendBackend wanted, const NetworkInterface& network);

/// Batching sender of UDP packets. Nothing is copied: the pieces must stay valid until flush(). Neither add()
/// nor flush() allocates, locks or throws. Thread-bound except for the counters.
class PacketSocket {
public:
    static constexpr std::size_t batch_packets = 64;

    /// Binds to the interface's address and any port. Throws HardwareError.
    void open(const NetworkInterface& network, std::size_t send_buffer_bytes);
    void close() noexcept { fd_ = {}; }
    [[nodiscard]] std::uint16_t port() const noexcept { return port_; }

    void set_backend(SendBackend backend) noexcept { backend_ = backend; }
    void set_destination(std::uint32_t ip, std::uint16_t port) noexcept;
    void set_do_not_fragment(bool on) noexcept;

    /// Queues one packet of a header and up to three pieces; flushes first when the batch is full.
    void add(std::span<const std::uint8_t> header, std::span<const std::uint8_t> first,
             std::span<const std::uint8_t> second = {}, std::span<const std::uint8_t> third = {}) noexcept;
    void flush() noexcept;
    [[nodiscard]] std::size_t queued() const noexcept { return queued_; }

    [[nodiscard]] std::uint64_t packets() const noexcept { return packets_.load(std::memory_order_relaxed); }
    [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_.load(std::memory_order_relaxed); }
    /// Packets that the kernel refused.
    [[nodiscard]] std::uint64_t errors() const noexcept { return errors_.load(std::memory_order_relaxed); }

private:
    void address(msghdr& message) noexcept;
    std::size_t send_from(std::size_t first) noexcept;
    void send_queued(std::size_t first) noexcept;
    void coalesce() noexcept;

    FileDescriptor fd_;
    std::uint16_t port_ = 0;
    SendBackend backend_ = SendBackend::sendmmsg;
    sockaddr_in destination_{};
    bool connected_ = false; ///< to `destination_`: saves the kernel a route look-up for each packet
    std::array<mmsghdr, batch_packets> messages_{};
    std::array<std::array<iovec, 4>, batch_packets> pieces_{};
    std::size_t queued_ = 0;
    // Super-packets: each takes the pieces of up to gso_segments packets of one size.
    static constexpr std::size_t gso_segments = 40;
    struct alignas(cmsghdr) SegmentSize {
        std::array<std::uint8_t, CMSG_SPACE(sizeof(std::uint16_t))> bytes;
    };
    std::array<iovec, batch_packets * 4> gso_pieces_{};
    std::array<mmsghdr, batch_packets> gso_messages_{};
    std::array<SegmentSize, batch_packets> gso_sizes_{};
    std::array<std::uint32_t, batch_packets> gso_packets_{};
    std::size_t gso_count_ = 0;
    std::atomic<std::uint64_t> packets_{0}, bytes_{0}, errors_{0};
};

} // namespace obscura::transports::gige
