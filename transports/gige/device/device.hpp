// SPDX-License-Identifier: Apache-2.0
// GigE Vision device: bootstrap and feature registers, and the effects of writing them.
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
#include <vector>

namespace obscura::transports::gige {

/// Connects the registers to a CameraControl and a StreamPort; independent of sockets and GVCP commands.
/// Thread-bound: control thread. `control`, `stream`, `messages` and `clock` must outlive it. `seed`: of
/// random choices of faults without a seed of their own.
class Device {
public:
    Device(const GigeSettings& settings, const NetworkInterface& network, CameraControl& control,
           StreamPort& stream, MessageChannel& messages, const Clock& clock, std::uint64_t seed = 1);

    [[nodiscard]] RegisterBank& registers() noexcept { return context_.bank; }
    [[nodiscard]] const RegisterBank& registers() const noexcept { return context_.bank; }

    /// Access of clients: to the registers, or to those of a user-supplied description (UserXml).
    Status read(std::uint32_t address, std::span<std::uint8_t> out);
    Status write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done);
    Status read_word(std::uint32_t address, std::uint32_t& value);
    Status write_word(std::uint32_t address, std::uint32_t value);
    /// Writes the state file if a client has changed what it holds: once for all writes of a command.
    void keep_state();
    /// `call` is called before a file is written, which may take as long as the disk wants.
    void set_before_disk(std::function<void()> call) { context_.before_disk = std::move(call); }
    /// Bound, absent and unusable features of a user-supplied description, in one line; empty without one.
    [[nodiscard]] std::string xml_report() const;

    /// Sets the address of the controlling application, 0 without one; streams may go there even off the
    /// link.
    void set_controller(std::uint32_t ip) noexcept { context_.controller_ip = ip; }
    /// Called when `client` has taken control of the free camera: ends an acquisition that was started from
    /// elsewhere, so that the client finds the features unlocked.
    void control_taken(const std::string& client);
    /// Called when the controller releases control or times out: ends the acquisition and closes the stream
    /// and message channels; features keep their values.
    void control_lost();
    /// Gives the features the values that they had after the start: the user set of UserSetDefault, and no
    /// multi-part payload. Not during acquisition.
    void load_start_settings();
    /// Executes an ACTION command, or queues it when it is scheduled. Returns whether it addresses one of
    /// this device's signals; then `status` is the result.
    bool action(const ActionRequest& request, Time now, Status& status);
    /// When the next scheduled action is due; Time::max without one.
    [[nodiscard]] Time next_action() const noexcept;
    /// Runs scheduled actions that are due.
    void run_actions(Time now);
    /// Fault rules, of which mute_control and heartbeat_loss concern commands.
    [[nodiscard]] const FaultInjector& control_faults() const noexcept { return context_.faults; }
    /// Rules in force and what they have struck. Any thread.
    [[nodiscard]] const ArmedFaults& armed_faults() const noexcept { return context_.armed_faults; }
    /// Replaces all fault rules, see ArmedFaults::replace().
    void arm_faults(const std::vector<FaultRule>& rules);
    /// Posts an event of the control side.
    void post(Event e, Time t) { gige::post(context_, e, t); }
    /// Whether PENDING_ACK is switched on.
    [[nodiscard]] bool announces_slow_commands() const;
    /// Status codes that answers may have.
    [[nodiscard]] StatusCodes status_codes() const;
    /// Delay of the acknowledge that a client has requested by TestPendingAck, returned once; 0: none.
    std::uint32_t take_pending_ack_ms() { return std::exchange(context_.pending_ack_ms, 0U); }
    /// Whether PACKETRESEND of this host is served: only of the controller's and of receivers of the stream.
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
