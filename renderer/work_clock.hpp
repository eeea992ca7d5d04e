// SPDX-License-Identifier: Apache-2.0
// Stop watch of one render thread, and the totals of all.
#pragma once

#include "renderer/render_work.hpp"

#include <array>
#include <atomic>
#include <cstdint>

namespace obscura::renderer {

/// Sums of the work of all threads. Thread-safe.
class WorkTotals {
public:
    void add(const RenderWork& work) noexcept;
    [[nodiscard]] RenderWork read() const noexcept;

private:
    std::array<std::atomic<std::int64_t>, render_part_count> part_ns_{};
    std::atomic<std::int64_t> measured_ns_{0}, measured_cpu_ns_{0};
    std::atomic<std::uint64_t> preemptions_{0}, page_faults_{0}, rows_{0}, instants_{0};
};

/// Stop watch of a thread: each lap belongs to a part of the work. Reads the time stamp counter where there
/// is one (some 10 ns), as laps are as short as a row's instant; asks the kernel for the thread's CPU time at
/// most once a millisecond, because that may take microseconds. Thread-bound, real-time safe.
class WorkClock {
public:
    /// Begins a run of rows; `whole`: part of what no lap assigns. All of the wings is RenderPart::wings.
    void start(RenderPart whole) noexcept;
    /// Assigns the time since the last lap.
    void lap(RenderPart part) noexcept {
        const std::uint64_t now = ticks();
        part_ticks_[static_cast<std::size_t>(whole_ == RenderPart::wings ? whole_ : part)] += now - last_;
        last_ = now;
    }
    /// A row is ready to be sampled, at so many instants.
    void row_set_up(std::uint64_t instants) noexcept {
        lap(RenderPart::setup);
        instants_ += instants;
    }
    void row_done() noexcept {
        lap(whole_);
        rows_ += whole_ == RenderPart::rest ? 1 : 0;
    }
    /// Ends the run and adds it to `totals`.
    void stop(WorkTotals& totals) noexcept;

private:
    [[nodiscard]] static std::uint64_t ticks() noexcept;

    RenderPart whole_ = RenderPart::rest;
    std::array<std::uint64_t, render_part_count> part_ticks_{};
    std::uint64_t first_ = 0, last_ = 0, rows_ = 0, instants_ = 0;
    std::int64_t begin_ns_ = 0;
    bool measured_ = false; ///< this run is in the sample of CPU time
    std::int64_t last_measured_ns_ = 0, cpu_begin_ns_ = 0;
    std::uint64_t preemptions_ = 0, page_faults_ = 0; ///< of the thread, as last seen
};

} // namespace obscura::renderer
