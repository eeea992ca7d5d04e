// SPDX-License-Identifier: Apache-2.0
// A camera made of numbers: obeys CameraControl and hands a transport frames whose every pixel is known.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/frame.hpp"
#include "core/camera/io_state.hpp"
#include "core/clock.hpp"
#include "transports/transport.hpp"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::test {

/// The digital number of sensor pixel (x, y) in frame `id`.
constexpr std::uint16_t pattern_pixel(std::uint64_t id, std::int32_t x, std::int32_t y, int bits) {
    return static_cast<std::uint16_t>(
        (id * 37 + static_cast<std::uint64_t>(x) * 5 + static_cast<std::uint64_t>(y) * 11) &
        ((1U << bits) - 1));
}

/// Frames come at `frame_rate_hz` when TriggerMode is Off and at every accepted trigger else, made by a
/// thread of its own in bands of rows.
class PatternCamera final : public CameraControl {
public:
    explicit PatternCamera(const CameraLimits& limits, std::size_t pool_frames = 12);
    ~PatternCamera() override;

    /// Where frames go; to be set before the first acquisition.
    void set_transport(transports::Transport& transport) { transport_ = &transport; }
    /// Rows of a band, and the time one takes to make.
    void set_bands(std::int32_t rows, std::int64_t band_ns) {
        band_rows_ = rows;
        band_ns_ = band_ns;
    }
    /// Makes frames of these windows, one below the other, whatever the client's region is.
    void set_windows(std::vector<Region> windows) {
        const std::lock_guard lock(mutex_);
        windows_ = std::move(windows);
    }
    /// Leaves the pixels as they are: for benchmarks, where making the image must not be what is measured.
    void set_blank(bool blank) { blank_ = blank; }
    /// Frames say that they are degraded.
    void set_degraded(bool degraded) { degraded_ = degraded; }
    /// Gives up the frame after this many rows (0: never).
    void abandon_after(std::int32_t rows) { abandon_after_ = rows; }

    [[nodiscard]] CameraLimits limits() const override { return limits_; }
    [[nodiscard]] CameraSettings settings() const override;
    bool apply(const CameraSettings& settings) override;
    bool acquisition_start() override;
    void acquisition_stop(bool abort) override;
    [[nodiscard]] bool acquiring() const override;
    bool software_trigger(Time edge) override;
    bool action_trigger(Time edge) override;
    bool software_start_trigger(Time edge) override;
    bool set_sequence(const Sequence& sequence) override;
    void reset_counter(std::size_t i) override;
    void reset_timer(std::size_t i) override;
    [[nodiscard]] CameraActivity activity() const override;
    /// An edge on Line0.
    bool line_trigger(Time edge, bool falling = false);

    [[nodiscard]] std::uint64_t triggers() const { return triggers_.load(); }
    [[nodiscard]] std::uint64_t frames() const { return frames_made_.load(); }
    [[nodiscard]] std::uint64_t starts() const { return starts_.load(); }
    [[nodiscard]] FramePool& pool() { return pool_; }

private:
    void loop();
    /// False when no transport took it.
    bool make_frame(const CameraSettings& settings, const std::vector<Region>& windows, std::uint64_t id,
                    Time edge, std::uint32_t step);
    bool trigger(TriggerSource source, Time edge, bool falling = false);
    bool take_start(TriggerSource source, bool falling);

    const CameraLimits limits_;
    MonotonicClock clock_;
    FramePool pool_;
    transports::Transport* transport_ = nullptr;
    std::atomic<std::int32_t> band_rows_{32}, abandon_after_{0};
    std::atomic<std::int64_t> band_ns_{0};
    std::atomic<bool> blank_{false}, degraded_{false};

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    CameraSettings settings_;
    std::vector<Region> windows_;
    Sequence sequence_;
    std::uint32_t sequence_step_ = 0;
    CameraActivity activity_;
    IoMarks marks_;
    bool acquiring_ = false, start_awaited_ = false, making_ = false, quit_ = false;
    std::atomic<bool> abort_{false};
    std::uint64_t frame_id_ = 0;
    int pending_ = 0;
    Time pending_edge_, next_;
    std::atomic<std::uint64_t> triggers_{0}, frames_made_{0}, starts_{0};
    std::thread thread_;
};

} // namespace obscura::test
