// The camera itself: takes triggers, makes frames, hands them to the transports; and its control port.
#pragma once

#include "core/camera.hpp"
#include "core/clock.hpp"
#include "core/event_count.hpp"
#include "core/frame.hpp"
#include "core/log.hpp"
#include "core/realtime.hpp"
#include "emulator/alarm.hpp"
#include "emulator/auto_exposure.hpp"
#include "emulator/frame_maker.hpp"
#include "emulator/io_ends.hpp"
#include "emulator/releaser.hpp"
#include "sync/schedule.hpp"
#include "sync/sync.hpp"
#include "sync/timer.hpp"
#include "sync/trigger_gate.hpp"
#include "transports/transport.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::emulator {

/// Which clock the scene follows.
enum class SceneTime : std::uint8_t {
    nominal, ///< frame k shows the scene at (k - 1) nominal periods: the same bytes on every run
    clock,   ///< at the time that passed since the acquisition started
};

struct CameraConfig {
    CameraSettings initial;
    CameraLimits limits;
    SceneTime scene_time = SceneTime::nominal;
    sync::RationalRate trigger_rate{10, 1}; ///< nominal rate of Line0, software and action triggers
    sync::OverTrigger over_trigger = sync::OverTrigger::count;
    ThreadSettings thread{};         ///< the pipeline's
    ThreadSettings trigger_thread{}; ///< of the timer of free run
};

/// The scene time at the trigger of frame `frame_id` when the scene follows nominal periods.
[[nodiscard]] Time nominal_scene_time(const CameraSettings& settings, sync::RationalRate trigger_rate,
                                      std::uint64_t frame_id);

/// What has happened since construction. Every edge that reached the camera while it was acquiring and
/// listening to that source is in `triggers`, and then in exactly one of `frames`, `missed_triggers`,
/// `masked_triggers` and `dropped`, but for one that is in work or waits latched.
struct CameraCounters {
    std::uint64_t triggers = 0;        ///< edges, lost ones (gaps in the source's ids) included
    std::uint64_t missed_triggers = 0; ///< lost edges, and edges that came before the camera was ready again
    std::uint64_t masked_triggers =
        0; ///< edges that came before the camera was ready, where that is to be ignored
    std::uint64_t latched_triggers = 0; ///< of those that became frames: had to wait for the camera
    std::uint64_t ignored = 0;          ///< edges while not acquiring or not listening to their source
    std::uint64_t dropped = 0;          ///< pool empty, or no transport took the frame
    std::uint64_t frames = 0;           ///< handed to at least one transport
    std::uint64_t complete = 0;         ///< of those: all rows left
    std::uint64_t late = 0;             ///< of those: with rows that were not ready in time
    std::uint64_t late_rows = 0;
    std::uint64_t abandoned = 0; ///< not all rows left: stopped with the abort flag, or given up as too late
    std::uint64_t repeated = 0;  ///< late policy: show the frame before
    std::uint64_t late_dropped = 0; ///< late policy: given up
    std::uint64_t partial = 0;      ///< late policy: ended early
};

/// What the camera is doing, for lines that tell others of it.
struct CameraMoments {
    std::uint64_t frames = 0;          ///< frames begun
    std::uint64_t frame_id = 0;        ///< of the last one
    Time exposure_start, exposure_end; ///< of the last frame, first row to last, scheduling clock
    bool ready = false;                ///< a trigger would be taken, if it does not come before `not_before`
    Time not_before;
};

/// One camera: at most one frame is being made at any moment. A trigger that comes while the one before is
/// being rendered, or sooner than the chip's shortest frame period, is counted as missed and makes no frame.
/// on_trigger() is the camera's Line0 and may be called on a real-time thread.
class Camera final : public CameraControl, public sync::TriggerSink, private sync::MissedListener {
public:
    /// The references must outlive the camera. `log` receives what real-time threads have to say.
    Camera(const CameraConfig& config, FrameMaker& maker, Releaser& releaser, FramePool& pool,
           const Clock& clock, LogRing& log);
    ~Camera() override;

    /// Frames go to `transport`, too, which must outlive the camera. Before the first acquisition_start().
    void add_transport(transports::Transport& transport) { transports_.push_back(&transport); }

    /// The nominal rate of Line0, software and action triggers; counts from the next acquisition_start() on.
    void set_trigger_rate(sync::RationalRate rate);

    [[nodiscard]] CameraLimits limits() const override { return config_.limits; }
    [[nodiscard]] CameraSettings settings() const override;
    [[nodiscard]] std::string explain(const CameraSettings& settings) const override;
    bool apply(const CameraSettings& settings) override;
    bool acquisition_start() override;
    void acquisition_stop(bool abort) override;
    [[nodiscard]] bool acquiring() const override;
    bool software_trigger(Time edge) override;
    bool action_trigger(Time edge) override;
    bool software_start_trigger(Time edge) override;
    bool software_burst_trigger(Time edge) override;
    bool software_exposure_trigger(Time edge) override;
    [[nodiscard]] ReadoutAnswer readout(const CameraSettings& settings) const override;
    bool set_sequence(const Sequence& sequence) override;
    [[nodiscard]] CameraActivity activity() const noexcept override;

    void reset_counter(std::size_t i) override;
    void reset_timer(std::size_t i) override;

    /// Edges of Line0.
    void on_trigger(const sync::Trigger& trigger) noexcept override;
    /// Where edges of Line1 and so on go, `line` below line_count.
    [[nodiscard]] sync::TriggerSink& line(std::size_t line) noexcept { return lines_[line]; }

    [[nodiscard]] CameraCounters counters() const noexcept;
    /// True while a trigger would be accepted now: what a "trigger ready" lamp shows.
    [[nodiscard]] bool trigger_ready() const noexcept;
    /// Whether on_trigger() would make a frame of an edge at `edge`.
    [[nodiscard]] bool ready_for_line0(Time edge) const noexcept;
    /// What output lines show. Any thread.
    [[nodiscard]] CameraMoments moments() const noexcept;
    /// Rung whenever moments() may have changed; for one waiting thread.
    [[nodiscard]] EventCount& moments_changed() noexcept { return moments_changed_; }
    /// Of the thread that takes frames at instants of the camera's own: of bursts, levels, counters and
    /// timers.
    [[nodiscard]] const Heartbeat& alarm_heartbeat() const noexcept { return alarm_.heartbeat(); }
    /// False when the camera has been busy with one band of rows since the last call: then a thread of it
    /// hangs. One caller, every second or so.
    [[nodiscard]] bool alive() noexcept;

private:
    /// Where frames come from at the moment: a TriggerSource, or the camera itself.
    using Route = std::size_t;
    static constexpr Route free_run = trigger_source_count;
    static_assert(free_run < sync::TriggerGate::input_count);

    enum AlarmNumber : std::size_t {
        next_of_burst,
        next_of_level,
        look, ///< after counters and timers, as at the instants of the frame begun last
        look_exposure_start,
        look_exposure_end,
        look_frame_end,
        first_timer_end,
    };
    static_assert(first_timer_end + timer_count <= Alarm::alarm_count);

    /// TriggerChoice as the threads of the sources see it.
    struct LiveTrigger {
        std::atomic<bool> enabled{false};
        std::atomic<TriggerSource> source{TriggerSource::line0};
        std::atomic<TriggerActivation> activation{TriggerActivation::rising_edge};

        void set(const TriggerChoice& choice) noexcept;
        [[nodiscard]] TriggerChoice get() const noexcept;
        /// Whether an edge of `source` counts for it.
        [[nodiscard]] bool wants(TriggerSource from, bool falling) const noexcept {
            return get().wants(from, falling);
        }
    };

    /// An input line.
    struct Line final : sync::TriggerSink {
        void on_trigger(const sync::Trigger& trigger) noexcept override {
            camera->line_edge(number, trigger);
        }
        Camera* camera = nullptr;
        std::size_t number = 0;
        std::atomic<std::uint64_t> edges{0};
        std::atomic<std::int64_t> edge_ns{0};
        std::atomic<bool> high{false};
        // Its source's thread only.
        std::uint64_t last_id = 0, counted_id = 0;
        sync::Trigger pulse;        ///< the edge that began the pulse whose width is awaited
        std::uint32_t pulse_of = 0; ///< acquisition in which that was; 0: none is awaited
    };

    /// Free run: the camera's own timer.
    struct FreeRunSink final : sync::TriggerSink {
        explicit FreeRunSink(Camera& c) : camera(c) {}
        void on_trigger(const sync::Trigger& trigger) noexcept override;
        Camera& camera;
    };

    void on_missed(Time edge) noexcept override;
    void notify(transports::CameraEvent event, Time t) noexcept;

    /// What the control side wants to know of the frame begun last; read while it is written.
    struct Moments {
        std::atomic<std::uint64_t> frame_id{0};
        std::atomic<std::int64_t> frame_start_ns{0}, frame_end_ns{0};
        std::atomic<std::int64_t> exposure_start_ns{0}, exposure_end_ns{0};
        std::atomic<std::uint64_t> frames{0};
        std::atomic<std::uint32_t> sequence_step{0};
    };

    void take_settings() noexcept;
    bool offer(const sync::Trigger& trigger, Route route) noexcept;
    void line_edge(std::size_t number, const sync::Trigger& trigger) noexcept;
    [[nodiscard]] const LiveTrigger& exposing_trigger() const noexcept;
    [[nodiscard]] bool width_counts(TriggerSource source) const noexcept;
    bool await_pulse(const sync::Trigger& trigger, const LiveTrigger& from, TriggerSource source) noexcept;
    [[nodiscard]] bool level_holds(const LiveTrigger& live) const noexcept;
    void go_on_with_level(Time due) noexcept;
    void look_soon() noexcept;
    void look_at_ends() noexcept;
    void fire_end(std::size_t end, Time t) noexcept;
    bool serve(const sync::Trigger& trigger, TriggerSource source) noexcept;
    bool take_burst(const sync::Trigger& trigger) noexcept;
    bool take_frame(const sync::Trigger& trigger, Route route) noexcept;
    bool take_exposure(const sync::Trigger& trigger, Route route) noexcept;
    [[nodiscard]] bool burst_awaited() const noexcept;
    bool taken_of_burst(bool taken) noexcept;
    bool offer_to_gate(sync::Trigger trigger, Route route) noexcept;
    void ring(std::size_t alarm, Time due) noexcept;
    void forget_triggers() noexcept;
    void publish_triggers(const CameraSettings& settings) noexcept;
    bool take_start(TriggerSource source, bool falling) noexcept;
    void note_moments(const FrameOrder& order) noexcept;
    static Route route_of(TriggerSource source) noexcept { return static_cast<Route>(source); }
    static Route route_of(const CameraSettings& settings) noexcept;
    void run() noexcept;
    void make_frame() noexcept;
    [[nodiscard]] bool waits_for_readout(const CameraSettings& settings) const noexcept;
    bool start_frame(FrameRef& frame) noexcept;
    [[nodiscard]] double free_run_rate_hz() const;
    void start_free_run();
    void stop_free_run();

    const CameraConfig config_;
    FrameMaker& maker_;
    Releaser& releaser_;
    FramePool& pool_;
    std::vector<transports::Transport*> transports_;
    const Clock& clock_;
    LogRing& log_;

    // Control side: one mutex for the calls of CameraControl, another for the settings alone, which the
    // pipeline thread only ever tries to take.
    mutable std::mutex control_mutex_, settings_mutex_;
    CameraSettings settings_;
    Sequence sequence_;
    sync::RationalRate next_trigger_rate_; ///< under control_mutex_
    FreeRunSink free_run_sink_{*this};
    std::unique_ptr<sync::TimerTrigger> free_run_;

    sync::TriggerGate gate_;
    std::atomic<bool> cancel_{false};

    // Written by acquisition_start() while not acquiring, then by the pipeline thread.
    std::uint32_t sequence_step_ = 0;
    std::uint64_t next_frame_id_ = 1;
    std::uint64_t frames_left_ = 0;
    sync::RationalRate trigger_rate_;

    std::atomic<std::uint64_t> software_edges_{0};
    std::atomic<std::uint64_t> exposure_edges_{0};
    std::atomic<std::uint64_t> action_edges_{0};
    std::atomic<std::uint32_t> divider_{1};
    // What edges are held to, on whichever thread they come; the same values as in settings_.
    LiveTrigger frame_trigger_, start_trigger_, burst_trigger_, exposure_trigger_;
    std::atomic<bool> start_awaited_{false};
    std::atomic<std::uint32_t> burst_frames_{1}, burst_left_{0};
    std::atomic<std::int64_t> frame_period_ns_{0}; ///< of frames that a burst or a level makes itself
    std::atomic<std::uint64_t> self_ids_{0};       ///< of those frames
    std::atomic<bool> exposure_readied_{false};    ///< by a trigger for FrameStart
    std::array<Line, line_count> lines_;
    std::atomic<bool> trigger_width_{false};
    std::atomic<std::uint32_t> acquisition_{1}; ///< number of it, and of the choice of triggers within
    std::atomic<std::uint64_t> acquisitions_{0};
    std::atomic<std::int64_t> acquisition_start_ns_{0};
    IoEnds ends_;
    std::array<std::atomic<std::uint64_t>, counter_count + timer_count> end_ids_{}; ///< alarm's thread
    std::array<std::atomic<std::uint64_t>, free_run> first_id_{}; ///< of this acquisition; 0: none yet
    std::array<std::atomic<std::uint64_t>, free_run> used_up_{};  ///< edges that were no frame's
    AutoExposure auto_exposure_;
    Moments moments_;
    EventCount moments_changed_;

    // Pipeline thread: of the frame in work.
    CameraSettings frame_settings_;
    Sequence frame_sequence_;
    bool adjusts_exposure_ = false;
    RowSink* sink_ = nullptr;
    bool out_of_frames_ = false;

    std::uint64_t last_progress_ = UINT64_MAX; ///< alive()
    std::atomic<std::uint64_t> dropped_{0}, frames_{0};
    std::thread thread_;
    Alarm alarm_{config_.trigger_thread, [this](std::size_t alarm, Time due) { ring(alarm, due); }};
};

} // namespace obscura::emulator
