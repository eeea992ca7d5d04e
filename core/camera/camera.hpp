// SPDX-License-Identifier: Apache-2.0
// Camera settings by their SFNC names, their limits, and the interface through which transports apply them.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/image_pattern.hpp"
#include "core/camera/region.hpp"
#include "core/camera/trigger.hpp"
#include "core/text/enum_names.hpp"
#include "core/time.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace obscura {

/// SFNC AcquisitionMode.
enum class AcquisitionMode : std::uint8_t { continuous, single_frame, multi_frame };

/// SFNC ExposureAuto: the camera adjusts ExposureTime to the brightness of its frames.
enum class ExposureAuto : std::uint8_t { off, once, continuous };

/// SFNC ExposureMode. `trigger_width`: the exposure lasts as long as the trigger pulse, provided that the
/// pulse comes from a line whose source reports both edges and that TriggerActivation is RisingEdge or
/// FallingEdge; otherwise ExposureTime applies.
enum class ExposureMode : std::uint8_t { timed, trigger_width };
constexpr auto enum_names(ExposureMode /*type*/) {
    return std::array{EnumName{ExposureMode::timed, "Timed"},
                      EnumName{ExposureMode::trigger_width, "TriggerWidth"}};
}

/// One window of the sensor (an SFNC region) with its own integration time.
struct CameraWindow {
    Region region; ///< in sensor pixels
    /// From reset to read; with several reads, from the first to the last.
    std::int64_t exposure_ns = 10 * ns_per_ms;
    Sampling sampling = Sampling::destructive;
    /// 1 for destructive, at least 1 for non_destructive, at least 2 for cds and ramp.
    std::int32_t reads = 1;

    constexpr bool operator==(const CameraWindow&) const = default;
};

/// Settings that a client may change while the camera runs: the shadow registers of the chip. Plain data; a
/// change applies from the next frame on.
struct CameraSettings {
    // The first window; the only one of a single-window camera.
    Region region; ///< SFNC Width, Height, OffsetX, OffsetY, in sensor pixels
    PixelFormat pixel_format = PixelFormat::mono16;
    std::int64_t exposure_ns = 10 * ns_per_ms; ///< SFNC ExposureTime (there in us)
    Sampling sampling = Sampling::destructive;
    std::int32_t reads = 1;
    // The windows read after the first; entries from `more_count` on keep their default values.
    std::uint32_t more_count = 0;
    std::array<CameraWindow, max_windows - 1> more_windows{};

    /// Applies to the first window.
    ExposureMode exposure_mode = ExposureMode::timed;
    /// The camera writes the exposure it chooses to exposure_ns; `once` returns to `off` when done.
    ExposureAuto exposure_auto = ExposureAuto::off;
    /// Control target: percentile `auto_percentile` of the first window's digital numbers reaches
    /// `auto_target_percent` of the range from black level to full scale.
    double auto_target_percent = 50, auto_percentile = 99;
    double gain_db = 0; ///< SFNC Gain
    AcquisitionMode acquisition_mode = AcquisitionMode::continuous;
    std::uint32_t acquisition_frame_count = 1; ///< MultiFrame only
    /// SFNC TriggerSelector FrameStart; disabled: free run at frame_rate_hz.
    TriggerChoice frame_trigger{.enabled = true};
    std::int64_t trigger_delay_ns = 0;
    TriggerOverlap trigger_overlap = TriggerOverlap::off;
    std::uint32_t trigger_divider = 1; ///< SFNC TriggerDivider: every n-th edge is a trigger
    // SFNC TriggerSelector AcquisitionStart: after AcquisitionStart no frame is taken before this trigger.
    // The trigger itself starts no frame.
    TriggerChoice start_trigger{};
    // SFNC TriggerSelector FrameBurstStart: enables the next burst_frame_count frames. Without a FrameStart
    // trigger the first of them begins at the burst trigger's edge and the others follow at the free-run
    // rate.
    TriggerChoice burst_trigger{};
    std::uint32_t burst_frame_count = 1; ///< SFNC AcquisitionBurstFrameCount
    // SFNC TriggerSelector ExposureStart: its edge starts the exposure. A FrameStart trigger then only arms
    // the camera for one such edge; without a FrameStart trigger the camera is always armed.
    TriggerChoice exposure_trigger{};
    /// SFNC AcquisitionFrameRateEnable; false: the chip's maximum rate.
    bool frame_rate_enabled = true;
    double black_level_dn = 0;                     ///< SFNC BlackLevel
    ImagePattern test_pattern = ImagePattern::off; ///< SFNC TestPattern
    /// SFNC AcquisitionFrameRate: in free run and while a level trigger holds.
    double frame_rate_hz = 10;
    std::array<EventCounter, counter_count> counters{};
    std::array<PulseTimer, timer_count> timers{};

    constexpr bool operator==(const CameraSettings&) const = default;

    [[nodiscard]] constexpr std::size_t window_count() const { return std::size_t{1} + more_count; }
    /// Window `i` of window_count(), in the order in which they are read.
    [[nodiscard]] constexpr CameraWindow window(std::size_t i) const {
        return i == 0 ? CameraWindow{region, exposure_ns, sampling, reads} : more_windows[i - 1];
    }
    /// Replaces all windows by `windows`, 1 to max_windows of them.
    void set_windows(std::span<const CameraWindow> windows);
};

/// Columns and rows of an image.
struct ImageSize {
    std::int32_t width = 0, height = 0;
    constexpr bool operator==(const ImageSize&) const = default;
};
/// Size of the composed image: all windows one below the other, as wide as the widest. Each non-destructive
/// read adds rows of its own.
[[nodiscard]] ImageSize composed_size(const CameraSettings& settings);

/// Longest exposure that a camera accepts. A chip whose counter holds less has less.
inline constexpr std::int64_t max_exposure_ns = 3600 * ns_per_s;
/// Longest wait for a frame: the longest exposure, and a minute for its readout and rendering.
inline constexpr double max_frame_wait_s = static_cast<double>(max_exposure_ns) / ns_per_s + 60;

/// Limits of CameraSettings; constant for the life of the camera.
struct CameraLimits {
    std::int32_t sensor_width = 0, sensor_height = 0;
    double pixel_width_m = 5.5e-6, pixel_height_m = 5.5e-6; ///< pitches of the columns and of the rows
    std::int32_t width_step = 1, height_step = 1;           ///< increments of Width, Height and the offsets
    std::int32_t width_min = 1, height_min = 1;
    std::uint32_t windows_max = 1;
    std::int32_t rows_max = 0; ///< of the composed image; 0: the sensor's height
    bool strict = true;        ///< windows must lie on the sensor; otherwise the chip crops them
    std::array<LineEdges, line_count> lines{LineEdges{.rising = true}};
    int adc_bits = 12;
    std::int64_t exposure_min_ns = 1000, exposure_max_ns = max_exposure_ns;
    double gain_min_db = 0, gain_max_db = 24;
    double frame_rate_min_hz = 0.01, frame_rate_max_hz = 1000;
    double black_level_min_dn = 0, black_level_max_dn = 0; ///< equal: fixed
    double temperature_c = 20;                             ///< of the sensor
    bool overlapped = false; ///< a frame may be exposed while its predecessor is read out
    bool global_shutter = false;
    std::string sensor_name = "generic";
};

/// A setting outside of the limits.
struct InvalidSetting {
    /// SFNC name; "windows" and "reads" are settings that SFNC does not have.
    std::string_view feature;
    std::string what; ///< the feature, its value and what is allowed
};
/// The first of `settings` that `limits` do not allow; none when all are valid.
[[nodiscard]] std::optional<InvalidSetting> find_invalid(const CameraSettings& settings,
                                                         const CameraLimits& limits);
/// InvalidSetting::what of find_invalid(); empty when all are valid.
[[nodiscard]] std::string explain_invalid(const CameraSettings& settings, const CameraLimits& limits);

/// Readout that the chip performs for given CameraSettings.
struct ReadoutAnswer {
    /// Why the chip cannot read such windows; the other members are empty then.
    std::string refusal;
    std::uint32_t window_count = 0;
    std::array<FrameWindow, max_windows> windows{}; ///< with the exposures obtained and the readout's flags
    std::int64_t frame_period_ns = 0;               ///< shortest time between triggers
    std::int64_t readout_ns = 0;                    ///< first to last row slot
};

/// Bits of the settings that the sequencer may change from frame to frame.
enum SequencedFeature : std::uint32_t {
    sequenced_exposure = 1u << 0,
    sequenced_gain = 1u << 1,
    sequenced_black_level = 1u << 2,
    sequenced_offset_x = 1u << 3,
    sequenced_offset_y = 1u << 4,
};
/// One sequencer set: settings of a frame, and the set of the frame after it (`next`).
struct SequenceStep {
    std::int64_t exposure_ns = 10 * ns_per_ms;
    double gain_db = 0;
    double black_level_dn = 0;
    std::int32_t offset_x = 0, offset_y = 0;
    std::uint32_t next = 0;
    constexpr bool operator==(const SequenceStep&) const = default;
};
/// SFNC SequencerControl: each frame advances to the set `next`; each acquisition start returns to `start`.
struct Sequence {
    static constexpr std::size_t max_steps = 8;
    bool enabled = false;
    std::uint32_t features = 0; ///< SequencedFeature bits; the other settings stay as they are
    std::uint32_t start = 0;
    std::array<SequenceStep, max_steps> steps{};
    constexpr bool operator==(const Sequence&) const = default;
};
/// `settings` with those replaced that set `step` of `sequence` changes.
[[nodiscard]] CameraSettings with_step(CameraSettings settings, const Sequence& sequence,
                                       std::uint32_t step) noexcept;

/// Why `sequence` is invalid with `settings`; empty when it is valid.
[[nodiscard]] std::string explain_invalid(const Sequence& sequence, const CameraSettings& settings,
                                          const CameraLimits& limits);

/// Edges of one input line.
struct LineActivity {
    std::uint64_t edges = 0; ///< all edges, whether or not a trigger uses the line
    Time edge;               ///< the last one
    bool high = false;       ///< level after the last edge; low before the first
};

/// Events of the camera and their counts since its construction; scheduling clock. Instants of the frame in
/// progress may lie in the future.
struct CameraActivity {
    std::uint64_t frame_triggers = 0;  ///< edges that started a frame
    std::uint64_t missed_triggers = 0; ///< edges that came too early
    std::uint64_t frames = 0;          ///< frames begun
    Time frame_start, frame_end;       ///< of the last frame: trigger edge, last row out of the chip
    Time exposure_start, exposure_end; ///< of the last frame: first reset, last read
    bool trigger_ready = false;        ///< an edge would be accepted now
    bool start_awaited = false;        ///< acquiring, but the start trigger has not come
    std::uint32_t sequence_step = 0;   ///< sequencer set of the last frame
    std::uint64_t acquisitions = 0;    ///< acquisition starts
    Time acquisition_start;            ///< the last one
    std::array<LineActivity, line_count> lines{};
    std::array<CounterMark, counter_count> counters{};
    std::array<Time, timer_count> timer_resets{};
};

/// Control interface of the camera. Implemented by the emulator; called on a transport's control thread (one
/// at a time). No call blocks for longer than it takes to finish the current block of rows.
class CameraControl {
public:
    virtual ~CameraControl() = default;

    [[nodiscard]] virtual CameraLimits limits() const = 0;
    [[nodiscard]] virtual CameraSettings settings() const = 0;
    /// Why apply() would refuse `settings`: outside the limits, or windows that the chip cannot read. Empty
    /// when it would accept them.
    [[nodiscard]] virtual std::string explain(const CameraSettings& settings) const {
        return explain_invalid(settings, limits());
    }
    /// Applies all of `settings` from the next frame on. Returns false and applies none of them when
    /// explain() gives a reason.
    virtual bool apply(const CameraSettings& settings) = 0;

    /// Starts the acquisition; frame ids restart at 1. Returns false when it is already running.
    virtual bool acquisition_start() = 0;
    /// Stops the acquisition. After the return no new frame is submitted; the frame in progress is abandoned
    /// if `abort`, else finished.
    virtual void acquisition_stop(bool abort) = 0;
    [[nodiscard]] virtual bool acquiring() const = 0;

    /// SFNC TriggerSoftware at `edge`. Returns false when it was not accepted (not armed, other source,
    /// over-trigger); the camera counts that as a missed trigger.
    virtual bool software_trigger(Time edge) = 0;
    /// SFNC Action1 at `edge`, under the rules of software_trigger(). A camera without it never accepts.
    virtual bool action_trigger(Time /*edge*/) { return false; }

    /// SFNC TriggerSoftware of the acquisition start trigger at `edge`. Returns false when the camera does
    /// not await that trigger from software.
    virtual bool software_start_trigger(Time /*edge*/) { return false; }

    /// SFNC TriggerSoftware of the burst trigger and of the exposure trigger, under the same rule.
    virtual bool software_burst_trigger(Time /*edge*/) { return false; }
    virtual bool software_exposure_trigger(Time /*edge*/) { return false; }

    /// SFNC CounterReset and TimerReset.
    virtual void reset_counter(std::size_t /*i*/) {}
    virtual void reset_timer(std::size_t /*i*/) {}

    /// Readout that the chip would perform for `settings`; by default exactly the requested one, with zero
    /// readout time.
    [[nodiscard]] virtual ReadoutAnswer readout(const CameraSettings& settings) const;
    /// Sets the sequence, which takes effect at the next acquisition start. Returns false when a set is
    /// outside the limits, while acquiring, and for a camera without a sequencer.
    virtual bool set_sequence(const Sequence& sequence) { return !sequence.enabled; }
    [[nodiscard]] virtual CameraActivity activity() const { return {}; }
};

} // namespace obscura
