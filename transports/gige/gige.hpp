// SPDX-License-Identifier: Apache-2.0
// Read this first: a software GigE Vision camera (GVCP control, GVSP stream) as a Transport.
#pragma once

#include "core/camera.hpp"
#include "core/clock.hpp"
#include "core/ptp_status.hpp"
#include "transports/gige/settings.hpp"
#include "transports/transport.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace obscura::transports::gige {

/// TransportCounters and what only a GigE camera has.
struct GigeCounters {
    TransportCounters frames;
    std::uint64_t packets = 0;         ///< that the kernel took, resent ones included
    std::uint64_t send_errors = 0;     ///< packets the kernel refused
    std::uint64_t injected_losses = 0; ///< left out on purpose
    std::uint64_t resend_requests = 0; ///< PACKETRESEND commands accepted
    std::uint64_t resent_packets = 0;
    std::uint64_t control_lost = 0; ///< controllers that fell silent
    std::uint64_t retries = 0;      ///< repeated commands answered without running them again
    std::uint64_t commands = 0, denied = 0;
    std::uint64_t throttled = 0; ///< answers kept back, see SourcePolicy
    std::uint64_t events_acknowledged = 0, events_lost = 0;
    std::int64_t trigger_to_first_p50_ns = 0, trigger_to_first_p99_ns = 0; ///< edge to leader sent
    std::int64_t trigger_to_last_p50_ns = 0, trigger_to_last_p99_ns = 0;   ///< edge to trailer sent
};

/// What a camera is made from besides its settings.
struct GigeContext {
    ThreadSettings thread{}; ///< of the sender; the control thread stands one priority above
    std::uint64_t seed = 1;  ///< of random choices of faults without a seed of their own
    /// Where the Ptp* features come from; asked on the control thread. Empty: there is no PTP clock.
    std::function<PtpStatus()> ptp_status{};
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
/// leave as rows are published. A frame that is abandoned goes out with zeros below its last row. Block ids
/// count the frames sent since the client opened its stream channel, from 1: every connection starts at 1,
/// but a second AcquisitionStart on the same open channel goes on counting, because receivers (Aravis for
/// one) take a block id lower than the last for a late packet and throw the frame away.
///
/// Ownership: `control` and `clock` must outlive the camera. The camera holds references to the last
/// `history_frames` frames and the one in work, so the pool needs history_frames + 2 more than the producer
/// itself, and must outlive stop(). The producer must have let go of its frames before the camera is
/// destroyed.
class GigeCamera final : public Transport {
public:
    GigeCamera(GigeSettings settings, CameraControl& control, const Clock& clock, GigeContext context = {});
    ~GigeCamera() override;
    GigeCamera(const GigeCamera&) = delete;
    GigeCamera& operator=(const GigeCamera&) = delete;

    [[nodiscard]] std::string_view kind() const override { return "gige"; }
    void start() override;
    /// Ends the acquisition of a connected client, too.
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    /// Tells the controlling application, if it has switched the event's notification on. Frame and exposure
    /// events, and errors of frames that were given up half way, the camera makes itself.
    void notify(CameraEvent event, Time t, std::int64_t tai_offset_ns) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;
    [[nodiscard]] TransportStatistics statistics() const override;
    [[nodiscard]] Heartbeats heartbeats() const override;
    [[nodiscard]] std::string control_address() const override;
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
