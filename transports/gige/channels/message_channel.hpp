// SPDX-License-Identifier: Apache-2.0
// GVCP message channel: sends events to the controlling application and repeats them until it acknowledges.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "core/realtime/event_count.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/time.hpp"
#include "transports/gige/channels/network_interface.hpp"
#include "transports/gige/wire/event.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <thread>

namespace obscura::transports::gige {

struct EventMessage {
    Event event = Event::test;
    std::uint64_t block_id = 0;     ///< 0: not about a block
    std::uint64_t timestamp_ns = 0; ///< device time
};

/// Destination and retries of event messages.
struct MessageConfig {
    std::uint32_t destination_ip = 0;
    std::uint16_t destination_port = 0; ///< 0: channel closed
    std::uint32_t timeout_ms = 300;     ///< 0: no acknowledge is requested
    std::uint32_t retries = 3;

    constexpr bool operator==(const MessageConfig&) const = default;
};

/// Sender of event messages. Has a thread of its own, because waiting for acknowledges must delay neither
/// control nor stream.
class MessageChannel {
public:
    explicit MessageChannel(const NetworkInterface& network) : network_(network) {}
    ~MessageChannel() { stop(); }

    /// Throws HardwareError.
    void start();
    void stop();
    /// A message that waits for its acknowledge is given up if this changes anything.
    void configure(const MessageConfig& config);
    void enable(Event e, bool on) noexcept;
    [[nodiscard]] bool enabled(Event e) const noexcept {
        return (enabled_.load(std::memory_order_relaxed) >> static_cast<unsigned>(e) & 1) != 0;
    }
    /// Queues an event; ignores it when it is not enabled, and counts it as lost when the queue is full.
    /// Thread-safe, real-time safe.
    void post(const EventMessage& message) noexcept;
    [[nodiscard]] std::uint16_t source_port() const noexcept { return port_; }

    [[nodiscard]] std::uint64_t acknowledged() const noexcept { return acknowledged_.load(); }
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(); }

private:
    void loop();
    void deliver(const EventMessage& message, const MessageConfig& config);
    [[nodiscard]] bool still(const MessageConfig& config);
    bool pop(EventMessage& message) noexcept;

    // Vyukov's bounded queue: each cell holds the turn at which it may be written or read.
    static constexpr std::size_t capacity = 256;
    struct Cell {
        std::atomic<std::size_t> turn{0};
        EventMessage message;
    };
    std::array<Cell, capacity> cells_;
    std::atomic<std::size_t> head_{0};
    std::size_t tail_ = 0;

    const NetworkInterface network_;
    FileDescriptor socket_;
    std::uint16_t port_ = 0;
    std::uint16_t request_id_ = 0;
    std::mutex mutex_; // guards config_
    MessageConfig config_;
    std::atomic<std::uint32_t> enabled_{0};
    std::atomic<std::uint64_t> acknowledged_{0}, lost_{0};
    std::atomic<bool> quit_{false};
    EventCount wake_;
    Heartbeat heartbeat_{"gige-message"};
    std::thread thread_;
};

} // namespace obscura::transports::gige
