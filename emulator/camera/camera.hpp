// SPDX-License-Identifier: Apache-2.0
// The camera: control port and frame loop, from triggers to frames for the transports.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/camera_counters.hpp"
#include "core/camera/frame.hpp"
#include "core/clock.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/camera/auto_exposure.hpp"
#include "emulator/camera/frame_maker.hpp"
#include "emulator/camera/releaser.hpp"
#include "emulator/camera/scene_clock.hpp"
#include "emulator/render/policies.hpp"
#include "emulator/render/render_scheduling.hpp"
#include "emulator/trigger/edge_predictor.hpp"
#include "emulator/trigger/trigger_router.hpp"
#include "sync/schedule.hpp"
#include "sync/sync.hpp"
#include "sync/timer.hpp"
#include "transports/transport.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace obscura::emulator {

struct CameraConfig {
    CameraSettings initial;
    CameraLimits limits;
    SceneClockSettings scene{};
    sync::RationalRate trigger_rate{10, 1}; ///< nominal rate of Line0, software and action triggers
    sync::OverTrigger over_trigger = sync::OverTrigger::count;
    double ahead_tolerance_px = 0;   ///< see ExpectedFrame
    std::int64_t max_ahead_ns = 0;   ///< see ExpectedFrame
    bool expects_frames = true;      ///< what the next frame shows can be known before its trigger
    ThreadSettings thread{};         ///< pipeline
    ThreadSettings trigger_thread{}; ///< free-run timer, alarms
    RenderScheduling
        render{}; ///< class of the pipeline thread, which renders, unless `thread` has a priority
};

/// The scene time at the trigger of frame `frame_id` when the scene follows nominal periods.
[[nodiscard]] Time nominal_scene_time(const CameraSettings& settings, sync::RationalRate trigger_rate,
                                      std::uint64_t frame_id);

/// One camera: control port and frame loop. TriggerRouter decides which edges become frames; the pipeline
/// thread of this class makes one frame at a time and submits it to all transports. An edge during rendering,
/// or sooner than the chip's shortest frame period, is a missed trigger.
///
/// The members of CameraControl are thread-safe and not real-time safe; on_trigger() and the sinks of line()
/// are real-time safe, with one calling thread each.
class Camera final : public CameraControl, public sync::TriggerSink, private sync::MissedListener {
public:
    /// The references must outlive the camera. `log` takes the messages of the real-time threads.
    Camera(const CameraConfig& config, FrameMaker& maker, Releaser& releaser, FramePool& pool,
           const Clock& clock, LogRing& log);
    ~Camera() override;

    /// Adds a transport for all frames, which must outlive the camera, and gives it the next transmit slot.
    /// Before the transport starts. Throws ConfigError beyond max_transports.
    void add_transport(transports::Transport& transport);
    /// As add_transport(), once, for one that frames do not leave by, such as the memory that viewers read: a
    /// frame that no other transport has taken counts as unsent.
    void add_viewers(transports::Transport& viewers);

    /// The nominal rate of Line0, software and action triggers; counts from the next acquisition_start() on.
    void set_trigger_rate(sync::RationalRate rate);

    [[nodiscard]] CameraLimits limits() const override { return config_.limits; }
    [[nodiscard]] CameraSettings settings() const override;
    [[nodiscard]] std::string explain(const CameraSettings& settings) const override;
    bool apply(const CameraSettings& settings) override;
    bool acquisition_start() override;
    void acquisition_stop(bool abort) override;
    [[nodiscard]] bool acquiring() const override { return router_.acquiring(); }
    bool software_trigger(Time edge) override { return router_.software_frame_start(edge); }
    /// As that without `request`, of outcomes(), which the caller waits for.
    bool software_trigger(Time edge, const OutcomeRing::Request& request) noexcept {
        return router_.software_frame_start(edge, request.number);
    }
    bool action_trigger(Time edge) override { return router_.action(edge); }
    bool software_start_trigger(Time) override { return router_.software_acquisition_start(); }
    bool software_burst_trigger(Time edge) override { return router_.software_burst_start(edge); }
    bool software_exposure_trigger(Time edge) override { return router_.software_exposure_start(edge); }
    [[nodiscard]] ReadoutAnswer readout(const CameraSettings& settings) const override;
    bool set_sequence(const Sequence& sequence) override;
    [[nodiscard]] CameraActivity activity() const noexcept override;

    void reset_counter(std::size_t i) override;
    void reset_timer(std::size_t i) override;

    /// Edges of Line0.
    void on_trigger(const sync::Trigger& trigger) noexcept override { line(0).on_trigger(trigger); }
    /// Edges of any line, `line` below line_count.
    [[nodiscard]] sync::TriggerSink& line(std::size_t line) noexcept { return router_.line(line); }

    // Any thread; real-time safe.

    [[nodiscard]] CameraCounters counters() const noexcept;
    /// A trigger would be accepted now: the TriggerReady output.
    [[nodiscard]] bool trigger_ready() const noexcept { return router_.ready(); }
    /// An edge of Line0 at `edge` would become a frame.
    [[nodiscard]] bool ready_for_line0(Time edge) const noexcept { return router_.ready_for_line(0, edge); }
    [[nodiscard]] CameraMoments moments() const noexcept { return router_.moments(); }
    /// Scene time that the last frame shows at its edge; none before the first.
    [[nodiscard]] std::optional<Time> scene_time() const noexcept {
        const std::int64_t ns = scene_ns_.load(std::memory_order_relaxed);
        return ns == no_scene_time ? std::nullopt : std::optional(Time{ns});
    }
    /// Notified whenever moments() may have changed.
    [[nodiscard]] EventCount& moments_changed() noexcept { return router_.moments_changed(); }
    /// What becomes of the edges.
    [[nodiscard]] OutcomeRing& outcomes() noexcept { return releaser_.outcomes(); }
    /// Heartbeat of the alarm thread: frames of bursts and levels, ends of counters and timers.
    [[nodiscard]] const Heartbeat& alarm_heartbeat() const noexcept { return router_.alarm_heartbeat(); }
    /// False if the camera has been busy with one row block since the last call, because a thread of it
    /// hangs. Called by one thread, about once a second.
    [[nodiscard]] bool alive() noexcept;

private:
    void on_missed(Time edge) noexcept override;
    void on_refused(const sync::Trigger& trigger) noexcept override;
    void notify(transports::CameraEvent event, Time t) noexcept;

    // Control side.
    [[nodiscard]] double free_run_rate_hz() const;
    void wait_for_expected() const;
    /// Its first edge is at `first`, if any, else at once.
    void start_free_run(std::optional<Time> first = {});
    void stop_free_run() { free_run_.reset(); }

    // Pipeline thread.
    void run() noexcept;
    void make_frame() noexcept;
    void take_settings() noexcept;
    [[nodiscard]] FrameOrder next_order() noexcept;
    void order_light(const CameraSettings& settings, const SceneClock::Edge& edge,
                     FrameOrder& order) const noexcept;
    [[nodiscard]] std::optional<Time> expected_edge() const noexcept;
    [[nodiscard]] bool expect_next(ExpectedFrame& next) noexcept;
    [[nodiscard]] bool waits_for_readout(const CameraSettings& settings) const noexcept;
    bool start_frame(FrameRef& frame) noexcept;
    [[nodiscard]] FrameInstants instants_of(const FrameOrder& order) const noexcept;

    const CameraConfig config_;
    FrameMaker& maker_;
    Releaser& releaser_;
    FramePool& pool_;
    std::vector<transports::Transport*> transports_;
    const transports::Transport* viewers_ = nullptr; ///< one of them
    const Clock& clock_;
    LogRing& log_;

    // Control side: one mutex for the calls of CameraControl, another for the settings alone, which only
    // apply() locks and the pipeline thread tries to. Those who read have a copy with a mutex of its own:
    // they may be preempted with it, and new settings must not miss the next frame for that.
    mutable std::mutex control_mutex_, settings_mutex_, copy_mutex_;
    CameraSettings settings_, settings_copy_;
    Sequence sequence_;
    sync::RationalRate next_trigger_rate_; ///< under control_mutex_

    AutoExposure auto_exposure_;
    TriggerRouter router_;
    std::unique_ptr<sync::TimerTrigger> free_run_;
    std::atomic<bool> cancel_{false};

    // Written by acquisition_start() while not acquiring, then by the pipeline thread.
    std::uint32_t sequence_step_ = 0;
    std::uint64_t next_frame_id_ = 1;
    std::uint64_t frames_left_ = 0;
    std::optional<Time> first_edge_; ///< of a free run
    sync::RationalRate trigger_rate_;
    SceneClock scene_clock_;
    Sequence frame_sequence_;

    // Pipeline thread: the current frame.
    CameraSettings frame_settings_;
    EdgePredictor edges_;     ///< of this acquisition's frames
    bool line_known_ = false; ///< edges of the line before the acquisition let expect its first ones
    ExpectedFrame expected_;  ///< the next frame, as far as it is known before its trigger
    bool adjusts_exposure_ = false;
    RowSink* sink_ = nullptr;
    bool out_of_frames_ = false;

    std::atomic<std::uint32_t> last_sequence_step_{0}; ///< of the last frame
    static constexpr std::int64_t no_scene_time = INT64_MIN;
    std::atomic<std::int64_t> scene_ns_{no_scene_time}; ///< scene_time()
    std::uint64_t last_progress_ = UINT64_MAX;          ///< alive()
    std::atomic<std::uint64_t> dropped_{0}, frames_{0}, unsent_{0};
    std::thread thread_;
};

} // namespace obscura::emulator
