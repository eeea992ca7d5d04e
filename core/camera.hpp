// What a client can set on the emulated camera, and the seam through which a transport does so.
#pragma once

#include "core/frame.hpp"
#include "core/image_pattern.hpp"
#include "core/region.hpp"
#include "core/time.hpp"
#include "core/trigger.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace obscura {

/// SFNC AcquisitionMode.
enum class AcquisitionMode : std::uint8_t { continuous, single_frame, multi_frame };

/// SFNC ExposureAuto: the camera chooses ExposureTime by what it sees.
enum class ExposureAuto : std::uint8_t { off, once, continuous };

/// SFNC ExposureMode. `trigger_width`: exposed for as long as the pulse of the trigger lasts, where that
/// comes from a line whose source tells of both its edges and RisingEdge or FallingEdge begins it;
/// ExposureTime counts otherwise.
enum class ExposureMode : std::uint8_t { timed, trigger_width };

/// One window of the sensor, with an integration of its own. SFNC calls it a region.
struct CameraWindow {
    Region region;                             ///< in sensor pixels
    std::int64_t exposure_ns = 10 * ns_per_ms; ///< reset to read; first to last read where there are several
    Sampling sampling = Sampling::destructive;
    std::int32_t reads = 1; ///< 1 destructive, at least 1 non_destructive, 2 or more for cds and ramp

    constexpr bool operator==(const CameraWindow&) const = default;
};

/// The settings a client may change while the camera runs. Plain data; a change applies from the next frame
/// on: they are the shadow registers of the chip.
struct CameraSettings {
    // The first window, and for a camera that has but one the only one.
    Region region; ///< SFNC Width, Height, OffsetX, OffsetY, in sensor pixels
    PixelFormat pixel_format = PixelFormat::mono16;
    std::int64_t exposure_ns = 10 * ns_per_ms; ///< SFNC ExposureTime (there in us)
    Sampling sampling = Sampling::destructive;
    std::int32_t reads = 1;
    // The windows read after it; entries from `more_count` on are as they were constructed.
    std::uint32_t more_count = 0;
    std::array<CameraWindow, max_windows - 1> more_windows{};

    /// Of the first window.
    ExposureMode exposure_mode = ExposureMode::timed;
    /// What the camera makes of it shows in exposure_ns; `once` turns to `off` by itself.
    ExposureAuto exposure_auto = ExposureAuto::off;
    /// The goal: that percentile of the first window's digital numbers, between black level and full scale.
    double auto_target_percent = 50, auto_percentile = 99;
    double gain_db = 0; ///< SFNC Gain
    AcquisitionMode acquisition_mode = AcquisitionMode::continuous;
    std::uint32_t acquisition_frame_count = 1; ///< MultiFrame only
    /// SFNC TriggerSelector FrameStart; not enabled: free run at frame_rate_hz.
    TriggerChoice frame_trigger{.enabled = true};
    std::int64_t trigger_delay_ns = 0;
    TriggerOverlap trigger_overlap = TriggerOverlap::off;
    std::uint32_t trigger_divider = 1; ///< SFNC TriggerDivider: one of so many edges counts
    // SFNC TriggerSelector AcquisitionStart: after AcquisitionStart no frame is taken before this trigger.
    // The edge itself makes none.
    TriggerChoice start_trigger{};
    // SFNC TriggerSelector FrameBurstStart: lets the next burst_frame_count frames through. Without a trigger
    // for FrameStart the first of them begins at its edge, the others follow at the free run's rate.
    TriggerChoice burst_trigger{};
    std::uint32_t burst_frame_count = 1; ///< SFNC AcquisitionBurstFrameCount
    // SFNC TriggerSelector ExposureStart: the edge that a frame is exposed at. A trigger for FrameStart then
    // only readies the camera for one such edge; without one it is always ready.
    TriggerChoice exposure_trigger{};
    bool frame_rate_enabled = true; ///< SFNC AcquisitionFrameRateEnable; off: as fast as the chip can
    double black_level_dn = 0;      ///< SFNC BlackLevel
    ImagePattern test_pattern = ImagePattern::off; ///< SFNC TestPattern
    double frame_rate_hz = 10; ///< SFNC AcquisitionFrameRate: free run, and as long as a level holds
    std::array<EventCounter, counter_count> counters{};
    std::array<PulseTimer, timer_count> timers{};

    constexpr bool operator==(const CameraSettings&) const = default;

    [[nodiscard]] constexpr std::size_t window_count() const { return std::size_t{1} + more_count; }
    /// Window `i` of window_count(), in the order in which they are read.
    [[nodiscard]] constexpr CameraWindow window(std::size_t i) const {
        return i == 0 ? CameraWindow{region, exposure_ns, sampling, reads} : more_windows[i - 1];
    }
    /// Replaces all windows, by 1 to max_windows others.
    void set_windows(std::span<const CameraWindow> windows);
};

/// Columns and rows of an image.
struct ImageSize {
    std::int32_t width = 0, height = 0;
    constexpr bool operator==(const ImageSize&) const = default;
};
/// Of the image composed of all windows, one below the other: as wide as the widest of them. Non-destructive
/// reads are delivered one by one.
[[nodiscard]] ImageSize composed_size(const CameraSettings& settings);

/// The limits within which CameraSettings must stay; constant for the life of the camera.
struct CameraLimits {
    std::int32_t sensor_width = 0, sensor_height = 0;
    std::int32_t width_step = 1, height_step = 1; ///< increments of Width, Height and the offsets
    std::int32_t width_min = 1, height_min = 1;
    std::uint32_t windows_max = 1;
    std::int32_t rows_max = 0; ///< of the composed image; 0: as many as the sensor has
    bool strict = true;        ///< windows must lie on the sensor; otherwise the chip crops them
    std::array<LineEdges, line_count> lines{LineEdges{.rising = true}};
    int adc_bits = 12;
    std::int64_t exposure_min_ns = 1000, exposure_max_ns = 10 * ns_per_s;
    double gain_min_db = 0, gain_max_db = 24;
    double frame_rate_min_hz = 0.01, frame_rate_max_hz = 1000;
    double black_level_min_dn = 0, black_level_max_dn = 0; ///< equal: fixed
    double temperature_c = 20;                             ///< of the sensor
    bool overlapped = false; ///< a frame may be exposed while the one before is read out
    bool global_shutter = false;
    std::string sensor_name = "generic";
};

/// Why `settings` cannot be had within `limits`: the SFNC feature and what is allowed; empty when they can.
[[nodiscard]] std::string explain_invalid(const CameraSettings& settings, const CameraLimits& limits);

/// What the chip makes of CameraSettings.
struct ReadoutAnswer {
    std::string refusal; ///< why it cannot be done; then the rest is empty
    std::uint32_t window_count = 0;
    std::array<FrameWindow, max_windows> windows{}; ///< with the exposures obtained and the readout's flags
    std::int64_t frame_period_ns = 0;               ///< shortest time between triggers
    std::int64_t readout_ns = 0;                    ///< first to last row slot
};

/// Settings that the sequencer may change from frame to frame.
enum SequencedFeature : std::uint32_t {
    sequenced_exposure = 1u << 0,
    sequenced_gain = 1u << 1,
    sequenced_black_level = 1u << 2,
    sequenced_offset_x = 1u << 3,
    sequenced_offset_y = 1u << 4,
};
/// One set of the sequencer: what a frame is taken with, and which set is for the frame after it.
struct SequenceStep {
    std::int64_t exposure_ns = 10 * ns_per_ms;
    double gain_db = 0;
    double black_level_dn = 0;
    std::int32_t offset_x = 0, offset_y = 0;
    std::uint32_t next = 0;
    constexpr bool operator==(const SequenceStep&) const = default;
};
/// SFNC SequencerControl: from frame to frame along `next`, anew from `start` at each acquisition start.
struct Sequence {
    static constexpr std::size_t max_steps = 8;
    bool enabled = false;
    std::uint32_t features = 0; ///< SequencedFeature bits; the other settings stay as they are
    std::uint32_t start = 0;
    std::array<SequenceStep, max_steps> steps{};
    constexpr bool operator==(const Sequence&) const = default;
};
/// `settings` with what step `step` of `sequence` puts in their place.
[[nodiscard]] CameraSettings with_step(CameraSettings settings, const Sequence& sequence,
                                       std::uint32_t step) noexcept;

/// Why `sequence` cannot run on top of `settings`; empty when it can.
[[nodiscard]] std::string explain_invalid(const Sequence& sequence, const CameraSettings& settings,
                                          const CameraLimits& limits);

/// One input line.
struct LineActivity {
    std::uint64_t edges = 0; ///< listened to or not
    Time edge;               ///< the last one
    bool high = false;       ///< after it; low before the first
};

/// What has happened and how often since the camera was made; scheduling clock. Instants of the frame in work
/// may lie ahead.
struct CameraActivity {
    std::uint64_t frame_triggers = 0;  ///< edges that became work
    std::uint64_t missed_triggers = 0; ///< edges that came too soon
    std::uint64_t frames = 0;          ///< frames begun
    Time frame_start, frame_end;       ///< of the last frame: trigger edge, last row out of the chip
    Time exposure_start, exposure_end; ///< of the last frame: first reset, last read
    bool trigger_ready = false;        ///< an edge would be taken now
    bool start_awaited = false;        ///< acquiring, but the start trigger has not come
    std::uint32_t sequence_step = 0;   ///< that the last frame was taken with
    std::uint64_t acquisitions = 0;    ///< acquisition starts
    Time acquisition_start;            ///< the last one
    std::array<LineActivity, line_count> lines{};
    std::array<CounterMark, counter_count> counters{};
    std::array<Time, timer_count> timer_resets{};
};

/// The camera as its control port sees it. Implemented by the emulator; called on a transport's control
/// thread (one at a time). None of the calls blocks for longer than it takes to finish the band of rows in
/// work.
class CameraControl {
public:
    virtual ~CameraControl() = default;

    [[nodiscard]] virtual CameraLimits limits() const = 0;
    [[nodiscard]] virtual CameraSettings settings() const = 0;
    /// Why apply() would refuse `settings`: outside the limits, or the chip cannot read such windows. Empty
    /// when it would not.
    [[nodiscard]] virtual std::string explain(const CameraSettings& settings) const {
        return explain_invalid(settings, limits());
    }
    /// Applies all of `settings` from the next frame on, or nothing: false when explain() has a reason.
    virtual bool apply(const CameraSettings& settings) = 0;

    /// Frame ids restart at 1. False when already running.
    virtual bool acquisition_start() = 0;
    /// After the return no new frame is submitted; the one in work is abandoned if `abort`, else finished.
    virtual void acquisition_stop(bool abort) = 0;
    [[nodiscard]] virtual bool acquiring() const = 0;

    /// SFNC TriggerSoftware at `edge`. False when it was not accepted (not armed, other source,
    /// over-trigger); the camera counts that as a missed trigger.
    virtual bool software_trigger(Time edge) = 0;
    /// SFNC Action1 at `edge`; the same rules. A camera without it never accepts.
    virtual bool action_trigger(Time /*edge*/) { return false; }

    /// SFNC TriggerSoftware of the acquisition start trigger at `edge`. False when none is awaited from
    /// there.
    virtual bool software_start_trigger(Time /*edge*/) { return false; }

    /// SFNC TriggerSoftware of the burst trigger and of the exposure trigger, the same way.
    virtual bool software_burst_trigger(Time /*edge*/) { return false; }
    virtual bool software_exposure_trigger(Time /*edge*/) { return false; }

    /// SFNC CounterReset and TimerReset.
    virtual void reset_counter(std::size_t /*i*/) {}
    virtual void reset_timer(std::size_t /*i*/) {}

    /// What the chip would make of `settings`; by default exactly what they ask for, in no time.
    [[nodiscard]] virtual ReadoutAnswer readout(const CameraSettings& settings) const;
    /// Takes effect at the next acquisition start. False when a step is outside the limits, while acquiring,
    /// and for a camera without a sequencer.
    virtual bool set_sequence(const Sequence& sequence) { return !sequence.enabled; }
    [[nodiscard]] virtual CameraActivity activity() const { return {}; }
};

} // namespace obscura
