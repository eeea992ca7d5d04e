// SPDX-License-Identifier: Apache-2.0
// Trigger routing: which edge becomes a frame, on the thread of its source.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/io_state.hpp"
#include "core/clock.hpp"
#include "core/realtime/event_count.hpp"
#include "emulator/trigger/alarm.hpp"
#include "emulator/trigger/counter_timer_events.hpp"
#include "emulator/trigger/edge_numbers.hpp"
#include "emulator/trigger/frame_burst.hpp"
#include "emulator/trigger/frame_moments.hpp"
#include "emulator/trigger/input_line.hpp"
#include "emulator/trigger/shared_trigger_choice.hpp"
#include "emulator/trigger/trigger_route.hpp"
#include "sync/sync.hpp"
#include "sync/trigger_gate.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

namespace obscura::emulator {

/// An edge of a line, a software or action trigger, or the end of a counter or timer is offered to the
/// triggers of SFNC TriggerSelector in this order, and the first that is enabled, awaited and listens to its
/// source consumes it:
///
///     AcquisitionStart -> FrameBurstStart -> FrameStart -> ExposureStart
///
/// An edge of the exposing trigger (ExposureStart where enabled, else FrameStart) passes on to the gate,
/// whose consumer, the pipeline thread, makes a frame of it. Free run, bursts without FrameStart and levels
/// offer frames to the gate themselves.
///
/// Threads: control side, one thread at a time; source side, one thread per line and per route, real-time
/// safe; frame side, the pipeline thread, real-time safe; queries, any thread, real-time safe.
class TriggerRouter final : private sync::MissedListener, private CounterTimerEvents::Host {
public:
    struct Config {
        std::array<LineEdges, line_count> lines{};                 ///< edge types of each input
        sync::OverTrigger over_trigger = sync::OverTrigger::count; ///< without TriggerOverlap PreviousFrame
    };

    /// `missed` learns of each missed edge on the thread that finds it. It and `clock`, on which the alarms
    /// expire too, must outlive the router.
    TriggerRouter(const Config& config, const CameraSettings& initial, const Clock& clock,
                  sync::MissedListener& missed, const AlarmPort::Make& make_alarms);
    ~TriggerRouter() override;
    TriggerRouter(const TriggerRouter&) = delete;
    TriggerRouter& operator=(const TriggerRouter&) = delete;

    // Control side.

    /// Takes over the triggers, counters and timers of `settings`, but for the route.
    void set(const CameraSettings& settings);
    /// Selects the route of `settings`. Another route forgets the burst, level and exposure in progress.
    void select(const CameraSettings& settings) noexcept;
    /// Period of the frames that a burst or a level makes itself.
    void set_frame_period(std::int64_t ns) noexcept { frame_period_ns_.store(ns, std::memory_order_relaxed); }
    /// Starts the frames of a level that holds. From acquisition_start() on, and after a change of
    /// FrameStart.
    void resume_level() noexcept { continue_level(clock_.now()); }
    /// An acquisition with `settings` starts at `begin`; the gate opens.
    void acquisition_start(const CameraSettings& settings, Time begin) noexcept;
    /// After the return no edge becomes a frame; see TriggerGate::close().
    void acquisition_stop(bool and_finished) noexcept;
    void reset_counter(std::size_t i) noexcept { events_.reset_counter(i); }
    void reset_timer(std::size_t i) noexcept { events_.reset_timer(i); }

    /// SFNC TriggerSoftware of FrameStart, AcquisitionStart, FrameBurstStart, ExposureStart, and Action1.
    /// True when the edge was consumed. `request`: see sync::Trigger.
    bool software_frame_start(Time edge, std::uint64_t request = 0) noexcept;
    bool software_acquisition_start() noexcept;
    bool software_burst_start(Time edge) noexcept;
    bool software_exposure_start(Time edge) noexcept;
    bool action(Time edge) noexcept;

    // Source side.

    [[nodiscard]] sync::TriggerSink& line(std::size_t line) noexcept { return line_sinks_[line]; }
    /// The free-run timer.
    [[nodiscard]] sync::TriggerSink& free_run() noexcept { return free_run_sink_; }

    // Frame side.

    /// Gate with the edges to make frames of, in TriggerGate's consumer protocol.
    [[nodiscard]] sync::TriggerGate& gate() noexcept { return gate_; }
    [[nodiscard]] const sync::TriggerGate& gate() const noexcept { return gate_; }
    /// The pipeline has begun the frame of the gate's current trigger.
    void frame_begun(const FrameInstants& instants) noexcept;

    // Queries.

    [[nodiscard]] bool acquiring() const noexcept { return gate_.is_open(); }
    /// True while an edge has become a frame that is not finished.
    [[nodiscard]] bool busy() const noexcept { return gate_.busy(); }
    /// True if an edge of the exposing trigger would be accepted, apart from its time.
    [[nodiscard]] bool ready() const noexcept;
    /// True if an edge of `line` at time `edge` would become a frame.
    [[nodiscard]] bool ready_for_line(std::size_t line, Time edge) const noexcept;
    [[nodiscard]] sync::GateCounters counters() const noexcept { return gate_.counters(); }
    /// The first edge after `t` that becomes a frame, as the edges of its line so far let expect; none where
    /// other triggers, a divider or the end of a pulse decide about that.
    [[nodiscard]] std::optional<Time> next_line_edge(Time t) const noexcept;
    /// All but the sequence step.
    [[nodiscard]] CameraActivity activity() const noexcept;
    [[nodiscard]] CameraMoments moments() const noexcept;
    /// Notified whenever moments() may have changed.
    [[nodiscard]] EventCount& moments_changed() noexcept { return moments_changed_; }
    [[nodiscard]] const Heartbeat& alarm_heartbeat() const noexcept { return alarms_->heartbeat(); }

private:
    enum AlarmNumber : std::size_t { burst_frame, level_frame, first_event_alarm };
    static_assert(first_event_alarm + CounterTimerEvents::alarm_count <= AlarmPort::alarm_count);

    struct LineSink final : sync::TriggerSink {
        void on_trigger(const sync::Trigger& trigger) noexcept override {
            router->line_edge(number, trigger);
        }
        TriggerRouter* router = nullptr;
        std::size_t number = 0;
    };
    struct FreeRunSink final : sync::TriggerSink {
        explicit FreeRunSink(TriggerRouter& r) : router(r) {}
        void on_trigger(const sync::Trigger& trigger) noexcept override;
        TriggerRouter& router;
    };

    void on_missed(Time edge) noexcept override;
    void on_refused(const sync::Trigger& trigger) noexcept override { missed_.on_refused(trigger); }
    [[nodiscard]] IoInputs io_inputs() const noexcept override;
    void on_end(TriggerSource source, const sync::Trigger& end) noexcept override;
    void on_alarm(std::size_t alarm, Time due) noexcept;

    void line_edge(std::size_t number, const sync::Trigger& trigger) noexcept;
    bool route_edge(const sync::Trigger& trigger, TriggerSource source) noexcept;
    bool start_acquisition(TriggerSource source, bool falling) noexcept;
    bool start_burst(const sync::Trigger& trigger) noexcept;
    bool start_frame(const sync::Trigger& trigger, TriggerRoute route) noexcept;
    bool start_exposure(const sync::Trigger& trigger, TriggerRoute route) noexcept;
    bool divide(const sync::Trigger& trigger, TriggerRoute route) noexcept;
    bool offer(const sync::Trigger& trigger, TriggerRoute route) noexcept;
    bool count_in_burst(bool taken) noexcept;
    void forget() noexcept;

    [[nodiscard]] bool acquisition_start_awaited() const noexcept {
        return start_awaited_.load(std::memory_order_acquire);
    }
    [[nodiscard]] const SharedTriggerChoice& exposing_trigger() const noexcept {
        return exposure_trigger_.enabled() ? exposure_trigger_ : frame_trigger_;
    }
    [[nodiscard]] bool level_holds(const SharedTriggerChoice& trigger) const noexcept;
    void continue_level(Time due) noexcept;
    [[nodiscard]] bool measures_pulse(TriggerSource source) const noexcept;
    bool begin_pulse(const sync::Trigger& trigger, const SharedTriggerChoice& by,
                     TriggerSource source) noexcept;

    const Config config_;
    const Clock& clock_;
    sync::MissedListener& missed_;
    std::unique_ptr<AlarmPort> alarms_;

    sync::TriggerGate gate_;
    std::array<InputLine, line_count> lines_;
    std::array<LineSink, line_count> line_sinks_;
    FreeRunSink free_run_sink_{*this};
    EdgeNumbers numbers_;
    CounterTimerEvents events_;
    FrameMoments frame_moments_;
    EventCount moments_changed_;

    // Written by the control side, read on the threads of the sources.
    SharedTriggerChoice start_trigger_, frame_trigger_, exposure_trigger_;
    std::atomic<std::uint32_t> divider_{1};
    std::atomic<bool> trigger_width_{false};
    std::atomic<std::int64_t> frame_period_ns_{0};
    std::atomic<std::uint32_t> selection_{1}; ///< number of the acquisition and the route within it
    std::atomic<std::uint64_t> acquisitions_{0};
    std::atomic<std::int64_t> acquisition_start_ns_{0};

    // States of the triggers.
    std::atomic<bool> start_awaited_{false};
    FrameBurst burst_;
    static constexpr std::uint64_t armed_without_request = UINT64_MAX;
    std::atomic<std::uint64_t> exposure_armed_{0}; ///< request of the edge of FrameStart that did it; 0: not

    std::atomic<std::uint64_t> software_ids_{0}, exposure_ids_{0}, action_ids_{0}, self_paced_ids_{0};
};

} // namespace obscura::emulator
