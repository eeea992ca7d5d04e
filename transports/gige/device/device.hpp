// SPDX-License-Identifier: Apache-2.0
// The camera behind the registers: bootstrap and feature registers, and what writing them does.
#pragma once

#include "transports/gige/device/device_context.hpp"
#include "transports/gige/genicam/user_xml.hpp"
#include "transports/gige/wire/gvcp_parser.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

namespace obscura::transports::gige {

/// Ties the register table to a CameraControl and a StreamPort. Knows nothing of sockets or commands.
/// Control thread only; `control`, `stream`, `messages` and `clock` must outlive it. `seed`: of random
/// choices of faults without a seed of their own.
class Device {
public:
    Device(const GigeSettings& settings, const NetworkInterface& network, CameraControl& control,
           StreamPort& stream, MessageChannel& messages, const Clock& clock, std::uint64_t seed = 1);

    [[nodiscard]] RegisterBank& registers() noexcept { return context_.bank; }
    [[nodiscard]] const RegisterBank& registers() const noexcept { return context_.bank; }

    /// What clients read and write: the registers, or what a user's own XML makes of them.
    Status read(std::uint32_t address, std::span<std::uint8_t> out);
    Status write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done);
    Status read_word(std::uint32_t address, std::uint32_t& value);
    Status write_word(std::uint32_t address, std::uint32_t value);
    /// What a user's own XML has turned out to hold, in one line; empty without one.
    [[nodiscard]] std::string xml_report() const;

    /// The controlling application's address, 0 without one; streams may go there even when off link.
    void set_controller(std::uint32_t ip) noexcept { context_.controller_ip = ip; }
    /// The controller left or fell silent: acquisition ends, the stream channel closes, features stay.
    void control_lost();
    /// An ACTION command. True when it concerns one of this device's signals; then it is run now, or queued
    /// when scheduled, and `status` tells how that went.
    bool action(const ActionRequest& request, Time now, Status& status);
    /// When the next scheduled action is due; Time::max without one.
    [[nodiscard]] Time next_action() const noexcept;
    /// Runs what is due.
    void run_actions(Time now);
    /// A rule for commands themselves (mute_control), see FaultInjector.
    [[nodiscard]] const FaultInjector& control_faults() const noexcept { return context_.faults; }
    /// Posts an event of the control side.
    void post(Event e, Time t) { gige::post(context_, e, t); }
    /// Whether PENDING_ACK is switched on.
    [[nodiscard]] bool announces_slow_commands() const;
    /// Those that answers may have.
    [[nodiscard]] StatusCodes status_codes() const;
    /// How long a client wants TestPendingAck to take, once; 0 when it does not.
    std::uint32_t take_pending_ack_ms() { return std::exchange(context_.pending_ack_ms, 0U); }
    /// PACKETRESEND is only served for who controls the device or receives the stream.
    [[nodiscard]] bool may_ask_resend(std::uint32_t ip) const noexcept;
    void resend(const ResendRequest& request) noexcept { context_.stream.resend(request); }
    void set_statistics(std::function<StreamStatistics()> source) { context_.statistics = std::move(source); }
    void set_ptp(std::function<PtpStatus()> source) { context_.ptp = std::move(source); }

    /// TAI in ns minus the origin set by a time stamp reset.
    [[nodiscard]] std::uint64_t device_time(Time t) const noexcept { return gige::device_time(context_, t); }
    /// Any thread.
    [[nodiscard]] std::int64_t timestamp_origin_ns() const noexcept {
        return context_.timestamp_origin_ns.load();
    }

private:
    void add_xml();

    DeviceContext context_;
    std::unique_ptr<UserXml> user_xml_;
};

} // namespace obscura::transports::gige
