// SPDX-License-Identifier: Apache-2.0
// Frame pipeline: readout plan, rendering and detector of one frame, in pipelined row blocks.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/camera_counters.hpp"
#include "core/camera/frame.hpp"
#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/camera/auto_exposure.hpp"
#include "emulator/camera/frame_origins.hpp"
#include "emulator/camera/scene_clock.hpp"
#include "emulator/render/frame_light.hpp"
#include "emulator/render/frame_work.hpp"
#include "emulator/render/kept_frames.hpp"
#include "emulator/render/render_faults.hpp"
#include "emulator/render/render_thread.hpp"
#include "renderer/renderer.hpp"
#include "sensors/readout/sequencer.hpp"
#include "sensors/sensor.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace obscura::emulator {

/// Parameters of one frame. The pixels depend on frame_id, scene_time, shown, `settings`, the configuration
/// with its seed and the acquisition's run word, and on those of the frames since the acquisition start: a
/// sensor keeps charge of the frame before (image lag), its rows may have been reset under older settings,
/// and a trigger during a readout waits for the row grid. The other time stamps are only recorded.
struct FrameOrder {
    std::uint64_t frame_id = 1;
    std::uint64_t trigger_id = 1;
    Time trigger_edge;              ///< scheduling clock
    Time seen;                      ///< scheduling clock
    Time scene_time;                ///< at the trigger edge; the readout is planned in it
    SceneShown shown{};             ///< from scene_time to the time of the scene that is rendered
    std::int64_t tai_offset_ns = 0; ///< TAI minus the scheduling clock
    ClockState clock_state = ClockState::free;
    CameraSettings settings;
};

/// The frame that is expected next. It is taken for that of a trigger if nothing in the image has moved by
/// more than `tolerance_px`: because the edge came earlier or later, or other poses came meanwhile.
struct ExpectedFrame {
    FrameOrder order;           ///< its stamps of the trigger are not used
    std::optional<Time> edge{}; ///< its trigger's, scheduling clock, as expected; none: unknown
    double tolerance_px = 0;
    std::int64_t max_ahead_ns = 0; ///< rendering begins no earlier before `edge`; 0: as early as it can
    bool exact_time = true; ///< what it shows does not depend on the edge: it must come at that scene time
};

/// Receiver of the detector's progress.
class RowSink {
public:
    virtual ~RowSink() = default;
    /// Rows [0, rows) of the frame are final. Called on the detector thread: must not block, allocate, lock
    /// or throw.
    virtual void rows_exposed(std::int32_t rows) noexcept = 0;
};

struct FrameMakerSettings {
    std::int32_t band_rows = 64; ///< rows of a row block
    std::int32_t max_rows = 0;   ///< rows of a composed image; 0: those of the sensor
    std::uint64_t seed = 1;      ///< recorded in the frame's ground truth
    ThreadSettings thread{};     ///< detector thread
    std::uint32_t run = 0;       ///< run word of the first acquisition
    bool same_run = true;        ///< every acquisition has this run word; false: each the next one
    bool scene_truth = false;    ///< frames have truth tables
    bool live_poses = false;     ///< a simulator moves the scene
    /// Expected frames are reprojected to the true edge and poses, where they differ: with enter_render.
    bool reprojects = false;
    /// Frames of one window are rendered at levels that keep their rows in time, with enter_render.
    bool adapts = false;
    std::int64_t reserve_ns = 0; ///< so much earlier than the detector needs it, light is to be there
    double floor = 0;            ///< error above which a frame counts as failed; 0: none does
    /// Frames are due: what the renderer throws makes rows black, not an end.
    bool real_time = false;
    double max_pose_age_s = 0; ///< age above which a pose counts as held
    double target_error = 0;   ///< that rendering has, for the record of frames that adapt
    /// Frames are rendered on a thread of their own, which calls this first, expected ones before their
    /// trigger; empty: on the calling thread.
    std::function<void()> enter_render{};
};

/// Row block pipeline: the calling thread, or a RenderThread, renders block k+1 (over the renderer's own
/// workers) while a thread of this object exposes block k in the detector, a few rows at a time. A block lies
/// within one window and is rendered with the halo of rows and columns that the detector requires. The light
/// of a frame that has been expected rightly is there already (RenderThread). Makes one frame at a time;
/// thread-bound where not stated otherwise; no allocation after construction.
class FrameMaker {
public:
    /// The references must outlive the maker. Throws ConfigError if the sensor's readout cannot be planned.
    FrameMaker(const renderer::Renderer& renderer, sensors::Detector& detector,
               const SensorDescription& sensor, const Clock& clock, FrameMakerSettings settings);
    ~FrameMaker();
    FrameMaker(const FrameMaker&) = delete;
    FrameMaker& operator=(const FrameMaker&) = delete;

    /// Plans the readout and writes `frame.info` and the row times. Frame 1 starts an acquisition. Returns
    /// empty, or the reason why the chip cannot do that or the frame is too small; the frame is then
    /// unchanged.
    [[nodiscard]] std::string prepare(const FrameOrder& order, Frame& frame);
    /// Reads a frame out of the chip without output, because later frames depend on it.
    void skip(const FrameOrder& order);
    /// Makes the pixels of the frame prepared last. Rows are reported to `sink`, or published at once if it
    /// is null. Returns false if `cancel` became true before the end: no row follows those reported so far.
    /// What the frame costs goes to `work`, if any, which must live until the return. As soon as the frame is
    /// rendered, that of the frame `next`, if any, begins (FrameMakerSettings::enter_render).
    bool fill(Frame& frame, RowSink* sink = nullptr, const std::atomic<bool>* cancel = nullptr,
              FrameWork* work = nullptr, const ExpectedFrame* next = nullptr);
    /// Before the first frame, of one that adapts: what a frame takes at full quality on this machine, and by
    /// how much earlier than the detector needs it light is to be there.
    void set_render_speed(std::int64_t frame_ns, std::int64_t reserve_ns) noexcept;
    [[nodiscard]] std::int64_t reserve_ns() const noexcept { return reserve_ns_; }
    /// Begins to render the frame that is expected next. Its frame is made with that light if it turns out as
    /// expected in all that the light depends on, its rows within the tolerance.
    void render_ahead(const ExpectedFrame& expected) noexcept;
    /// Whether an expected frame can be rendered before its order is complete.
    [[nodiscard]] bool renders_ahead() const noexcept { return render_thread_ != nullptr; }
    /// Whether the expected frame has been rendered.
    [[nodiscard]] bool expected_is_ready() const noexcept {
        return render_thread_ != nullptr && render_thread_->ready();
    }
    /// Stops rendering a frame that is not expected any more. Thread-safe.
    void forget_expected() noexcept {
        if (render_thread_ != nullptr) render_thread_->cancel();
    }
    /// Thread-safe.
    [[nodiscard]] LodCounters lod_counters() const noexcept {
        return {lod_frames_.load(std::memory_order_relaxed), lod_tiles_.load(std::memory_order_relaxed),
                doubtful_frames_.load(std::memory_order_relaxed)};
    }
    [[nodiscard]] AheadCounters ahead_counters() const noexcept {
        return render_thread_ != nullptr ? render_thread_->counters() : AheadCounters{};
    }
    /// prepare() and fill() in one call, for frames made offline.
    [[nodiscard]] std::string make(const FrameOrder& order, Frame& frame);
    /// The next frames prepared are rendered at these levels of their groups of rows
    /// (FrameQuality::group_rows_for()), as were those of a frame that adapted; empty: full.
    void set_levels(std::span<const QualityLevel> levels) {
        fixed_levels_.assign(levels.begin(), levels.end());
    }
    /// Whole frames are kept from now on: those that follow can have levels from QualityLevel::reprojected
    /// on. Of a maker without FrameMakerSettings::enter_render. Allocates.
    void keep_frames() {
        kept_ = KeptFrames([this] { return make_reprojection_source(); });
    }
    /// Thread-safe.
    [[nodiscard]] QualityCounters quality_counters() const noexcept;
    /// Frames with frame_failed, and with frame_pose_held. Thread-safe.
    [[nodiscard]] std::uint64_t failed_frames() const noexcept {
        return failed_frames_.load(std::memory_order_relaxed);
    }
    [[nodiscard]] std::uint64_t frames_with_held_poses() const noexcept {
        return poses_held_.load(std::memory_order_relaxed);
    }
    /// See sensors::Detector::values_replaced(). Thread-safe.
    [[nodiscard]] std::uint64_t sensor_values_replaced() const noexcept {
        return detector_.values_replaced();
    }
    /// What rendering has thrown. Thread-safe.
    [[nodiscard]] RenderFaults& faults() noexcept { return faults_; }

    /// Run word of the current or latest acquisition; that of the first before it. Thread-safe.
    [[nodiscard]] std::uint32_t run() const noexcept { return run_.load(std::memory_order_relaxed); }
    /// Exposures, image and timing that the chip obtains with `settings`. Thread-safe; allocates.
    [[nodiscard]] ReadoutAnswer answer(const CameraSettings& settings) const;

    /// Uses `renderer` from the next prepared frame on. It must have the same number of spectral bands and
    /// must outlive the maker or the next replacement in use. Thread-safe.
    void replace_renderer(const renderer::Renderer& renderer) noexcept { next_renderer_.store(&renderer); }
    /// True if frames are now made with `renderer`, or one is rendered ahead.
    [[nodiscard]] bool uses(const renderer::Renderer& renderer) const noexcept {
        return renderer_.load() == &renderer || (render_thread_ != nullptr && render_thread_->uses(renderer));
    }

    /// Origins of the frames prepared last. Thread-safe.
    [[nodiscard]] const FrameOrigins& origins() const noexcept { return origins_; }

    /// Row blocks exposed in the detector since construction. Thread-safe.
    [[nodiscard]] std::uint32_t row_blocks_made() const noexcept {
        return done_.load(std::memory_order_relaxed);
    }
    /// Progress count that grows while a frame is made, also within a slow block. Thread-safe.
    [[nodiscard]] std::uint64_t progress() const noexcept {
        return row_blocks_made() + current().rays_traced() + current().samples_taken();
    }
    /// Acquisitions begun since construction.
    [[nodiscard]] std::uint32_t acquisitions() const noexcept {
        return acquisitions_.load(std::memory_order_relaxed);
    }
    /// The plan of the frame prepared last, in scene time.
    [[nodiscard]] const sensors::ReadoutPlan& plan() const noexcept { return plan_; }
    /// Its rows in the time of the scene that is rendered.
    [[nodiscard]] std::span<const RowTime> shown_rows() const noexcept { return light_.rows; }
    /// Times of the pixels of each of its windows, where they have their own; else empty.
    [[nodiscard]] std::span<const renderer::PixelTimes> pixel_times() const noexcept {
        return light_.pixel_times;
    }
    /// Histogram of the first window of the frame filled last, before any test pattern; for frames with
    /// ExposureAuto only.
    [[nodiscard]] const DnHistogram& histogram() const noexcept { return histogram_; }
    /// Time from the trigger of the frame prepared last, delays included, until the chip accepts another.
    [[nodiscard]] std::int64_t busy_ns() const noexcept {
        return plan_.trigger - asked_start_ + plan_.frame_period_ns;
    }
    /// True if a frame triggered at `scene_time` begins before the frame planned last has been read out.
    [[nodiscard]] bool overlaps(Time scene_time) const noexcept;
    /// Scheduling clock minus scene time of the frame prepared last.
    [[nodiscard]] std::int64_t scene_to_clock_ns() const noexcept { return scene_to_clock_ns_; }

private:
    static constexpr std::uint32_t buffer_count = 2;
    [[nodiscard]] std::string plan_frame(const FrameOrder& order);
    [[nodiscard]] std::unique_ptr<renderer::ReprojectionSource> make_reprojection_source() const;
    [[nodiscard]] std::string find_earlier() noexcept;
    void list_scene_truth(Frame& frame);
    void note_lod_deficit(FrameQuality& quality, const renderer::RenderWork& work) noexcept;
    void describe_light(const FrameOrder& order, const sensors::ReadoutPlan& plan,
                        const renderer::Renderer& renderer, FrameLight& light) const noexcept;
    void list_row_blocks(FrameLight& light) const noexcept;
    void set_due(const sensors::ReadoutPlan& plan, FrameLight& light) const noexcept;
    void finish_quality(Frame& frame, bool by_level) noexcept;
    void flag_faults(Frame& frame) noexcept;
    void flag_held_poses(Frame& frame) noexcept;
    [[nodiscard]] RenderThread::Tolerance tolerance(const ExpectedFrame& frame) const noexcept;
    void wait_for_buffer(std::uint32_t number, FrameWork* work) const noexcept;
    [[nodiscard]] std::span<const float> render_block(std::uint32_t number, const std::atomic<bool>* cancel,
                                                      FrameWork* work, bool& by_level);
    void run_detector() noexcept;
    void expose_row_block(std::uint32_t number) noexcept;
    void expose_rows(const RowBlock& block, std::span<const float> light, bool timed) noexcept;
    void paint_pattern(std::int32_t first_row, std::int32_t rows) noexcept;

    [[nodiscard]] const renderer::Renderer& current() const noexcept {
        return *renderer_.load(std::memory_order_acquire);
    }

    std::atomic<const renderer::Renderer*> renderer_, next_renderer_{nullptr};
    sensors::Detector& detector_;
    const Clock& clock_;
    const SensorDescription sensor_;
    const ReadoutSettings& readout_;
    const int adc_bits_;
    const double offset_dn_;
    const FrameMakerSettings settings_;
    std::size_t band_count_;
    std::int32_t buffer_rows_; ///< rows of a buffer, halo included

    sensors::ReadoutSequencer sequencer_;
    sensors::ReadoutPlan plan_;
    Time asked_start_; ///< requested exposure start, scene time
    FrameLight light_;
    std::vector<QualityLevel> fixed_levels_;
    KeptFrames kept_;                               ///< see keep_frames()
    Time last_edge_;                                ///< of the frame prepared before; 0: none
    std::int64_t reserve_ns_;                       ///< see FrameMakerSettings::reserve_ns
    std::atomic<std::int64_t> detector_rows_ns_{0}; ///< time that the detector needs for rows_at_a_time
    std::atomic<std::uint64_t> degraded_{0}, failed_{0};
    mutable RenderFaults faults_; ///< outlives the render thread
    std::atomic<std::uint64_t> failed_frames_{0}, poses_held_{0};
    std::array<std::atomic<std::uint64_t>, quality_level_count> worst_{};
    // State of the last frame rendered, see QualityCounters.
    std::atomic<QualityLevel> last_level_{QualityLevel::full};
    std::atomic<std::uint32_t> last_reasons_{0};
    std::atomic<std::int32_t> last_rows_degraded_{0};
    std::atomic<float> last_error_{0};
    std::atomic<std::int64_t> last_margin_us_{0};
    std::vector<std::byte> truth_workspace_;
    std::atomic<std::uint64_t> lod_frames_{0}, lod_tiles_{0}, doubtful_frames_{0}; ///< see LodCounters
    std::int64_t scene_to_clock_ns_ = 0;
    FrameOrigins origins_;
    std::atomic<std::uint32_t> run_;
    bool has_run_ = false; ///< an acquisition has begun
    std::atomic<std::uint32_t> acquisitions_{0};
    std::uint64_t lag_from_frame_ = 0; ///< frame whose charge the detector keeps, whole; 0: none
    std::unique_ptr<BlockRenderer> blocks_;
    std::array<std::vector<float>, buffer_count> buffers_;
    std::vector<std::span<const float>> block_light_; ///< of the current frame's blocks, once posted

    // The frame that is expected next.
    sensors::ReadoutSequencer expected_sequencer_;
    sensors::ReadoutPlan expected_plan_;
    FrameLight expected_light_;
    std::unique_ptr<RenderThread> render_thread_; ///< null: the calling thread renders

    // Current frame, for the detector thread: written before the first block of a frame is posted.
    Frame* frame_ = nullptr;
    double black_shift_dn_ = 0;
    ImagePattern pattern_ = ImagePattern::off;
    bool measured_ = false; ///< the frame's numbers enter the histogram
    DnHistogram histogram_;
    RowSink* sink_ = nullptr;
    FrameWork* work_ = nullptr;

    // Running counts of row blocks over all frames: posted by the rendering thread, done by the detector
    // thread.
    std::atomic<std::uint32_t> posted_{0};
    std::atomic<std::uint32_t> done_{0};
    std::uint32_t frame_start_ = 0; ///< number of the first row block of the current frame
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

} // namespace obscura::emulator
