// SPDX-License-Identifier: Apache-2.0
// Sensor: readout planning (when each row is reset and read) and detector (irradiance to digital numbers).
// Read this header first.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/region.hpp"
#include "core/spectral_band.hpp"
#include "core/time.hpp"
#include "sensors/description.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::sensors {
/// Requested window of the sensor; the ReadoutPlan states what the chip reads for it.
struct WindowRequest {
    Region region; ///< in sensor pixels; under push-broom `height` counts lines
    /// From reset to read; with several reads, from the first to the last.
    std::int64_t exposure_ns = 0;
    Sampling sampling = Sampling::destructive;
    /// 1 for destructive, at least 1 for non_destructive, at least 2 for cds and ramp.
    std::int32_t reads = 1;
};

/// Readout flags of a window, sticky for the frame.
enum ReadoutFlag : std::uint32_t {
    exposure_clamped_up = 1u << 0,   ///< T_CLAMPED: request below the shortest possible exposure
    exposure_clamped_down = 1u << 1, ///< T_CLAMPED: request above the longest possible exposure
    /// ROW_SHARED: another window's reads or resets shorten this window's integration.
    row_shared = 1u << 2,
    /// Obtained exposure differs from the request by the row slot grid.
    exposure_quantised = 1u << 3,
    window_cropped = 1u << 4,            ///< not strict: the window was cropped or aligned to fit the array
    trigger_deferred = 1u << 5,          ///< the trigger came during a readout and waited for its row grid
    settings_changed = 1u << 6,          ///< dirty first frame: rows had been reset under the old settings
    charge_saturated = window_saturated, ///< SATURATED: reported by the detector, not by the plan
};
/// A flag as clients see it: in the cards Wnn_FLAG, the truth of frames and chunks.
struct ReadoutFlagName {
    std::uint32_t bit = 0;
    std::string_view name, meaning;
};
/// All flags, in the order of their bits.
[[nodiscard]] std::span<const ReadoutFlagName> readout_flags();
/// Names of the flags that are set, in the order of their bits, separated by '|'.
[[nodiscard]] std::string flag_names(std::uint32_t flags);

/// What a model of times was asked for a window.
struct TimedWindow {
    Time trigger;
    Region region; ///< in sensor pixels
    std::int64_t exposure_ns = 0;
};

/// Readout of one frame after a trigger. Rows appear in the order of the composed image (= readout order). A
/// row integrates light from rows[i].reset to rows[i].read (cds and ramp: between the first and the last
/// read); under a global shutter that is the exposure common to all rows, and the row leaves the chip later:
/// `release` is the earliest time at which a row may be transmitted. Non-destructive reads that are delivered
/// one by one have a window each.
struct ReadoutPlan {
    Time trigger;                       ///< integration of the first row starts here
    std::int32_t width = 0, height = 0; ///< composed image
    std::vector<FrameWindow> windows;
    std::vector<RowTime> rows;            ///< one per composed row
    std::vector<std::int32_t> sensor_row; ///< one per composed row: the row on the chip
    std::vector<Time> release;            ///< one per composed row: its last pixel has left the ADC
    std::int64_t row_ns = 0;              ///< row slot of the first window
    std::int64_t cycle_ns = 0;            ///< rolling: length of one cycle of row slots
    Time cycle_start;                     ///< rolling: start of the first row slot of the cycle of reads
    std::int64_t readout_ns = 0;          ///< first to last row slot, all windows
    std::int64_t frame_period_ns = 0;     ///< shortest time to the next trigger
    /// Shutter::model: ReadoutSettings::timing, which outlives the plan, if pixels have times of their own,
    /// and what it was asked for each of `windows`; `rows` are then those of the middle pixels. Null: rows
    /// have times.
    const models::TimingProgram* pixel_timing = nullptr;
    std::vector<TimedWindow> timed_windows;
};

/// Plans a frame of a camera that has been running with these settings. Reentrant, a pure function of its
/// arguments; re-uses the vectors of `plan`, so that with enough capacity nothing is allocated. Returns an
/// empty string, or the reason why the settings are refused, which names the key.
///
/// A row's integration time is its read time minus that of the last reset event on the row, from any window:
/// reset and select lines are row-wide, and a destructive read resets the row o_R - o_S after its sample. A
/// reset can only take place inside a row slot, so T_w <= T_int < T_w + max(T_row) unless flagged.
[[nodiscard]] std::string plan_readout(const ReadoutSettings& settings,
                                       std::span<const WindowRequest> windows, Time trigger,
                                       ReadoutPlan& plan);

/// A block of rows of a composed image in physical units: irradiance at the entrance pupil, W/m2 per pixel
/// (radiance times the pixel's solid angle), one plane per spectral band, row-major, `width` floats a row.
///
/// Charge spreads between pixels, so a block needs a halo of Detector::halo_rows() rows and columns of the
/// array around it. Halo rows above and below belong to the window of the block's first and last row: those
/// inside the window are rendered at their own time, those outside at the time of the window's nearest row.
/// Halo columns require a block within one window. Missing halo counts as a copy of the outermost row or
/// column, as beyond the edge of the array.
struct IrradianceBand {
    std::int32_t first_row = 0, rows = 0; ///< rows of the composed image to expose
    std::int32_t width = 0;               ///< at least halo_left + the windows' width + halo_right
    std::span<const float> values;        ///< bands x (halo_above + rows + halo_below) x width
    std::int32_t halo_above = 0, halo_below = 0;
    std::int32_t halo_left = 0, halo_right = 0;
};

struct FixedPattern;

/// Gain and black level that a client can change.
struct AnalogSettings {
    double gain_db = 0;
    double black_shift_dn = 0; ///< added to the description's offset_dn
    // Implicit, because most callers have the gain alone.
    constexpr AnalogSettings(double gain = 0, double black_shift = 0) // NOLINT(google-explicit-constructor)
        : gain_db(gain), black_shift_dn(black_shift) {}
};

/// Ground truth of a block of rows, for tests of the software that receives the frames: rows of the composed
/// image. Columns right of a narrow window are not written; an empty span is not written at all.
struct ExposureTruth {
    std::span<float> mean_e;           ///< expected electrons before any noise, rows x width
    std::span<std::uint8_t> saturated; ///< 1 where the charge reached full well, rows x width
};

/// Detector model: converts irradiance to digital numbers. Immutable after construction except for image lag
/// and the run word.
/// expose() is reentrant, neither allocates nor throws, and gives the same bytes for a row in any block of
/// rows and on any instruction set. A sensor with lag stores the charge of every pixel: its frames must be
/// exposed one after the other, and are reproducible only after forget().
class Detector {
public:
    /// `seed` seeds the temporal noise, together with the run word (0 until begin_run()); the fixed patterns
    /// depend on `description.serial` alone. Throws ConfigError, and InputError for invalid maps.
    Detector(const SensorDescription& description, std::span<const SpectralBand> bands, double aperture_m,
             std::uint64_t seed);
    ~Detector();
    Detector(Detector&&) noexcept;
    Detector& operator=(Detector&&) noexcept;

    /// Exposes the rows of `light` and writes their digital numbers, `light.rows * plan.width` of them, to
    /// `dn`. Bit w of the result is set when a pixel of window w reached full well.
    std::uint32_t expose(const ReadoutPlan& plan, const IrradianceBand& light, std::uint64_t frame_id,
                         AnalogSettings analog, std::span<std::uint16_t> dn,
                         const ExposureTruth& truth = {}) const noexcept;

    /// Rows and columns of light required around a block of rows, 0 to max_halo.
    [[nodiscard]] std::int32_t halo_rows() const noexcept;
    static constexpr std::int32_t max_halo = 2;
    /// Whether a block must hold a whole window, with all rows of the array above and below it as its halo
    /// (frame-transfer smear needs the light of whole columns).
    [[nodiscard]] bool needs_whole_columns() const noexcept;
    /// Clears the charge stored from earlier frames (image lag).
    void forget() noexcept;
    /// Begins a run: its temporal noise (shot, reset, amplifier and row noise, RTS noise, particles) is
    /// independent of that of every other run word, and no charge of earlier frames is left. Not while a
    /// frame is exposed. Real-time safe.
    void begin_run(std::uint32_t run) noexcept;
    /// Number of frames before a frame whose charge reaches it as image lag, down to 1e-12 e-; 0 without lag.
    [[nodiscard]] std::uint64_t lag_frames() const noexcept;

    /// Particle hits of a frame, in no particular order.
    [[nodiscard]] std::vector<ParticleHit> hits(const ReadoutPlan& plan, std::uint64_t frame_id) const;
    /// Writes the particle hits of a frame to `list`, up to its capacity; does not allocate. Returns the
    /// number of hits, including those without room.
    std::uint64_t list_hits(const ReadoutPlan& plan, std::uint64_t frame_id,
                            std::vector<ParticleHit>& list) const noexcept;
    [[nodiscard]] const FixedPattern& fixed_pattern() const noexcept;
    /// Values of the description's model that could not be used since construction: charge that is not a
    /// number, negative or beyond 2^31 e-, digital numbers that are not finite. Thread-safe.
    [[nodiscard]] std::uint64_t values_replaced() const noexcept;
    /// From the next exposure on light comes through a pupil of that diameter. Between exposures, on the
    /// thread that asks for them; real-time safe.
    void set_aperture(double aperture_m) noexcept;
    /// Electrons per second and W/m2 at the entrance pupil for a pixel of mean response, one value per
    /// spectral band.
    [[nodiscard]] std::span<const double> electrons_per_s_per_w_m2() const noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace obscura::sensors
