// Lets the rows of finished bands out at the moments the real chip would, never earlier; or at once.
#pragma once

#include "core/clock.hpp"
#include "core/event_count.hpp"
#include "core/frame.hpp"
#include "core/heartbeat.hpp"
#include "core/latency_histogram.hpp"
#include "core/realtime.hpp"
#include "emulator/frame_maker.hpp"
#include "emulator/timing_log.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace obscura::emulator {

/// What happens to a frame one of whose rows is not ready when it is due (and the grace has passed).
enum class LatePolicy : std::uint8_t {
    late,    ///< the row leaves when it is ready
    repeat,  ///< the rest of the frame shows the frame before
    drop,    ///< a frame that has not begun to leave is given up; one that has, ends where it is
    partial, ///< what is ready leaves, the rest stays empty
};

/// When rows leave: as the chip reads them, or as soon as they are ready, whatever the chip would do. Then
/// none is late, and LatePolicy has no say.
enum class ReadoutTiming : std::uint8_t { sensor, fast };

struct ReleaserSettings {
    std::size_t max_rows = 1024;
    ReadoutTiming timing = ReadoutTiming::sensor;
    ThreadSettings thread{};
    std::int64_t grain_ns = 250 * ns_per_us; ///< rows that fall due within this span leave together
    LatePolicy policy = LatePolicy::late;
    std::int64_t grace_ns = 0; ///< after a row's time, before the policy applies (not under `late`)
    /// Before a frame's first row the thread sleeps to this much ahead and then polls the clock: exact, but
    /// costly, and harmful without SCHED_FIFO. 0: never.
    std::int64_t spin_ns = 0;
};

/// What became of the frames. Read from any thread. A frame is in one of complete and abandoned; `late`,
/// `repeated` tell more of complete ones, `partial` and `dropped` of abandoned ones.
struct ReleaseCounters {
    std::uint64_t complete = 0;     ///< every row left
    std::uint64_t late = 0;         ///< of those: at least one row was not ready in time
    std::uint64_t late_rows = 0;    ///< rows that were not ready in time, of all frames
    std::uint64_t abandoned = 0;    ///< frames given up before the last row, for whatever reason
    std::uint64_t repeated = 0;     ///< policy `repeat`
    std::uint64_t dropped = 0;      ///< policy `drop`
    std::uint64_t partial = 0;      ///< policy `partial`
    std::uint64_t spins_denied = 0; ///< the guard against real-time throttling made the thread sleep instead
};

/// A thread that publishes rows: each no earlier than its release time (ReadoutTiming::sensor). What happens
/// to rows that are not ready then is the policy's. Frames leave in the order of begin(). One producer thread
/// calls begin(), rows_exposed() (through the sink) and end(); nothing of that allocates.
class Releaser {
public:
    /// `clock` must be this releaser's own: it interrupts it. Finished frames are reported to `log`, if any,
    /// which must outlive the releaser.
    Releaser(ReleaserSettings settings, std::unique_ptr<Clock> clock, TimingLog* log = nullptr);
    ~Releaser();
    Releaser(const Releaser&) = delete;
    Releaser& operator=(const Releaser&) = delete;

    /// Of frames begun from now on. Any thread.
    void set_late_policy(LatePolicy policy, std::int64_t grace_ns) noexcept;
    /// Whether begin() may be called now: fewer than frames_in_flight frames have not left yet.
    [[nodiscard]] bool has_room() const noexcept;
    /// For the frame that begin() is called for next; null without a log.
    [[nodiscard]] ByteStamps* byte_stamps() noexcept;
    /// Takes charge of `frame`: `release` (scene clock) shifted by `shift_ns` says when each row may leave.
    /// The sink stays valid until end().
    RowSink& begin(const FrameRef& frame, const std::vector<Time>& release, std::int64_t shift_ns) noexcept;
    /// Of the frame begun last: becomes true when nobody wants its pixels any more.
    [[nodiscard]] const std::atomic<bool>& cancel_flag() const noexcept;
    /// The frame begun last will not be written to any more. Unless `complete`, no further row of it will
    /// come.
    void end(bool complete) noexcept;
    void cancel() noexcept { end(false); }
    /// Gives up all frames in charge at once, without waiting for their times. Any thread. A frame that is
    /// begun at the same time may escape.
    void abandon_all() noexcept;
    /// Blocks until every frame begun has left or was given up.
    void wait_idle() const noexcept;

    [[nodiscard]] ReleaseCounters counters() const noexcept;
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
    [[nodiscard]] const LatencyHistogram& trigger_to_first_row() const noexcept { return first_row_; }
    [[nodiscard]] const LatencyHistogram& trigger_to_last_row() const noexcept { return last_row_; }
    /// How late the first row left, of frames whose first row was ready in time.
    [[nodiscard]] const LatencyHistogram& release_lateness() const noexcept { return lateness_; }

    static constexpr std::uint32_t frames_in_flight = 3;

private:
    struct Job final : RowSink {
        // Bits beside the number of rows.
        static constexpr std::uint32_t cancelled = 1u << 31;
        static constexpr std::uint32_t filled = 1u << 30; ///< nobody writes to the frame any more
        static constexpr std::uint32_t rows_mask = filled - 1;
        Clock* clock = nullptr;
        EventCount* news = nullptr; ///< notified when `exposed` changes
        ReadoutTiming timing = ReadoutTiming::sensor;
        LatePolicy policy = LatePolicy::late;
        std::int64_t grace_ns = 0;
        bool wake_clock = false; ///< the releasing thread may be asleep on the clock, not on `news`
        FrameRef frame;          ///< the releaser's hold; let go when the frame has left
        Frame* target = nullptr; ///< the same frame for rows_exposed(); held by the one who fills it
        /// Scheduling clock, in order. ReadoutTiming::fast: of rows that are ready, when they became so.
        std::vector<Time> release;
        std::atomic<std::uint32_t> exposed{0}; ///< rows, and the bits above
        std::atomic<bool> unwanted{false};
        std::atomic<std::uint32_t> late_rows{0}; ///< added to before `exposed` tells of the rows
        void rows_exposed(std::int32_t rows) noexcept override;
        void tell(std::uint32_t bits) noexcept;
    };
    enum class Outcome : std::uint8_t { complete, abandoned };

    void run() noexcept;
    Outcome release_frame(Job& job, FrameTiming& timing) noexcept;
    Outcome miss(Job& job, std::int32_t released, FrameTiming& timing) noexcept;
    bool repeat_last(Job& job, std::int32_t from) noexcept;
    void sleep_until(Time t, bool exactly) noexcept;
    void wait_for_news(std::uint32_t seen) noexcept;
    [[nodiscard]] bool may_spin(Time now) noexcept;
    Job& newest() noexcept { return jobs_[(begun_.load(std::memory_order_relaxed) - 1) % frames_in_flight]; }
    [[nodiscard]] const Job& newest() const noexcept {
        return jobs_[(begun_.load(std::memory_order_relaxed) - 1) % frames_in_flight];
    }

    const ReleaserSettings settings_;
    std::unique_ptr<Clock> clock_;
    TimingLog* log_;
    std::array<Job, frames_in_flight> jobs_;
    std::atomic<std::uint32_t> begun_{0}, finished_{0}; ///< frames, counted through
    std::atomic<LatePolicy> policy_;
    std::atomic<std::int64_t> grace_ns_;
    std::atomic<bool> stopping_{false};
    EventCount news_; ///< for the releasing thread: a frame begun, rows exposed, the end
    Heartbeat heartbeat_{"release"};

    // Releasing thread only.
    FrameRef last_complete_; ///< kept under LatePolicy::repeat
    Time spin_window_;
    std::int64_t spun_ns_ = 0;

    std::atomic<std::uint64_t> complete_{0}, late_{0}, late_rows_{0}, abandoned_{0}, repeated_{0},
        dropped_{0}, partial_{0}, spins_denied_{0};
    LatencyHistogram first_row_, last_row_, lateness_;
    std::thread thread_;
};

} // namespace obscura::emulator
