// SPDX-License-Identifier: Apache-2.0
// Scheduler of rows: worker threads, their scratch memory and the totals of their work.
#pragma once

#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/pass_request.hpp"
#include "renderer/passes/scratch.hpp"
#include "renderer/render_work.hpp"
#include "renderer/work_clock.hpp"
#include "renderer/worker_threads.hpp"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <thread>
#include <type_traits>
#include <vector>

namespace obscura::renderer {

/// Spreads rows over the worker threads of a renderer. Thread-safe; a run over rows allocates nothing of its
/// own but what TBB does.
class RowScheduler {
public:
    /// `built` must outlive it.
    explicit RowScheduler(const BuiltScene& built)
        : built_(built), arena_(static_cast<int>(built.settings.threads)) {
        if (built.settings.enter_worker) observer_.emplace(arena_, built.settings.enter_worker);
        if (built.settings.threads > std::thread::hardware_concurrency())
            more_threads_.emplace(tbb::global_control::max_allowed_parallelism, built.settings.threads);
    }

    [[nodiscard]] const BuiltScene& built() const { return built_; }
    /// Scratch memory of the calling thread.
    [[nodiscard]] Scratch& own_scratch(Scratch* alone = nullptr) const {
        return alone != nullptr ? *alone : scratch_.local();
    }
    /// Calls `do_row(r, scratch)` for rows [0, rows) on the workers; false when cancelled. Their time belongs
    /// to `part` where no lap assigns it.
    template<typename DoRow>
    bool for_rows(RenderPart part, std::int32_t rows, const RowsOf& of, const std::atomic<bool>* cancel,
                  const DoRow& do_row) const {
        return for_rows(part, rows, of, cancel, nullptr, do_row);
    }
    /// With a gate: `wanted(r)` is asked before row r, in the order of the rows.
    template<typename Wanted, typename DoRow>
    bool for_rows(RenderPart part, std::int32_t rows, const RowsOf& of, const std::atomic<bool>* cancel,
                  const Wanted& wanted, const DoRow& do_row) const;

    /// Totals of all rows so far, without those of textures. Real-time safe.
    [[nodiscard]] RenderWork work() const noexcept;

private:
    /// Makes a thread's memory ready for the next row.
    void begin(const RowsOf& of, bool first, Scratch& local) const;
    /// Adds what a row did to the totals: the supervisor reads these as watchdog progress.
    void end(Scratch& local) const;

    const BuiltScene& built_;
    /// Raises the limit of TBB, one worker per core by default, to the number of threads.
    std::optional<tbb::global_control> more_threads_;
    mutable tbb::task_arena arena_;
    std::optional<WorkerObserver> observer_; ///< with RenderSettings::enter_worker
    mutable tbb::enumerable_thread_specific<Scratch> scratch_;
    mutable std::atomic<std::uint64_t> rays_done_{0};
    mutable std::atomic<std::uint64_t> samples_done_{0};
    mutable std::atomic<std::uint64_t> surface_hits_{0}, tiles_missed_{0}, pixels_filled_{0};
    mutable std::atomic<std::uint64_t> rays_doubtful_{0};
    mutable std::array<std::atomic<std::uint64_t>, 4> surface_coarser_{};
    mutable WorkTotals work_done_;
};

template<typename Wanted, typename DoRow>
bool RowScheduler::for_rows(RenderPart part, std::int32_t row_count, const RowsOf& of,
                            const std::atomic<bool>* cancel, const Wanted& wanted,
                            const DoRow& do_row) const {
    constexpr bool gated = !std::is_null_pointer_v<Wanted>;
    std::atomic<bool> complete{true};
    std::atomic<std::int32_t> next{0}; // gated: rows are taken in their order
    const auto do_rows = [&](std::int32_t begin_at, std::int32_t end_at, Scratch& local) {
        const FlushDenormals flush;
        bool begun = false;
        local.work.start(part);
        for (std::int32_t r = gated ? next.fetch_add(1) : begin_at; r < end_at;
             r = gated ? next.fetch_add(1) : r + 1) {
            if constexpr (gated)
                if (!wanted(r)) {
                    complete.store(false, std::memory_order_relaxed);
                    continue;
                }
            if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) {
                complete.store(false, std::memory_order_relaxed);
                break;
            }
            begin(of, !begun, local);
            begun = true;
            do_row(r, local);
            end(local);
        }
        // The last row may have been cut short.
        if (cancel != nullptr && cancel->load(std::memory_order_relaxed))
            complete.store(false, std::memory_order_relaxed);
        local.pins.clear();
        local.work.stop(work_done_);
    };
    if (of.alone != nullptr) {
        do_rows(0, row_count, *of.alone);
        return complete.load();
    }
#ifdef __SANITIZE_THREAD__
    // ThreadSanitizer does not understand TBB: it would report every fork and join, or, with those
    // suppressed, no race between rows. Plain threads let it check the rows.
    const unsigned threads = built_.settings.threads;
    std::vector<std::jthread> workers;
    const auto first_row_of = [&](unsigned worker) {
        return static_cast<std::int32_t>(static_cast<std::int64_t>(row_count) * worker / threads);
    };
    for (unsigned i = 0; i < threads; ++i)
        workers.emplace_back([&, i] {
            if (built_.settings.enter_worker) built_.settings.enter_worker();
            Scratch own;
            if constexpr (gated)
                do_rows(0, row_count, own);
            else
                do_rows(first_row_of(i), first_row_of(i + 1), own);
        });
    workers.clear();
#else
    arena_.execute([&] {
        if constexpr (gated)
            tbb::parallel_for(
                tbb::blocked_range<std::int32_t>(0, static_cast<std::int32_t>(built_.settings.threads), 1),
                [&](const tbb::blocked_range<std::int32_t>&) { do_rows(0, row_count, scratch_.local()); },
                tbb::simple_partitioner());
        else
            tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, row_count),
                              [&](const tbb::blocked_range<std::int32_t>& rows) {
                                  do_rows(rows.begin(), rows.end(), scratch_.local());
                              });
    });
#endif
    return complete.load();
}

} // namespace obscura::renderer
