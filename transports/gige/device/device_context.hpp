// SPDX-License-Identifier: Apache-2.0
// State of the GigE Vision device that its features and bootstrap registers share.
#pragma once

#include "core/camera/camera.hpp"
#include "core/clock.hpp"
#include "core/ptp_status.hpp"
#include "transports/gige/channels/binning.hpp"
#include "transports/gige/channels/fault_injector.hpp"
#include "transports/gige/channels/message_channel.hpp"
#include "transports/gige/channels/network_interface.hpp"
#include "transports/gige/channels/stream_port.hpp"
#include "transports/gige/device/armed_faults.hpp"
#include "transports/gige/device/state_file.hpp"
#include "transports/gige/registers/register_bank.hpp"
#include "transports/gige/settings.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace obscura::transports::gige {

/// Counters shown in registers.
struct StreamStatistics {
    std::uint32_t submitted = 0, delivered = 0, dropped = 0;
    std::uint32_t asked = 0, resent = 0, asked_before_sent = 0, refused = 0; ///< packets, see ResendOutcome
};

/// State that the free functions of device/ share. Owned by Device. Thread-bound: control thread, except
/// `timestamp_origin_ns`. `control`, `stream`, `messages` and `clock` must outlive it.
struct DeviceContext {
    DeviceContext(const GigeSettings& settings_, const NetworkInterface& network_, CameraControl& control_,
                  StreamPort& stream_, MessageChannel& messages_, const Clock& clock_, std::uint64_t seed_);

    const GigeSettings settings;
    const std::uint64_t seed; ///< of random choices of faults without a seed of their own
    const NetworkInterface network;
    CameraControl& control;
    StreamPort& stream;
    MessageChannel& messages;
    const Clock& clock;
    const CameraLimits limits;
    RegisterBank bank;
    std::function<StreamStatistics()> statistics; ///< empty: all 0
    std::function<PtpStatus()> ptp;               ///< empty: no PTP daemon
    PtpStatus ptp_latched;
    std::uint32_t controller_ip = 0; ///< host byte order; 0: none
    std::uint32_t packet_size_max;
    bool channel_fresh = true; ///< no acquisition since the stream channel was opened
    std::atomic<std::int64_t> timestamp_origin_ns{0};
    std::uint64_t timestamp_latched = 0;
    ArmedFaults armed_faults; ///< readable from any thread
    FaultInjector faults;     ///< their rules
    std::uint32_t pending_ack_ms = 0;
    static constexpr std::size_t action_queue_size = 16;
    std::array<Time, action_queue_size> actions{};  ///< scheduled, in no order; 0: free
    std::vector<SavedWord> default_set, user_set_1; ///< see saved_features()
    bool state_file_usable = true; ///< false: settings.state_file is not ours and must not be replaced
    DeviceState state_in_file;     ///< what settings.state_file holds
    /// DeviceUserID or UserSetDefault were written since the state file was; see Device::keep_state().
    bool state_changed = false;
    std::function<void()> before_disk; ///< called before a file is written; may be empty

    /// Regions from the second on; Region0 is always enabled and its window is in the camera's settings.
    struct RegionSlot {
        bool enabled = false;
        CameraWindow window;
    };
    std::array<RegionSlot, max_windows> regions;
    Binning binning;
    bool sequencer_configuring = false;
    Sequence sequence;
    /// The sensor's last answer and the settings it belongs to; see readout_answer().
    CameraSettings answered_settings;
    ReadoutAnswer answer;
    bool answered = false;
};

/// TAI in ns minus the origin set by a time stamp reset. Thread-safe.
[[nodiscard]] std::uint64_t device_time(const DeviceContext& d, Time t) noexcept;
/// Posts an event of the control side.
void post(DeviceContext& d, Event e, Time t);
/// Applies all of `wanted` or nothing.
Status apply_settings(DeviceContext& d, const CameraSettings& wanted);
/// The sensor's answer to the current settings: windows, exposures and times obtained.
[[nodiscard]] const ReadoutAnswer& readout_answer(DeviceContext& d);

} // namespace obscura::transports::gige
