// Makes one frame: plan -> render -> detector, in bands of rows that overlap in time.
#pragma once

#include "core/camera.hpp"
#include "core/clock.hpp"
#include "core/frame.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace obscura::emulator {

/// What is to be made. The pixels depend on frame_id, scene_time, `settings` and the configuration with its
/// seed, on nothing else; the other stamps only travel along.
struct FrameOrder {
    std::uint64_t frame_id = 1;
    std::uint64_t trigger_id = 1;
    Time trigger_edge;              ///< scheduling clock
    Time seen;                      ///< scheduling clock
    Time scene_time;                ///< what the scene's clock shows at the trigger's edge
    std::int64_t tai_offset_ns = 0; ///< TAI minus the scheduling clock
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
    std::int32_t band_rows = 64;
    std::uint64_t seed = 1; ///< recorded in the frame's ground truth
    int priority = 0;       ///< SCHED_FIFO priority of the detector thread; 0: ordinary scheduling
};

/// The band pipeline: the calling thread renders band k+1 (over the renderer's own workers) while a thread of
/// this object takes band k through the detector. One frame at a time, one calling thread at a time; after
/// construction nothing here allocates.
class FrameMaker {
public:
    /// The references must outlive the maker. Throws ConfigError when the sensor cannot be read out at all.
    FrameMaker(const renderer::Renderer& renderer, sensors::Detector& detector,
               const SensorDescription& sensor, const Clock& clock, FrameMakerSettings settings);
    ~FrameMaker();
    FrameMaker(const FrameMaker&) = delete;
    FrameMaker& operator=(const FrameMaker&) = delete;

    /// Plans the readout and writes `frame.info` and the row times. Empty, or the reason why the chip cannot
    /// do that; then the frame is untouched but for its size.
    [[nodiscard]] std::string prepare(const FrameOrder& order, Frame& frame);
    /// Makes the pixels of the frame prepared last. Rows go to `sink`, or are published at once when there is
    /// none. False when `cancel` became true on the way: then the rows told of so far are all there will be.
    bool fill(Frame& frame, RowSink* sink = nullptr, const std::atomic<bool>* cancel = nullptr);
    /// prepare() and fill() at once and without any waiting: a frame to look at.
    [[nodiscard]] std::string make(const FrameOrder& order, Frame& frame);

    /// What the chip would make of `settings`. Any thread; allocates.
    [[nodiscard]] ReadoutAnswer answer(const CameraSettings& settings) const;

    /// Bands that have gone through the detector so far. Any thread.
    [[nodiscard]] std::uint32_t bands_made() const noexcept { return done_.load(std::memory_order_relaxed); }
    /// Grows while a frame is being made, also within a band that takes long. Any thread.
    [[nodiscard]] std::uint64_t progress() const noexcept {
        return bands_made() + renderer_.rays_traced() + renderer_.samples_taken();
    }
    /// The plan of the frame prepared last, in scene time.
    [[nodiscard]] const sensors::ReadoutPlan& plan() const noexcept { return plan_; }
    /// Scheduling clock minus scene time of the frame prepared last.
    [[nodiscard]] std::int64_t scene_to_clock_ns() const noexcept { return scene_to_clock_ns_; }

private:
    static constexpr std::uint32_t buffer_count = 2;

    void run_detector() noexcept;
    void expose_band(std::uint32_t number) noexcept;
    void paint_pattern(std::int32_t first_row, std::int32_t rows) noexcept;

    const renderer::Renderer& renderer_;
    sensors::Detector& detector_;
    const Clock& clock_;
    const ReadoutSettings readout_;
    const int adc_bits_;
    const double offset_dn_;
    const FrameMakerSettings settings_;
    std::size_t band_count_;

    sensors::ReadoutPlan plan_;
    std::int64_t scene_to_clock_ns_ = 0;
    std::array<std::vector<float>, buffer_count> buffers_;

    // The frame in work, for the detector thread: written before the first band of a frame is posted.
    Frame* frame_ = nullptr;
    double black_shift_dn_ = 0;
    ImagePattern pattern_ = ImagePattern::off;
    RowSink* sink_ = nullptr;

    // Bands of all frames, counted through: posted by the renderer's side, done by the detector thread.
    std::atomic<std::uint32_t> posted_{0};
    std::atomic<std::uint32_t> done_{0};
    std::uint32_t frame_start_ = 0; ///< number of the first band of the frame in work
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

} // namespace obscura::emulator
