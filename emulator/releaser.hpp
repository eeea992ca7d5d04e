// Lets the rows of finished bands out at the moments the real chip would, never earlier.
#pragma once

#include "core/clock.hpp"
#include "core/frame.hpp"
#include "emulator/frame_maker.hpp"
#include "emulator/latency.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace obscura::emulator {

struct ReleaserSettings {
    std::size_t max_rows = 1024;
    int priority = 0;                        ///< SCHED_FIFO priority; 0: ordinary scheduling
    std::int64_t grain_ns = 250 * ns_per_us; ///< rows that fall due within this span leave together
};

/// What became of the frames. Read from any thread.
struct ReleaseCounters {
    std::uint64_t complete = 0;  ///< every row left
    std::uint64_t late = 0;      ///< of those: at least one row was not ready in time
    std::uint64_t late_rows = 0; ///< rows that were not ready in time
    std::uint64_t abandoned = 0; ///< frames given up before the last row
};

/// A thread that publishes rows: each no earlier than its release time, and as soon as it is ready when that
/// has passed. Frames leave in the order of begin(). One producer thread calls begin(), rows_exposed()
/// (through the sink) and cancel(); nothing of that allocates.
class Releaser {
public:
    /// `clock` must be this releaser's own: it interrupts it.
    Releaser(ReleaserSettings settings, std::unique_ptr<Clock> clock);
    ~Releaser();
    Releaser(const Releaser&) = delete;
    Releaser& operator=(const Releaser&) = delete;

    /// Whether begin() may be called now: fewer than frames_in_flight frames have not left yet.
    [[nodiscard]] bool has_room() const noexcept;
    /// Takes charge of `frame`: `release` (scene clock) shifted by `shift_ns` says when each row may leave.
    /// The sink stays valid until the frame's last row is told or cancel().
    RowSink& begin(const FrameRef& frame, const std::vector<Time>& release, std::int64_t shift_ns) noexcept;
    /// No further row of the frame begun last will come.
    void cancel() noexcept;
    /// Gives up all frames in charge at once, without waiting for their times. Any thread, but not during
    /// begin().
    void abandon_all() noexcept;
    /// Blocks until every frame begun has left or was given up.
    void wait_idle() const noexcept;

    [[nodiscard]] ReleaseCounters counters() const noexcept;
    [[nodiscard]] const LatencyHistogram& trigger_to_first_row() const noexcept { return first_row_; }
    [[nodiscard]] const LatencyHistogram& trigger_to_last_row() const noexcept { return last_row_; }

    static constexpr std::uint32_t frames_in_flight = 3;

private:
    struct Job final : RowSink {
        static constexpr std::uint32_t cancelled = 1u << 31;
        const Clock* clock = nullptr;
        FrameRef frame;            ///< the releaser's hold; let go when the frame has left
        Frame* target = nullptr;   ///< the same frame for rows_exposed(); held by the one who fills it
        std::vector<Time> release; ///< scheduling clock, in order
        std::atomic<std::uint32_t> exposed{0}; ///< rows, and the bit above
        std::uint32_t late_rows = 0;           ///< written before `exposed` tells of the rows
        void rows_exposed(std::int32_t rows) noexcept override;
    };

    void run() noexcept;
    bool release_frame(Job& job) noexcept;

    const ReleaserSettings settings_;
    std::unique_ptr<Clock> clock_;
    std::array<Job, frames_in_flight> jobs_;
    std::atomic<std::uint32_t> begun_{0}, finished_{0}; ///< frames, counted through
    std::atomic<bool> stopping_{false};

    std::atomic<std::uint64_t> complete_{0}, late_{0}, late_rows_{0}, abandoned_{0};
    LatencyHistogram first_row_, last_row_;
    std::thread thread_;
};

} // namespace obscura::emulator
