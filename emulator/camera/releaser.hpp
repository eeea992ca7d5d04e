// SPDX-License-Identifier: Apache-2.0
// Row release: publishes finished rows at the readout times of the chip, never earlier; or at once.
#pragma once

#include "core/camera/frame.hpp"
#include "core/clock.hpp"
#include "core/realtime/event_count.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/realtime/latency_histogram.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/camera/frame_maker.hpp"
#include "emulator/camera/frame_outcome.hpp"
#include "emulator/record/timing_log.hpp"
#include "emulator/render/policies.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace obscura::emulator {

struct ReleaserSettings {
    std::size_t max_rows = 1024;
    ReadoutTiming timing = ReadoutTiming::sensor;
    ThreadSettings thread{};
    /// Rows due within this span are released together; less than release_stall_ns.
    std::int64_t grain_ns = 250 * ns_per_us;
    LatePolicy policy = LatePolicy::late;
    std::int64_t grace_ns = 0; ///< after a row's time, before the policy applies (not under `late`)
    /// Polling time before a frame's first row: the thread sleeps until then and polls the clock afterwards.
    /// Exact, but costly, and harmful without SCHED_FIFO. 0: no polling.
    std::int64_t spin_ns = 0;
};

/// Outcomes since construction. Each frame is either complete or abandoned; `late` and `repeated` are subsets
/// of the complete ones, `partial` and `dropped` of the abandoned ones.
struct ReleaseCounters {
    std::uint64_t complete = 0;     ///< every row was released
    std::uint64_t late = 0;         ///< of those: at least one row was not ready in time
    std::uint64_t late_rows = 0;    ///< rows that were not ready in time, of all frames
    std::uint64_t stalled = 0;      ///< complete frames that are frame_stalled
    std::uint64_t stalled_rows = 0; ///< rows ready in time that left more than release_stall_ns late
    std::uint64_t abandoned = 0;    ///< frames given up before the last row
    std::uint64_t repeated = 0;     ///< policy `repeat`
    std::uint64_t dropped = 0;      ///< policy `drop`
    std::uint64_t partial = 0;      ///< policy `partial`
    std::uint64_t spins_denied = 0; ///< the thread slept instead, to avoid real-time throttling
};

/// Owns the thread that publishes rows, each no earlier than its release time (ReadoutTiming::sensor);
/// LatePolicy decides about rows that are not ready then. Frames are released in the order of begin(). One
/// producer thread calls begin(), rows_exposed() (through the sink) and end(), all real-time safe.
class Releaser {
public:
    /// `clock` must be this releaser's own: it interrupts it. Finished frames are reported to `log`, if any,
    /// which must outlive the releaser.
    Releaser(ReleaserSettings settings, std::unique_ptr<Clock> clock, TimingLog* log = nullptr);
    ~Releaser();
    Releaser(const Releaser&) = delete;
    Releaser& operator=(const Releaser&) = delete;

    /// Sets the policy of frames begun from now on. Thread-safe.
    void set_late_policy(LatePolicy policy, std::int64_t grace_ns) noexcept;
    /// True if begin() may be called: fewer than frames_in_flight frames are in progress.
    [[nodiscard]] bool has_room() const noexcept;
    /// Transmit timestamps of the next frame passed to begin(); null without a log.
    [[nodiscard]] TransmitTimestamps* transmit_timestamps() noexcept;
    /// Starts releasing `frame`: row i is due at `release[i]` (scene clock) plus `shift_ns`.
    /// The sink stays valid until end(). `request`: of the frame's trigger.
    RowSink& begin(const FrameRef& frame, const std::vector<Time>& release, std::int64_t shift_ns,
                   const FrameFacts& facts = {}, std::uint64_t request = 0) noexcept;
    /// Where the producer writes what the current frame costs; null without a log.
    [[nodiscard]] FrameWork* work() noexcept { return log_ != nullptr ? &newest().work : nullptr; }
    /// Cancellation flag of the current frame; the producer may stop filling it.
    [[nodiscard]] const std::atomic<bool>& cancel_flag() const noexcept;
    /// Reports that the producer has stopped writing to the current frame. Unless `complete`, no row follows.
    void end(bool complete) noexcept;
    void cancel() noexcept { end(false); }
    /// Abandons all frames in progress immediately. Thread-safe; a concurrent begin() may not be covered.
    void abandon_all() noexcept;
    /// Blocks until every frame begun has been released or abandoned.
    void wait_idle() const noexcept;

    [[nodiscard]] ReleaseCounters counters() const noexcept;
    /// Records of all frames that this releaser is done with. The camera adds edges that became none.
    [[nodiscard]] OutcomeRing& outcomes() noexcept { return outcomes_; }
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
    [[nodiscard]] const LatencyHistogram& trigger_to_first_row() const noexcept { return first_row_; }
    [[nodiscard]] const LatencyHistogram& trigger_to_last_row() const noexcept { return last_row_; }
    /// Release time of the first row to its publication, for frames whose first row was ready in time.
    [[nodiscard]] const LatencyHistogram& release_lateness() const noexcept { return lateness_; }

    static constexpr std::uint32_t frames_in_flight = 3;

private:
    struct Job final : RowSink {
        // Flag bits beside the number of rows.
        static constexpr std::uint32_t cancelled = 1u << 31;
        static constexpr std::uint32_t filled = 1u << 30; ///< the producer has stopped writing
        static constexpr std::uint32_t rows_mask = filled - 1;
        Clock* clock = nullptr;
        EventCount* changed = nullptr; ///< notified when `exposed` changes
        ReadoutTiming timing = ReadoutTiming::sensor;
        LatePolicy policy = LatePolicy::late;
        std::int64_t grace_ns = 0;
        bool wake_clock = false; ///< the release thread may sleep on the clock instead of `changed`
        FrameRef frame;          ///< the releaser's reference; dropped when the frame has been released
        Frame* target = nullptr; ///< the same frame for rows_exposed(); the producer holds a reference
        /// Release time of each row, scheduling clock, in order. ReadoutTiming::fast: time at which a row
        /// that is ready became so.
        std::vector<Time> release;
        std::vector<std::uint8_t>
            ready_late; ///< of each row, 1: counted in late_rows; final once `exposed` counts it
        FrameFacts facts;
        std::uint64_t request = 0;
        FrameWork work; ///< written by the producer's threads while the frame has rows left to report
        std::atomic<std::uint32_t> exposed{0}; ///< rows, and the bits above
        std::atomic<bool> unwanted{false};
        std::atomic<std::uint32_t> late_rows{0}; ///< updated before `exposed` counts the rows
        void rows_exposed(std::int32_t rows) noexcept override;
        void set_bits(std::uint32_t bits) noexcept;
    };
    void run() noexcept;
    FrameOutcome release_frame(Job& job, FrameTiming& timing) noexcept;
    FrameOutcome miss(Job& job, std::int32_t released, FrameTiming& timing) noexcept;
    bool repeat_last(Job& job, std::int32_t from) noexcept;
    /// How many of the rows `from` to `to`, which leave now, were ready in time and are stalled.
    [[nodiscard]] static std::uint32_t stalled_rows(const Job& job, std::int32_t from, std::int32_t to,
                                                    Time now) noexcept;
    void sleep_until(Time t, bool exactly) noexcept;
    void wait_for_change(std::uint32_t seen) noexcept;
    [[nodiscard]] bool may_spin(Time now) noexcept;
    Job& newest() noexcept { return jobs_[(begun_.load(std::memory_order_relaxed) - 1) % frames_in_flight]; }
    [[nodiscard]] const Job& newest() const noexcept {
        return jobs_[(begun_.load(std::memory_order_relaxed) - 1) % frames_in_flight];
    }

    const ReleaserSettings settings_;
    std::unique_ptr<Clock> clock_;
    TimingLog* log_;
    std::array<Job, frames_in_flight> jobs_;
    std::atomic<std::uint32_t> begun_{0}, finished_{0}; ///< running counts of frames
    std::atomic<LatePolicy> policy_;
    std::atomic<std::int64_t> grace_ns_;
    std::atomic<bool> stopping_{false};
    EventCount changed_; ///< wakes the release thread: a frame begun, rows exposed, the end
    Heartbeat heartbeat_{"release"};
    OutcomeRing outcomes_;

    // Release thread only.
    FrameRef last_complete_; ///< kept under LatePolicy::repeat
    Time spin_window_;
    std::int64_t spun_ns_ = 0;

    std::atomic<std::uint64_t> complete_{0}, late_{0}, late_rows_{0}, stalled_{0}, stalled_rows_{0},
        abandoned_{0}, repeated_{0}, dropped_{0}, partial_{0}, spins_denied_{0};
    LatencyHistogram first_row_, last_row_, lateness_;
    std::thread thread_;
};

} // namespace obscura::emulator
