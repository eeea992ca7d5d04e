// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/message_channel.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/realtime/realtime.hpp"
#include "transports/gige/wire/bytes.hpp"
#include "transports/gige/wire/gvcp.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <chrono>
#include <cstring>

namespace obscura::transports::gige {

void MessageChannel::start() {
    for (std::size_t i = 0; i < capacity; ++i)
        cells_[i].turn.store(i, std::memory_order_relaxed);
    head_.store(0);
    tail_ = 0;
    socket_ = FileDescriptor(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = htonl(network_.address);
    socklen_t bytes = sizeof a;
    if (socket_.get() < 0 || bind(socket_.get(), reinterpret_cast<const sockaddr*>(&a), sizeof a) != 0 ||
        getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&a), &bytes) != 0)
        throw HardwareError(fmt::format("gige: cannot open a message socket on {}: {}",
                                        dotted(network_.address), std::strerror(errno)));
    port_ = ntohs(a.sin_port);
    quit_.store(false);
    thread_ = std::thread([this] { loop(); });
}

void MessageChannel::stop() {
    if (!thread_.joinable()) return;
    quit_.store(true);
    wake_.notify();
    thread_.join();
    heartbeat_.rest();
}

void MessageChannel::configure(const MessageConfig& config) {
    const std::lock_guard lock(mutex_);
    config_ = config;
}

bool MessageChannel::still(const MessageConfig& config) {
    const std::lock_guard lock(mutex_);
    return config == config_;
}

void MessageChannel::enable(Event e, bool on) noexcept {
    const std::uint32_t bit = 1U << static_cast<unsigned>(e);
    if (on)
        enabled_.fetch_or(bit);
    else
        enabled_.fetch_and(~bit);
}

void MessageChannel::post(const EventMessage& message) noexcept {
    if (!enabled(message.event)) return;
    std::size_t at = head_.load(std::memory_order_relaxed);
    for (;;) {
        Cell& cell = cells_[at % capacity];
        const std::size_t turn = cell.turn.load(std::memory_order_acquire);
        if (turn == at) {
            if (!head_.compare_exchange_weak(at, at + 1, std::memory_order_relaxed)) continue;
            cell.message = message;
            cell.turn.store(at + 1, std::memory_order_release);
            wake_.notify();
            return;
        }
        if (turn < at) { // full
            lost_.fetch_add(1, std::memory_order_relaxed);
            return;
        }
        at = head_.load(std::memory_order_relaxed);
    }
}

bool MessageChannel::pop(EventMessage& message) noexcept {
    Cell& cell = cells_[tail_ % capacity];
    if (cell.turn.load(std::memory_order_acquire) != tail_ + 1) return false;
    message = cell.message;
    cell.turn.store(tail_ + capacity, std::memory_order_release);
    ++tail_;
    return true;
}

void MessageChannel::loop() {
    name_this_thread(heartbeat_.name().c_str());
    while (!quit_.load(std::memory_order_acquire)) {
        heartbeat_.beat();
        const std::uint32_t seen = wake_.value();
        EventMessage message;
        if (!pop(message)) {
            wake_.wait(seen, MonotonicClock().now() + Heartbeat::max_wait_ns);
            continue;
        }
        MessageConfig config;
        {
            const std::lock_guard lock(mutex_);
            config = config_;
        }
        if (config.destination_port != 0 && config.destination_ip != 0) deliver(message, config);
    }
}

void MessageChannel::deliver(const EventMessage& message, const MessageConfig& config) {
    if (++request_id_ == 0) request_id_ = 1;
    std::array<std::uint8_t, gvcp_header_bytes + 16> datagram{};
    datagram[0] = gvcp_key;
    datagram[1] = config.timeout_ms != 0 ? gvcp_flag::ack_required : 0;
    store_be16(&datagram[2], static_cast<std::uint16_t>(Command::event));
    store_be16(&datagram[4], 16);
    store_be16(&datagram[6], request_id_);
    store_be16(&datagram[10], event_id(message.event));
    const bool of_a_block = message.block_id != 0;
    store_be16(&datagram[12], of_a_block ? 0 : 0xFFFF); // stream channel
    store_be16(&datagram[14], static_cast<std::uint16_t>(message.block_id));
    store_be64(&datagram[16], message.timestamp_ns);

    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(config.destination_ip);
    to.sin_port = htons(config.destination_port);
    for (std::uint32_t attempt = 0; attempt <= config.retries && still(config) && !quit_.load(); ++attempt) {
        sendto(socket_.get(), datagram.data(), datagram.size(), MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&to), sizeof to);
        if (config.timeout_ms == 0) return;
        using Clock = std::chrono::steady_clock;
        const auto give_up = Clock::now() + std::chrono::milliseconds(config.timeout_ms);
        while (!quit_.load() && still(config)) {
            const auto left =
                std::chrono::duration_cast<std::chrono::milliseconds>(give_up - Clock::now()).count();
            if (left <= 0) break;
            heartbeat_.beat();
            pollfd p{socket_.get(), POLLIN, 0};
            // Wait in short steps, so that stop() returns soon.
            if (poll(&p, 1, static_cast<int>(std::min<long>(left, 50))) <= 0) continue;
            std::array<std::uint8_t, 64> answer{};
            sockaddr_in from{};
            socklen_t from_bytes = sizeof from;
            const ssize_t n = recvfrom(socket_.get(), answer.data(), answer.size(), 0,
                                       reinterpret_cast<sockaddr*>(&from), &from_bytes);
            if (n < static_cast<ssize_t>(gvcp_header_bytes) || from.sin_addr.s_addr != to.sin_addr.s_addr)
                continue;
            if (load_be16(&answer[2]) == static_cast<std::uint16_t>(Command::event) + 1 &&
                load_be16(&answer[6]) == request_id_) {
                acknowledged_.fetch_add(1, std::memory_order_relaxed);
                return;
            }
        }
    }
    lost_.fetch_add(1, std::memory_order_relaxed);
}

} // namespace obscura::transports::gige
