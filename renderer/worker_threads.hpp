// SPDX-License-Identifier: Apache-2.0
// Modes of the threads that render: denormals flushed, a function called on entry.
#pragma once

#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_scheduler_observer.h>

#if defined(__SSE2__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <functional>

namespace obscura::renderer {

/// Flushes denormals while rendering, as Embree recommends; restores the mode of the thread at the end.
class FlushDenormals {
public:
#if defined(__SSE2__)
    FlushDenormals() : saved_(_mm_getcsr()) {
        _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
        _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    }
    ~FlushDenormals() {
        _mm_setcsr(saved_);
    }

private:
    unsigned saved_;
#else
    FlushDenormals() = default;
    ~FlushDenormals() = default;

public:
#endif
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;
};

/// Calls a function on each worker thread that joins an arena.
class WorkerObserver final : public tbb::task_scheduler_observer {
public:
    WorkerObserver(tbb::task_arena& arena, const std::function<void()>& enter)
        : tbb::task_scheduler_observer(arena), enter_(enter) {
        observe(true);
    }
    ~WorkerObserver() override { observe(false); }
    WorkerObserver(const WorkerObserver&) = delete;
    WorkerObserver& operator=(const WorkerObserver&) = delete;
    void on_scheduler_entry(bool is_worker) override {
        if (is_worker) enter_();
    }

private:
    const std::function<void()> enter_;
};

} // namespace obscura::renderer
