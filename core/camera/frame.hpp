// SPDX-License-Identifier: Apache-2.0
// Frame with its metadata, fixed frame pool, and pixel formats.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "core/camera/intrinsics.hpp"
#include "core/camera/region.hpp"
#include "core/camera/transmit_timestamps.hpp"
#include "core/clock_state.hpp"
#include "core/geometry.hpp"
#include "core/realtime/event_count.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/text/enum_names.hpp"
#include "core/time.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace obscura {

struct SceneTruth;

/// GenICam PFNC values. In a Frame the digital numbers are always 16-bit words, least significant bit
/// aligned, as they came out of the ADC; a transport packs them into the requested format by pack_pixels().
enum class PixelFormat : std::uint32_t {
    mono8 = 0x01080001,
    mono10 = 0x01100003,
    mono12 = 0x01100005,
    mono14 = 0x01100025,
    mono16 = 0x01100007,
    mono10p = 0x010A0046,
    mono12p = 0x010C0047,
};
constexpr auto enum_names(PixelFormat /*type*/) {
    return std::array{EnumName{PixelFormat::mono8, "Mono8"},    EnumName{PixelFormat::mono10, "Mono10"},
                      EnumName{PixelFormat::mono12, "Mono12"},  EnumName{PixelFormat::mono14, "Mono14"},
                      EnumName{PixelFormat::mono16, "Mono16"},  EnumName{PixelFormat::mono10p, "Mono10p"},
                      EnumName{PixelFormat::mono12p, "Mono12p"}};
}

constexpr std::size_t max_windows = 32;
constexpr std::size_t max_truth_bodies = 16;

/// Reset and read time of one row of the composed image.
struct RowTime {
    Time reset;
    Time read;

    constexpr bool operator==(const RowTime&) const = default;
    [[nodiscard]] constexpr std::int64_t exposure_ns() const { return read - reset; }
    [[nodiscard]] constexpr Time mid() const { return midpoint(reset, read); }
};

/// Sampling of the rows of a window. `destructive` samples the signal, resets the row and samples the
/// reset level (double sampling). The others leave the charge in the pixel: `non_destructive` delivers every
/// read, `cds` the last read minus the first (correlated double sampling), `ramp` the slope of a straight
/// line fitted to all reads.
enum class Sampling : std::uint8_t { destructive, non_destructive, cds, ramp };
constexpr auto enum_names(Sampling /*type*/) {
    return std::array{EnumName{Sampling::destructive, "destructive"},
                      EnumName{Sampling::non_destructive, "non-destructive"}, EnumName{Sampling::cds, "cds"},
                      EnumName{Sampling::ramp, "ramp"}};
}

/// Window flag: a pixel reached full well and later charge is lost (a non-destructive read does not reset the
/// pixel). Known only when the rows are ready, so Frame::saturated_windows holds it.
constexpr std::uint32_t window_saturated = 1u << 7;

/// One sensor window inside the composed image. Windows are composed one below the other in readout order,
/// left aligned; pixels right of a narrow window are 0.
struct FrameWindow {
    Region sensor;            ///< where the window lies on the sensor
    std::int32_t image_y = 0; ///< its first row in the composed image
    std::int64_t exposure_requested_ns = 0;
    /// Sticky readout flags (sensors::ReadoutFlag), see window_flags().
    std::uint32_t flags = 0;
    std::int64_t exposure_min_ns = 0, exposure_max_ns = 0; ///< obtained, over the window's rows
    std::uint32_t request = 0;                             ///< index of the requested window
    Sampling sampling = Sampling::destructive;
    std::int32_t reads = 1, read_index = 0; ///< non-destructive: read `read_index` of `reads`
    std::int64_t read_spacing_ns = 0;       ///< between successive non-destructive reads
};

/// Least delay of a row that was ready in time for which the frame is stalled.
inline constexpr std::int64_t release_stall_ns = ns_per_ms;

enum FrameFlag : std::uint32_t {
    frame_late = 1u << 0,     ///< at least one row was ready after its release time
    frame_repeated = 1u << 1, ///< pixels are those of an earlier frame
    frame_partial = 1u << 2,  ///< rows past `rows_ready` hold no image
    frame_dropped = 1u << 3,  ///< holds no pixels at all
    /// Exposure or window settings were not met exactly, see the windows' flags.
    frame_readout_clamped = 1u << 4,
    /// Image lag is not that of the frame before, which was not exposed: the first frame of an acquisition,
    /// or the frame after one without pixels.
    frame_lag_unknown = 1u << 5,
    frame_degraded = 1u << 6, ///< at least one row is not of QualityLevel::full, see FrameInfo::quality
    frame_biased = 1u << 7,   ///< at least one row is of a biased level, see is_biased()
    // Bits 8 and 9 of reported flags hold the state of a clock, see reported_flags().
    /// At least one row was ready in time and left more than release_stall_ns after its time: the system did
    /// not run the thread that releases rows.
    frame_stalled = 1u << 10,
    /// Rendering failed (an exception): rows are black, or those of an earlier frame.
    frame_failed = 1u << 11,
    /// A pose is not known for the time of the frame: the last known one is shown. See the ages of poses.
    frame_pose_held = 1u << 12,
};

/// Name and pose of a body at mid-exposure of the frame, in the scene's inertial frame.
struct BodyTruth {
    std::array<char, 32> name{}; ///< zero terminated
    Pose pose;
    double pose_age_s = 0; ///< see GroundTruth::camera_pose_age_s
};

/// Ground truth of the scene: the reference that flight software is compared with.
struct GroundTruth {
    /// Mid-exposure of the frame: half way between the first reset and the last read.
    Time mid_exposure;
    Pose camera; ///< at mid_exposure, inertial
    /// Time by which mid_exposure is later than the newest pose received, or outside the poses of a file: the
    /// pose is extrapolated or held. 0: interpolated or constant.
    double camera_pose_age_s = 0;
    Vec3 sun_position_m; ///< at mid_exposure, inertial
    std::uint32_t body_count = 0;
    std::array<BodyTruth, max_truth_bodies> bodies{};
    std::uint64_t seed = 0;
    std::uint32_t run = 0; ///< run word: keys the temporal noise of the acquisition, with the seed
    Intrinsics intrinsics;
};

/// The camera's lines, as bits of a status word: the inputs from Line0 on, then the output.
enum LineStatusBit : std::uint32_t { line_status_line0 = 1u << 0, line_status_output = 1u << 4 };

/// Track of one particle through the sensitive layer. Pixels are counted from the outer corner of pixel
/// (0, 0) of the array.
struct ParticleHit {
    Time time;
    double x_px = 0, y_px = 0;   ///< point of entry
    double dx_px = 0, dy_px = 0; ///< projection of the track on the array
    double charge_e = 0;         ///< along the whole track
};

/// Ground truth per pixel, for frames of a pool that keeps it. Sized for the largest frame; the first
/// `info.width` x `info.height` entries are valid, row-major. A row is final when the same row of pixels is.
struct PixelTruth {
    std::vector<float> mean_e;           ///< expected electrons before any noise
    std::vector<std::uint8_t> saturated; ///< 1 where the charge reached full well
    std::vector<ParticleHit> hits;       ///< particles while any row integrated; times as in row_times()
    std::uint64_t hits_left_out = 0;     ///< further particles, for which `hits` had no room
    static constexpr std::size_t hits_kept = 16384;
};

/// Metadata of a frame. Written by the producer before the frame is submitted.
struct FrameInfo {
    /// Counts from 1 at each acquisition start; drives the random numbers.
    std::uint64_t frame_id = 0;
    std::uint64_t trigger_id = 0;
    Time trigger_edge;                         ///< the edge's own time stamp, not the time of processing
    std::int64_t tai_offset_ns = 0;            ///< TAI minus the scheduling clock when the trigger was seen
    ClockState clock_state = ClockState::free; ///< of the trigger's source at that edge
    std::int32_t width = 0, height = 0;        ///< of the composed image
    int bits_per_pixel = 16;                   ///< ADC depth: digital numbers are < 2^bits
    PixelFormat pixel_format = PixelFormat::mono16; ///< requested by the client
    double gain_db = 0;
    std::int64_t exposure_ns = 0;    ///< requested, first window
    std::uint32_t line_status = 0;   ///< LineStatusBit of every line at the trigger's edge
    std::uint32_t sequence_step = 0; ///< set of the sequencer; 0 without one
    std::uint32_t window_count = 1;
    std::array<FrameWindow, max_windows> windows{};
    GroundTruth truth;

    // Time stamps of the processing steps, scheduling clock; 0 for a step not reached. `pose`: the scene's
    // poses at mid-exposure have been sampled.
    Time seen, pose, render_begin, render_end, detector_end;
    /// Final before the last row is published, as are the flags frame_degraded and frame_biased.
    FrameQuality quality;
    /// Transmit timestamps; null when timing is not recorded; outlives the frame.
    TransmitTimestamps* transmit = nullptr;

    /// Called by the transport in `slot` when bytes of this frame leave.
    void note_transmit(std::size_t slot, Time now) const noexcept {
        if (transmit != nullptr) transmit->note(slot, now);
    }
};

class FramePool;

/// A frame of the pool. Life cycle: the producer acquires it, fills `info` and the row times, submits it to
/// the transports while pixels are still being filled, and publishes rows from the top down; published rows
/// are read-only for all threads. Destruction of the last FrameRef returns it to the pool. No member
/// allocates or throws.
class Frame {
public:
    FrameInfo info;
    std::atomic<std::uint32_t> flags{0};
    /// Bit w: a pixel of window w has reached full well in the rows so far.
    std::atomic<std::uint32_t> saturated_windows{0};
    /// The readout flags of window `w` with window_saturated, as far as rows are ready.
    [[nodiscard]] std::uint32_t window_flags(std::size_t w) const noexcept {
        const bool full = (saturated_windows.load(std::memory_order_relaxed) >> w & 1) != 0;
        return info.windows[w].flags | (full ? window_saturated : 0);
    }
    /// Whether the frame has room for an image of this size.
    [[nodiscard]] bool fits(std::int32_t width, std::int32_t height) const noexcept {
        return width >= 0 && height >= 0 && static_cast<std::size_t>(height) <= max_rows_ &&
               static_cast<std::size_t>(width) * static_cast<std::size_t>(height) <= max_pixels_;
    }

    /// Row-major, `info.width` pixels a row without padding.
    [[nodiscard]] std::span<std::uint16_t> pixels() noexcept {
        return {pixels_, static_cast<std::size_t>(info.width) * static_cast<std::size_t>(info.height)};
    }
    [[nodiscard]] std::span<const std::uint16_t> pixels() const noexcept {
        return {pixels_, static_cast<std::size_t>(info.width) * static_cast<std::size_t>(info.height)};
    }
    [[nodiscard]] std::span<std::uint16_t> row(std::int32_t y) noexcept {
        const auto w = static_cast<std::size_t>(info.width);
        return {pixels_ + static_cast<std::size_t>(y) * w, w};
    }
    [[nodiscard]] std::span<const std::uint16_t> row(std::int32_t y) const noexcept {
        const auto w = static_cast<std::size_t>(info.width);
        return {pixels_ + static_cast<std::size_t>(y) * w, w};
    }
    /// One entry per row of the composed image.
    [[nodiscard]] std::span<RowTime> row_times() noexcept {
        return {row_times_, static_cast<std::size_t>(info.height)};
    }
    [[nodiscard]] std::span<const RowTime> row_times() const noexcept {
        return {row_times_, static_cast<std::size_t>(info.height)};
    }

    /// Ground truth per pixel; null unless the pool keeps it.
    [[nodiscard]] PixelTruth* pixel_truth() noexcept { return pixel_truth_; }
    [[nodiscard]] const PixelTruth* pixel_truth() const noexcept { return pixel_truth_; }

    /// Producer: memory for the truth table; null unless the pool keeps it.
    [[nodiscard]] SceneTruth* scene_truth() noexcept { return scene_truth_; }
    /// Producer: declares the truth table final, before the last row.
    void publish_scene_truth() noexcept { scene_truth_final_.store(true, std::memory_order_release); }
    /// Consumer: the truth table; null without one, before it is final, and of frames not made to their end.
    [[nodiscard]] const SceneTruth* final_scene_truth() const noexcept {
        return scene_truth_final_.load(std::memory_order_acquire) ? scene_truth_ : nullptr;
    }

    /// Producer: declares rows [0, rows) final; `rows` never decreases. Wakes the waiting transports.
    void publish_rows(std::int32_t rows) noexcept;
    /// Producer: declares that no further row will come. Waiters return with the rows that are final;
    /// `frame_partial` is set unless the frame was complete.
    void abandon() noexcept;
    [[nodiscard]] std::int32_t rows_ready() const noexcept {
        return static_cast<std::int32_t>(progress_.load(std::memory_order_acquire) & ~abandoned_bit);
    }
    [[nodiscard]] bool abandoned() const noexcept {
        return (progress_.load(std::memory_order_acquire) & abandoned_bit) != 0;
    }
    [[nodiscard]] bool complete() const noexcept { return rows_ready() >= info.height; }
    /// Consumer: blocks until at least `rows` rows are final or the frame is abandoned; returns the number of
    /// final rows. Beats `heartbeat`, if any, while waiting.
    std::int32_t wait_rows(std::int32_t rows, Heartbeat* heartbeat = nullptr) const noexcept;
    /// Consumer that also waits for other events: registers `waiter`, which publish_rows() and abandon()
    /// notify until the frame returns to its pool; `waiter` must exist until then. Call it inside
    /// Transport::submit(). Returns false if max_waiters are registered.
    bool add_waiter(EventCount& waiter) noexcept;
    static constexpr std::uint32_t max_waiters = 4;

private:
    friend class FramePool;
    friend class FrameRef;
    static constexpr std::uint32_t abandoned_bit = 1u << 31;

    std::uint16_t* pixels_ = nullptr;
    RowTime* row_times_ = nullptr;
    PixelTruth* pixel_truth_ = nullptr;
    SceneTruth* scene_truth_ = nullptr;
    std::size_t max_pixels_ = 0, max_rows_ = 0;
    std::atomic<bool> scene_truth_final_{false};
    std::atomic<std::uint32_t> progress_{0};
    std::atomic<std::uint32_t> references_{0};
    mutable EventCount progressed_;
    std::array<std::atomic<EventCount*>, max_waiters> waiters_{};
    void notify_waiters() noexcept;
};

/// Shared ownership of a pooled frame; the pool must outlive it. Copying is one atomic increment.
class FrameRef {
public:
    FrameRef() = default;
    FrameRef(const FrameRef& other) noexcept : frame_(other.frame_) { retain(); }
    FrameRef(FrameRef&& other) noexcept : frame_(std::exchange(other.frame_, nullptr)) {}
    FrameRef& operator=(FrameRef other) noexcept {
        std::swap(frame_, other.frame_);
        return *this;
    }
    ~FrameRef() {
        if (frame_ != nullptr) frame_->references_.fetch_sub(1, std::memory_order_acq_rel);
    }

    [[nodiscard]] Frame* get() const noexcept { return frame_; }
    Frame* operator->() const noexcept { return frame_; }
    Frame& operator*() const noexcept { return *frame_; }
    explicit operator bool() const noexcept { return frame_ != nullptr; }

private:
    friend class FramePool;
    explicit FrameRef(Frame* adopted) noexcept : frame_(adopted) {}
    void retain() noexcept {
        if (frame_ != nullptr) frame_->references_.fetch_add(1, std::memory_order_relaxed);
    }
    Frame* frame_ = nullptr;
};

/// Ground truth that the frames of a pool keep.
struct KeptTruth {
    bool pixels = false;           ///< PixelTruth
    std::size_t scene_entries = 0; ///< SceneTruth with room for so many entries; 0: none
};

/// A fixed number of frames, allocated and paged in once.
class FramePool {
public:
    /// Allocates `frames` frames of at most `max_pixels` pixels and `max_rows` rows. Throws std::bad_alloc.
    FramePool(std::size_t frames, std::size_t max_pixels, std::size_t max_rows, KeptTruth truth = {});

    /// A free frame with `info` reset and no rows ready; empty when all are in use. Thread-safe, real-time
    /// safe.
    [[nodiscard]] FrameRef acquire() noexcept;
    [[nodiscard]] std::size_t size() const noexcept { return count_; }
    [[nodiscard]] std::size_t in_use() const noexcept;
    [[nodiscard]] std::size_t max_pixels() const noexcept { return max_pixels_; }
    [[nodiscard]] std::size_t max_rows() const noexcept { return max_rows_; }

private:
    std::size_t count_;
    std::size_t max_pixels_;
    std::size_t max_rows_;
    std::unique_ptr<std::uint16_t[]> pixel_store_;
    std::unique_ptr<RowTime[]> row_store_;
    std::vector<PixelTruth> truth_store_;
    std::shared_ptr<SceneTruth[]> scene_truth_store_;
    std::unique_ptr<Frame[]> frames_;
    std::atomic<std::size_t> next_{0};
};

/// Bytes of one row of `width` pixels in `format`.
[[nodiscard]] std::size_t packed_row_bytes(PixelFormat format, std::int32_t width) noexcept;
/// Significant bits of a pixel: 8 to 16.
[[nodiscard]] int significant_bits(PixelFormat format) noexcept;

/// Bytes of a whole image; Mono10p and Mono12p continue across row ends without padding as PFNC prescribes.
[[nodiscard]] std::size_t packed_bytes(PixelFormat format, std::int64_t pixels) noexcept;
/// Packs `pixels` digital numbers of `bits` depth into `format`, little endian. Formats deeper than the data
/// keep the digital number as it is (LSB aligned, as the chip delivered it); shallower ones drop the low
/// bits. For the packed formats `pixels.size()` must be a multiple of 4 (Mono10p) or 2 (Mono12p) unless it is
/// the image's end.
void pack_pixels(PixelFormat format, int bits, std::span<const std::uint16_t> pixels,
                 std::span<std::uint8_t> out) noexcept;

} // namespace obscura
