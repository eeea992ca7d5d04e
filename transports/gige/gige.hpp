// SPDX-License-Identifier: Apache-2.0
// GigE Vision camera in software (GVCP control, GVSP stream) as a Transport. Read this first.
#pragma once

#include "core/camera/camera.hpp"
#include "core/clock.hpp"
#include "core/ptp_status.hpp"
#include "transports/control_listener.hpp"
#include "transports/gige/settings.hpp"
#include "transports/transport.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace obscura::transports::gige {

/// Counters of a GigE Vision camera: those of every transport, then those of stream and control.
struct GigeCounters {
    TransportCounters frames;
    std::uint64_t packets = 0;         ///< accepted by the kernel, resent ones included
    std::uint64_t send_errors = 0;     ///< packets refused by the kernel
    std::uint64_t injected_losses = 0; ///< packets and frames withheld by injected faults
    std::uint64_t injected_delays = 0; ///< packets before which an injected fault made a pause
    std::uint64_t resend_requests = 0; ///< PACKETRESEND commands accepted
    std::uint64_t resends_denied = 0;  ///< PACKETRESEND commands of hosts that may not ask
    /// Packets that those commands accepted ask for: the sum of the next two and of `refused`.
    std::uint64_t asked_packets = 0;
    std::uint64_t resent_packets = 0;
    std::uint64_t asked_before_sent = 0; ///< not sent yet when they were asked for: late, not lost
    /// Packets asked for that cannot be sent again, by reason; see ResendOutcome.
    struct Refused {
        std::uint64_t no_longer_kept = 0, by_fault = 0, over_budget = 0, no_such_packet = 0,
                      no_such_block = 0, queue_full = 0;
        [[nodiscard]] std::uint64_t sum() const noexcept {
            return no_longer_kept + by_fault + over_budget + no_such_packet + no_such_block + queue_full;
        }
    } refused;
    std::uint64_t repeated_packets = 0; ///< while rows were late, see GigeSettings::keep_alive_ms
    std::uint64_t control_taken = 0;    ///< times that a client got control of the free camera
    std::uint64_t control_lost = 0;     ///< heartbeat time-outs of controllers
    std::uint64_t retries = 0;          ///< repeated commands, answered but not executed again
    std::uint64_t commands = 0, denied = 0;
    std::uint64_t throttled = 0; ///< answers withheld by the rate limit of SourcePolicy
    std::uint64_t events_acknowledged = 0, events_lost = 0;
    std::int64_t trigger_to_first_p50_ns = 0, trigger_to_first_p99_ns = 0; ///< edge to leader sent
    std::int64_t trigger_to_last_p50_ns = 0, trigger_to_last_p99_ns = 0;   ///< edge to trailer sent
};

/// Resources of a camera besides its settings.
struct GigeContext {
    ThreadSettings thread{}; ///< of the sender; the control thread runs one priority above
    std::uint64_t seed = 1;  ///< of random choices of faults without a seed of their own
    /// Source of the Ptp* features, called on the control thread. Empty: no PTP clock.
    std::function<PtpStatus()> ptp_status{};
    /// Acquires while no client has control; the features then return to their values after the start. Null:
    /// they keep those of the last client.
    ControlListener* control_listener = nullptr;
};

/// How to use it:
///
///     MonotonicClock clock;
///     GigeSettings settings;                    // section [gige]
///     GigeCamera camera(settings, control, clock); // control: the emulator's CameraControl
///     camera.start();                           // HardwareError: no such interface, port in use, ...
///     ...                                       // pipeline thread: camera.submit(frame), then publish rows
///     camera.stop();
///
/// A client's writes reach `control` on the camera's control thread; AcquisitionStart there makes the
/// producer submit frames. The producer fills `info` before submit() (width, height, pixel_format,
/// bits_per_pixel, trigger_edge, tai_offset_ns, windows[0].sensor) and publishes rows afterwards; packets
/// are sent as rows are published. An abandoned frame is sent with zeros below its last row. Block ids count
/// the frames sent since the client opened its stream channel, from 1: every connection starts at 1, but a
/// second AcquisitionStart on the same open channel continues counting, because receivers (Aravis for one)
/// take a block id lower than the last for a late packet and discard the frame.
///
/// Ownership: `control` and `clock` must outlive the camera. The camera holds references to the last
/// `history_frames` frames and the one being sent, so the pool needs history_frames + 2 more than the
/// producer itself, and must outlive stop(). The producer must have released its frames before the camera is
/// destroyed.
class GigeCamera final : public Transport {
public:
    GigeCamera(GigeSettings settings, CameraControl& control, const Clock& clock, GigeContext context = {});
    ~GigeCamera() override;
    GigeCamera(const GigeCamera&) = delete;
    GigeCamera& operator=(const GigeCamera&) = delete;

    [[nodiscard]] std::string_view kind() const override { return "gige"; }
    void start() override;
    /// Also ends the acquisition of a connected client.
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    /// Notifies the controlling application if it has enabled the event. The camera itself generates frame
    /// and exposure events, and errors of frames that were cut short.
    void notify(CameraEvent event, Time t, std::int64_t tai_offset_ns) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;
    [[nodiscard]] std::int64_t pace_ns() const noexcept override;
    [[nodiscard]] TransportStatistics statistics() const override;
    [[nodiscard]] Heartbeats heartbeats() const override;
    [[nodiscard]] std::string control_address() const override;
    [[nodiscard]] std::string controller() const override;
    [[nodiscard]] bool run_between_commands(const ControlWork& work) override;
    [[nodiscard]] FaultRules* fault_rules() noexcept override;
    [[nodiscard]] DeviceFeatures* device_features() noexcept override;
    void release_control() override;
    [[nodiscard]] GigeCounters gige_counters() const noexcept;
    /// The IPv4 address the camera answers on; valid after start().
    [[nodiscard]] std::string address() const;

private:
    struct Parts;
    GigeSettings settings_;
    CameraControl& control_;
    const Clock& clock_;
    GigeContext context_;
    std::unique_ptr<Parts> parts_; // from start() on
};

} // namespace obscura::transports::gige
