// The camera behind the registers: bootstrap and feature registers, and what writing them does.
#pragma once

#include "core/camera.hpp"
#include "core/clock.hpp"
#include "core/io_state.hpp"
#include "core/ptp_status.hpp"
#include "transports/gige/channels/binning.hpp"
#include "transports/gige/channels/fault_injector.hpp"
#include "transports/gige/channels/message_channel.hpp"
#include "transports/gige/channels/network_interface.hpp"
#include "transports/gige/channels/stream_port.hpp"
#include "transports/gige/genicam/user_xml.hpp"
#include "transports/gige/registers/features.hpp"
#include "transports/gige/registers/register_bank.hpp"
#include "transports/gige/settings.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace obscura::transports::gige {

/// Counters shown in registers.
struct StreamStatistics {
    std::uint32_t submitted = 0, delivered = 0, dropped = 0, resent = 0;
};

/// Ties the register table to a CameraControl and a StreamPort. Knows nothing of sockets or commands.
/// Control thread only; `control`, `stream` and `clock` must outlive it.
class Device {
public:
    Device(const GigeSettings& settings, const NetworkInterface& network, CameraControl& control,
           StreamPort& stream, MessageChannel& messages, const Clock& clock, std::uint64_t seed = 1);

    [[nodiscard]] RegisterBank& registers() noexcept { return bank_; }
    [[nodiscard]] const RegisterBank& registers() const noexcept { return bank_; }

    /// What clients read and write: the registers, or what a user's own XML makes of them.
    Status read(std::uint32_t address, std::span<std::uint8_t> out);
    Status write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done);
    Status read_word(std::uint32_t address, std::uint32_t& value);
    Status write_word(std::uint32_t address, std::uint32_t value);
    /// What a user's own XML has turned out to hold, in one line; empty without one.
    [[nodiscard]] std::string xml_report() const;

    /// The controlling application's address, 0 without one; streams may go there even when off link.
    void set_controller(std::uint32_t ip) noexcept { controller_ip_ = ip; }
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
    [[nodiscard]] const FaultInjector& control_faults() const noexcept { return faults_; }
    /// Posts an event of the control side.
    void post(Event e, Time t) { messages_.post({e, 0, device_time(t)}); }
    /// Whether PENDING_ACK is switched on.
    [[nodiscard]] bool announces_slow_commands() const;
    /// Those that answers may have.
    [[nodiscard]] StatusCodes status_codes() const;
    /// How long a client wants TestPendingAck to take, once; 0 when it does not.
    std::uint32_t take_pending_ack_ms() { return std::exchange(pending_ack_ms_, 0U); }
    /// PACKETRESEND is only served for who controls the device or receives the stream.
    [[nodiscard]] bool may_ask_resend(std::uint32_t ip) const noexcept;
    void resend(const ResendRequest& request) noexcept { stream_.resend(request); }
    void set_statistics(std::function<StreamStatistics()> source) { statistics_ = std::move(source); }

    void set_ptp(std::function<PtpStatus()> source) { ptp_ = std::move(source); }

    /// TAI in ns minus the origin set by a time stamp reset.
    [[nodiscard]] std::uint64_t device_time(Time t) const noexcept;
    /// Any thread.
    [[nodiscard]] std::int64_t timestamp_origin_ns() const noexcept { return timestamp_origin_ns_.load(); }

private:
    void add_identity();
    void add_network();
    void add_capabilities();
    void add_timestamps();
    void add_stream();
    void add_actions();
    void add_image_format();
    void add_acquisition();
    void add_triggers();
    void add_statistics();
    void add_chunks();
    void add_messages();
    void add_user_sets();
    void add_faults();
    void add_image_extras();
    void add_binning();
    void add_regions();
    void add_digital_io();
    void add_counters();
    void add_timers();
    void add_sequencer();
    void add_xml();
    void add_ptp();

    void constant(std::string_view name, std::uint32_t address, std::uint32_t value);
    void setting(std::string_view name, std::uint32_t address, bool locked,
                 std::function<std::uint32_t(const CameraSettings&)> get,
                 std::function<bool(CameraSettings&, std::uint32_t)> set);
    /// Words without a store of their own, and without side effects beyond `set`.
    void word(std::string_view name, std::uint32_t address, std::uint32_t maximum,
              std::function<std::uint32_t()> get, std::function<void(std::uint32_t)> set = {});
    void command(std::string_view name, std::uint32_t address, std::function<Status()> run);

    [[nodiscard]] bool output_level(const IoInputs& in) const;
    [[nodiscard]] std::uint32_t line_status_all() const;
    [[nodiscard]] const ReadoutAnswer& readout_answer();
    [[nodiscard]] std::uint32_t region_count() const noexcept;
    [[nodiscard]] CameraWindow region_window(std::uint32_t i) const;
    /// The others are off while Region0 is binned, and in sensor pixels.
    [[nodiscard]] Binning region_binning(std::uint32_t i) const { return i == 0 ? binning_ : Binning{}; }
    [[nodiscard]] Status write_binning(const Binning& wanted);
    [[nodiscard]] CameraSettings with_regions(const CameraWindow& first) const;
    Status write_region(std::uint32_t i, const CameraWindow& window, bool enabled);
    [[nodiscard]] FrameWindow region_obtained(std::uint32_t i);
    void reset_regions();
    Status publish_sequence(const Sequence& wanted);

    [[nodiscard]] std::uint32_t chunk_selection() const;
    [[nodiscard]] StreamConfig stream_config() const;
    void configure_messages();
    Status check_destination(std::uint32_t ip) const;
    void publish_faults();
    [[nodiscard]] std::string saved_features() const;
    Status load_features(const std::string& text);
    void read_state_file();
    bool write_state_file() const;
    Status acquisition_start();
    Status acquisition_stop();
    Status write_stream_port(std::uint32_t value);
    Status write_packet_size(std::uint32_t value);

    const GigeSettings settings_;
    const std::uint64_t seed_; ///< of random choices of faults without a seed of their own
    const NetworkInterface network_;
    CameraControl& control_;
    StreamPort& stream_;
    MessageChannel& messages_;
    const Clock& clock_;
    const CameraLimits limits_;
    RegisterBank bank_;
    std::function<StreamStatistics()> statistics_;
    std::function<PtpStatus()> ptp_;
    PtpStatus ptp_latched_;
    std::uint32_t controller_ip_ = 0;
    std::uint32_t packet_size_max_;
    bool channel_fresh_ = true; // no acquisition since the stream channel was opened
    std::atomic<std::int64_t> timestamp_origin_ns_{0};
    FaultInjector faults_;
    std::uint32_t pending_ack_ms_ = 0;
    static constexpr std::size_t action_queue_size = 16;
    std::array<Time, action_queue_size> actions_{}; // scheduled, in no order; 0: free
    std::string default_set_, user_set_1_;          // features as text, see saved_features()
    std::uint64_t timestamp_latched_ = 0;

    /// Regions from the second on; Region0 is on and as the camera's settings say.
    struct RegionSlot {
        bool enabled = false;
        CameraWindow window;
    };
    std::array<RegionSlot, max_windows> regions_;
    Binning binning_;
    bool sequencer_configuring_ = false;
    Sequence sequence_;
    std::unique_ptr<UserXml> user_xml_;
    // What the chip makes of the settings it was last asked about.
    CameraSettings answered_settings_;
    ReadoutAnswer answer_;
    bool answered_ = false;
};

} // namespace obscura::transports::gige
