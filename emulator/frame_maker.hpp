// Makes one frame: plan -> render -> detector, in row blocks that are pipelined.
#pragma once

#include "core/camera.hpp"
#include "core/clock.hpp"
#include "core/frame.hpp"
#include "core/realtime.hpp"
#include "emulator/auto_exposure.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"
#include "sensors/sequencer.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace obscura::emulator {

/// What is to be made. The pixels depend on frame_id, scene_time, `settings` and the configuration with its
/// seed, and on those of the frames since the acquisition started: a sensor remembers the charge of the frame
/// before (image lag), its rows may have been reset under older settings, and a trigger that lands in a
/// readout waits for the row grid. The other stamps only travel along.
struct FrameOrder {
    std::uint64_t frame_id = 1;
    std::uint64_t trigger_id = 1;
    Time trigger_edge;              ///< scheduling clock
    Time seen;                      ///< scheduling clock
    Time scene_time;                ///< what the scene's clock shows at the trigger's edge
    std::int64_t tai_offset_ns = 0; ///< TAI minus the scheduling clock
    ClockState clock_state = ClockState::free;
    CameraSettings settings;
};

/// Is told how far the detector has come.
class RowSink {
public:
    virtual ~RowSink() = default;
    /// Rows [0, rows) of the frame are final. Called on the detector thread: must not block, allocate, lock
    /// or throw.
    virtual void rows_exposed(std::int32_t rows) noexcept = 0;
};

struct FrameMakerSettings {
    std::int32_t band_rows = 64; ///< rows of a row block
    std::int32_t max_rows = 0;   ///< of a composed image; 0: as many as the sensor has
    std::uint64_t seed = 1;      ///< recorded in the frame's ground truth
    ThreadSettings thread{};     ///< the detector's
};

/// Row block pipeline: the calling thread renders block k+1 (over the renderer's own workers) while a thread
/// of this object takes block k through the detector. A block lies within one window and is rendered with the
/// rows and columns around it that the detector wants. One frame at a time, one calling thread at a time;
/// after construction nothing here allocates.
class FrameMaker {
public:
    /// The references must outlive the maker. Throws ConfigError when the sensor cannot be read out at all.
    FrameMaker(const renderer::Renderer& renderer, sensors::Detector& detector,
               const SensorDescription& sensor, const Clock& clock, FrameMakerSettings settings);
    ~FrameMaker();
    FrameMaker(const FrameMaker&) = delete;
    FrameMaker& operator=(const FrameMaker&) = delete;

    /// Plans the readout and writes `frame.info` and the row times. Frame 1 starts an acquisition. Empty, or
    /// the reason why the chip cannot do that or the frame has no room for it; then the frame is untouched.
    [[nodiscard]] std::string prepare(const FrameOrder& order, Frame& frame);
    /// The chip reads this frame, but nobody takes it: later frames depend on that.
    void skip(const FrameOrder& order);
    /// Makes the pixels of the frame prepared last. Rows go to `sink`, or are published at once when there is
    /// none. False when `cancel` became true on the way: then the rows told of so far are all there will be.
    bool fill(Frame& frame, RowSink* sink = nullptr, const std::atomic<bool>* cancel = nullptr);
    /// prepare() and fill() at once and without any waiting: a frame to look at.
    [[nodiscard]] std::string make(const FrameOrder& order, Frame& frame);

    /// What the chip would make of `settings`. Any thread; allocates.
    [[nodiscard]] ReadoutAnswer answer(const CameraSettings& settings) const;

    /// From the frame prepared next on, `renderer` is used: the same number of spectral bands, and it must
    /// outlive the maker or the next replacement that was taken on. Any thread.
    void replace_renderer(const renderer::Renderer& renderer) noexcept { next_renderer_.store(&renderer); }
    /// Whether frames are made with `renderer` by now.
    [[nodiscard]] bool uses(const renderer::Renderer& renderer) const noexcept {
        return renderer_.load() == &renderer;
    }

    /// Row blocks that have gone through the detector so far. Any thread.
    [[nodiscard]] std::uint32_t row_blocks_made() const noexcept {
        return done_.load(std::memory_order_relaxed);
    }
    /// Grows while a frame is being made, also within a block that takes long. Any thread.
    [[nodiscard]] std::uint64_t progress() const noexcept {
        return row_blocks_made() + current().rays_traced() + current().samples_taken();
    }
    /// The plan of the frame prepared last, in scene time.
    [[nodiscard]] const sensors::ReadoutPlan& plan() const noexcept { return plan_; }
    /// What the detector made of the first window of the frame filled last, before any test pattern; only of
    /// frames ordered with ExposureAuto.
    [[nodiscard]] const DnHistogram& histogram() const noexcept { return histogram_; }
    /// From the trigger of the frame prepared last, delays included, until the chip can take another.
    [[nodiscard]] std::int64_t busy_ns() const noexcept {
        return plan_.trigger - asked_start_ + plan_.frame_period_ns;
    }
    /// Whether a frame asked for at `scene_time` begins before the one planned last has been read out.
    [[nodiscard]] bool overlaps(Time scene_time) const noexcept;
    /// Scheduling clock minus scene time of the frame prepared last.
    [[nodiscard]] std::int64_t scene_to_clock_ns() const noexcept { return scene_to_clock_ns_; }

private:
    static constexpr std::uint32_t buffer_count = 2;
    /// A piece of a window that goes through renderer and detector at once.
    struct RowBlock {
        std::size_t window;
        std::int32_t first_row, rows; ///< of the composed image
        std::int32_t halo_above, halo_below, halo_left, halo_right;
    };

    [[nodiscard]] std::string plan_frame(const FrameOrder& order);
    void list_row_blocks();
    [[nodiscard]] bool render_row_block(const RowBlock& block, std::span<float> light,
                                        const std::atomic<bool>* cancel);
    [[nodiscard]] bool render_lines(renderer::RenderRequest request, const RowBlock& block,
                                    std::span<float> light, const std::atomic<bool>* cancel);
    void run_detector() noexcept;
    void expose_row_block(std::uint32_t number) noexcept;
    void paint_pattern(std::int32_t first_row, std::int32_t rows) noexcept;

    [[nodiscard]] const renderer::Renderer& current() const noexcept {
        return *renderer_.load(std::memory_order_acquire);
    }

    std::atomic<const renderer::Renderer*> renderer_, next_renderer_{nullptr};
    sensors::Detector& detector_;
    const Clock& clock_;
    const ReadoutSettings readout_;
    const int adc_bits_;
    const double offset_dn_;
    const FrameMakerSettings settings_;
    std::size_t band_count_;
    std::int32_t buffer_rows_; ///< of a buffer, halo included

    sensors::ReadoutSequencer sequencer_;
    sensors::ReadoutPlan plan_;
    Time asked_start_; ///< of the exposure, scene time
    std::vector<RowBlock> row_blocks_;
    std::vector<RowTime> block_times_;
    std::vector<float> line_; ///< push-broom: one line of all spectral bands
    std::int64_t scene_to_clock_ns_ = 0;
    std::array<std::vector<float>, buffer_count> buffers_;

    // The frame in work, for the detector thread: written before the first block of a frame is posted.
    Frame* frame_ = nullptr;
    double black_shift_dn_ = 0;
    ImagePattern pattern_ = ImagePattern::off;
    bool measured_ = false; ///< its numbers are to be counted
    DnHistogram histogram_;
    RowSink* sink_ = nullptr;

    // Bands of all frames, counted through: posted by the renderer's side, done by the detector thread.
    std::atomic<std::uint32_t> posted_{0};
    std::atomic<std::uint32_t> done_{0};
    std::uint32_t frame_start_ = 0; ///< number of the first row block of the current frame
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

} // namespace obscura::emulator
