// SPDX-License-Identifier: Apache-2.0
// GVCP control channel without sockets: answers datagrams; privilege, heartbeat, retries, PENDING_ACK.
#pragma once

#include "core/time.hpp"
#include "transports/control_listener.hpp"
#include "transports/gige/control/source_policy.hpp"
#include "transports/gige/device/device.hpp"
#include "transports/gige/wire/gvcp_parser.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace obscura::transports::gige {

/// Sender of a datagram; host byte order.
struct Peer {
    std::uint32_t ip = 0;
    std::uint16_t port = 0;
    constexpr bool operator==(const Peer&) const = default;
};

/// Counters of datagrams and of losses of control, and when the controller was heard; readable from any
/// thread.
struct ControlCounters {
    std::atomic<std::uint64_t> datagrams{0}, ignored{0}, rejected{0}, denied{0}, retries{0}, control_taken{0},
        control_lost{0}, throttled{0}, muted{0}, resends_denied{0};
    std::atomic<std::int64_t> heard_ns{0}; ///< of the latest command of the controller, scheduling clock
};

/// Checks the rights of requests and executes them on a Device. Thread-bound: control thread, except
/// counters().
class ControlPort {
public:
    /// `listener`, see GigeContext, must outlive the port.
    ControlPort(Device& device, const GigeSettings& settings, const NetworkInterface& network,
                ControlListener* listener = nullptr);

    /// The acknowledge to send back to `from`, empty for none; valid until the next call. `now` is when the
    /// datagram arrived.
    std::span<const std::uint8_t> handle(std::span<const std::uint8_t> datagram, Peer from, bool broadcast,
                                         Time now);

    /// Time of the next call of on_timer(); INT64_MAX ns when nothing is pending.
    [[nodiscard]] Time deadline() const noexcept;
    /// The final acknowledge of a command that was first answered with PENDING_ACK, once it is due; empty
    /// otherwise.
    std::span<const std::uint8_t> take_due_reply(Time now, Peer& to);
    /// Runs scheduled actions that are due, and takes control from a controller that has been
    /// silent for the heartbeat time-out.
    void on_timer(Time now);
    /// Ends control of the device by its controller, if any. `why` completes the sentence "client ... ".
    void release(std::string_view why);

    [[nodiscard]] const ControlCounters& counters() const noexcept { return counters_; }
    [[nodiscard]] bool controlled() const noexcept { return controller_.ip != 0; }
    /// "ADDRESS:PORT" of the client in control; empty: none. Thread-safe.
    [[nodiscard]] std::string controller() const;

private:
    std::span<const std::uint8_t> run(const Request& request, Peer from, bool broadcast, Time now);
    std::span<const std::uint8_t> acknowledge(const Request& request, Status status, std::size_t payload = 0);
    std::uint8_t* payload() noexcept { return reply_.data() + gvcp_header_bytes; }
    Status read_registers(const Request& request, std::size_t& bytes);
    Status write_registers(const Request& request, std::size_t& entries);
    [[nodiscard]] bool is_controller(Peer p) const noexcept { return controlled() && p == controller_; }
    [[nodiscard]] std::string client() const;
    void set_controller(Peer peer) noexcept;
    void hear(Time now) noexcept;
    Status write_privilege(std::uint32_t value);
    [[nodiscard]] Status force_ip(const ForceIpRequest& wanted) const;
    [[nodiscard]] Time heartbeat_deadline() const noexcept;
    /// `reply` to a request of `request_bytes`; empty when it exceeds what `from` may be sent.
    std::span<const std::uint8_t> within_allowance(std::span<const std::uint8_t> reply,
                                                   std::size_t request_bytes, Peer from, Time now);
    std::span<const std::uint8_t> postpone(std::span<const std::uint8_t> reply, Peer from, Time now,
                                           std::uint32_t delay_ms);

    Device& device_;
    const NetworkInterface network_;
    SourcePolicy policy_;
    const bool read_only_;
    ControlListener* const listener_;
    const std::uint32_t heartbeat_reset_ms_;
    std::uint64_t commands_ = 0; // datagrams from admitted sources, counted for fault rules
    RegisterBank& bank_;
    ControlCounters counters_;
    Peer controller_;                                // ip 0: none
    std::atomic<std::uint64_t> shown_controller_{0}; ///< controller_ for other threads: address << 16 | port
    std::uint32_t privilege_ = 0;
    Time last_heard_;
    Peer asking_; // sender of the current request
    Time asked_;

    std::array<std::uint8_t, gvcp_max_datagram> reply_{};
    // The controller's latest request and its answer: a repeated request gets the same answer and is not
    // executed.
    std::array<std::uint8_t, gvcp_max_datagram> last_request_{};
    std::array<std::uint8_t, gvcp_max_datagram> last_reply_{};
    std::size_t last_request_bytes_ = 0, last_reply_bytes_ = 0;
    // Final answer of a command that was answered with PENDING_ACK.
    std::array<std::uint8_t, gvcp_max_datagram> pending_reply_{};
    std::size_t pending_reply_bytes_ = 0;
    Peer pending_peer_;
    Time pending_due_;
};

} // namespace obscura::transports::gige
