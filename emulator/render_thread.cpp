// SPDX-License-Identifier: Apache-2.0
#include "emulator/render_thread.hpp"

#include "core/clock.hpp"
#include "core/realtime.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace obscura::emulator {
namespace {

/// A frame that is abandoned is noticed after this time at the latest.
constexpr std::int64_t cancel_poll_ns = 1'000'000;

} // namespace

RenderThread::RenderThread(const FrameLight& blank, std::size_t floats, BlockRenderer blocks,
                           const Clock& clock, const std::function<void()>& enter, const LevelStore& levels)
    : clock_(clock), blocks_(std::move(blocks)) {
    for (Store& s : stores_) {
        s.light.windows.reserve(blank.windows.capacity());
        s.light.rows.reserve(blank.rows.capacity());
        s.light.blocks.reserve(blank.blocks.capacity());
        s.offsets.reserve(blank.blocks.capacity());
        s.light.levels.reserve(max_quality_groups);
        s.light.due.reserve(blank.blocks.capacity());
        s.floats.assign(floats, 0.0F);
        if (levels.floats > 0)
            s.levels = std::make_unique<AdaptiveFrame>(levels.floats, levels.pixels, levels.rows, clock_,
                                                       [this] { changed_.notify(); });
    }
    thread_ = std::thread([this, enter] {
        enter();
        declare_this_thread_realtime();
        run();
    });
}

RenderThread::~RenderThread() {
    quit_ = true;
    for (Store& s : stores_)
        s.cancel = true;
    jobs_.fetch_add(1);
    jobs_.notify_all();
    thread_.join();
}

void RenderThread::expect(const FrameLight& light, const Tolerance& tolerance) noexcept {
    discard();
    begin(light);
    tolerance_ = tolerance;
    expected_.store(jobs_.load(std::memory_order_relaxed));
    begun_.fetch_add(1, std::memory_order_relaxed);
}

void RenderThread::begin(const FrameLight& light) noexcept {
    const std::uint32_t job = jobs_.load(std::memory_order_relaxed);
    // The job before has rendered all its blocks, or been cancelled: it stops within a row of a block.
    while (job > 0 && !store(job - 1).stopped.load(std::memory_order_acquire)) {
        const std::uint32_t seen = changed_.value();
        if (!store(job - 1).stopped.load(std::memory_order_acquire))
            changed_.wait(seen, MonotonicClock().now() + cancel_poll_ns);
    }
    Store& s = store(job);
    s.light = light;
    s.adapts = s.levels && s.light.adapts && s.levels->begin(s.light);
    s.offsets.clear();
    std::size_t used = 0;
    for (const RowBlock& block : s.light.blocks) {
        const std::size_t floats = s.light.floats(block);
        if (floats > s.floats.size() - used) break;
        s.offsets.push_back(used);
        used += floats;
    }
    s.ready.store(0, std::memory_order_relaxed);
    s.seen.store(0, std::memory_order_relaxed);
    s.stopped.store(false, std::memory_order_relaxed);
    s.cancel.store(false, std::memory_order_relaxed);
    rendering_with_.store(s.light.renderer);
    jobs_.store(job + 1, std::memory_order_release);
    jobs_.notify_one();
}

void RenderThread::discard() noexcept {
    const std::uint32_t jobs = expected_.exchange(0);
    if (jobs == 0) return;
    store(jobs - 1).cancel = true;
    discarded_.fetch_add(1, std::memory_order_relaxed);
}

void RenderThread::cancel() noexcept {
    // Cancelling a frame that is claimed meanwhile does no harm: its maker renders what is missing.
    if (const std::uint32_t jobs = expected_.load(); jobs != 0) store(jobs - 1).cancel = true;
}

/// How far the image that is rendered in `s` is from that of `light`; none if it is too far, or another one.
std::optional<double> RenderThread::error_of(const Store& s, const FrameLight& light,
                                             const GroundTruth& truth) const noexcept {
    const std::optional<std::int64_t> later_ns = light.later_than(s.light);
    if (!later_ns) return std::nullopt;
    if (!light.live) {
        const auto shift_ns = static_cast<double>(std::abs(*later_ns));
        if (std::abs(*later_ns) > tolerance_.time_ns) return std::nullopt;
        return shift_ns * tolerance_.px_per_ns;
    }
    // What is rendered later sees the poses of today, or newer ones.
    double error_px = 0;
    for (std::size_t i = 0; i < s.seen.load(std::memory_order_acquire); ++i)
        error_px = std::max(error_px, light.renderer->image_change_px(s.states[i], truth));
    if (!(error_px <= tolerance_.image_px)) return std::nullopt;
    return error_px;
}

void RenderThread::claim(const FrameLight& light, const GroundTruth& truth) noexcept {
    if (const std::uint32_t jobs = expected_.load(); jobs != 0) {
        const Store& s = store(jobs - 1);
        const std::optional<double> error_px = error_of(s, light, truth);
        if (!s.cancel.load() && error_px) {
            error_px_ = *error_px;
            expected_.store(0);
            used_.fetch_add(1, std::memory_order_relaxed);
            if (s.ready.load(std::memory_order_acquire) == light.blocks.size())
                early_.fetch_add(1, std::memory_order_relaxed);
            claimed_job_ = jobs - 1;
            claim_levels(light);
            return;
        }
        discard();
    }
    begin(light);
    error_px_ = 0;
    claimed_job_ = jobs_.load(std::memory_order_relaxed) - 1;
    claim_levels(light);
}

void RenderThread::claim_levels(const FrameLight& light) noexcept {
    if (Store& s = store(claimed_job_); s.adapts) s.levels->claim(light.from_plan_ns);
}

bool RenderThread::take_by_level(std::size_t index, std::span<float> out,
                                 const std::atomic<bool>* cancel) noexcept {
    Store& s = store(claimed_job_);
    if (!s.adapts) return false;
    const Time due = s.levels->block_due(index);
    for (;;) {
        const std::uint32_t seen = changed_.value();
        const bool stopped = s.stopped.load(std::memory_order_acquire);
        const Time now = clock_.now();
        if (s.levels->block_final(index) || (now >= due && s.levels->block_lit(index))) {
            s.levels->take(index, out);
            return true;
        }
        if (stopped) return false;
        if (cancel != nullptr && cancel->load()) {
            s.cancel = true;
            return false;
        }
        const std::int64_t wait_ns = now < due ? std::min(due - now, cancel_poll_ns) : cancel_poll_ns;
        changed_.wait(seen, MonotonicClock().now() + wait_ns);
    }
}

std::span<const float> RenderThread::take(std::size_t index, const std::atomic<bool>* cancel) noexcept {
    Store& s = store(claimed_job_);
    for (;;) {
        const std::uint32_t seen = changed_.value();
        const bool stopped = s.stopped.load(std::memory_order_acquire);
        if (index < s.ready.load(std::memory_order_acquire))
            return std::span(s.floats).subspan(s.offsets[index], s.light.floats(s.light.blocks[index]));
        if (stopped) return {};
        if (cancel != nullptr && cancel->load()) {
            s.cancel = true;
            return {};
        }
        changed_.wait(seen, MonotonicClock().now() + cancel_poll_ns);
    }
}

AheadCounters RenderThread::counters() const noexcept {
    return {begun_.load(std::memory_order_relaxed), used_.load(std::memory_order_relaxed),
            discarded_.load(std::memory_order_relaxed), early_.load(std::memory_order_relaxed)};
}

void RenderThread::run() noexcept {
    for (std::uint32_t job = 0;; ++job) {
        while (jobs_.load(std::memory_order_acquire) == job)
            jobs_.wait(job, std::memory_order_acquire);
        if (quit_.load(std::memory_order_acquire)) return;
        render(store(job));
    }
}

void RenderThread::note_state(Store& s) noexcept {
    if (!s.light.live) return;
    const std::size_t seen = s.seen.load(std::memory_order_relaxed);
    s.light.renderer->fill_truth(s.light.mid(), s.states[seen]);
    s.seen.store(seen + 1, std::memory_order_release);
}

void RenderThread::render(Store& s) noexcept {
    const renderer::RenderWork before = s.light.renderer->work();
    note_state(s);
    if (s.adapts) {
        if (s.levels->render(controller_, s.cancel)) {
            s.work = s.light.renderer->work() - before;
            s.ended = clock_.now();
            note_state(s);
            s.ready.store(s.light.blocks.size(), std::memory_order_release);
        }
        rendering_with_.store(nullptr);
        s.stopped.store(true, std::memory_order_release);
        changed_.notify();
        return;
    }
    for (std::size_t i = 0; i < s.offsets.size(); ++i) {
        const RowBlock& block = s.light.blocks[i];
        if (!blocks_.render(s.light, block, std::span(s.floats).subspan(s.offsets[i], s.light.floats(block)),
                            &s.cancel))
            break;
        if (i + 1 == s.light.blocks.size()) {
            s.work = s.light.renderer->work() - before;
            s.ended = clock_.now();
            note_state(s);
        }
        s.ready.store(i + 1, std::memory_order_release);
        changed_.notify();
    }
    rendering_with_.store(nullptr);
    s.stopped.store(true, std::memory_order_release);
    changed_.notify();
}

} // namespace obscura::emulator
