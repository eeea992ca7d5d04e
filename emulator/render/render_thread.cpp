// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/render_thread.hpp"

#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/render/frame_work.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

namespace obscura::emulator {
namespace {

/// A frame that is abandoned is noticed after this time at the latest.
constexpr std::int64_t cancel_poll_ns = 1'000'000;
/// A frame that waits for its instant looks at the clock so often: clocks of tests do not wake it.
constexpr std::int64_t hold_poll_ns = 20'000'000;

/// Frames whose bodies have moved by less show stars where they were expected.
constexpr double star_tolerance_px = 0.001;
/// Frames whose bodies have moved by more are rendered anew: what reprojection does not know grows with it.
constexpr double max_reprojected_px = 1;
/// Lines of a push-broom sensor do not say what is between them if the image moves by more from one to the
/// next.
constexpr double max_px_per_line = 1.25;

/// Whether a frame can be made of the light of one that is `later_ns` earlier and otherwise looks alike but
/// for a motion of `error_px`.
bool is_near(const FrameLight& light, std::int64_t later_ns, double error_px) noexcept {
    if (!light.push_broom) return error_px <= max_reprojected_px;
    const Time first = light.rows[0].mid(), second = light.rows[1].mid();
    if (light.renderer->image_motion_px({first, second}) > max_px_per_line) return false;
    // By the same poses lines at other times see what the lines of those times saw.
    if (light.live) return error_px <= max_reprojected_px;
    return 2 * std::abs(later_ns) < light.rows.back().read - light.rows.front().reset;
}

} // namespace

RenderThread::RenderThread(const FrameLight& blank, std::size_t floats, BlockRenderer blocks,
                           const Clock& clock, const std::function<void()>& enter, const LevelStore& levels,
                           const KeptFrames::Make& make_kept)
    : clock_(clock), blocks_(std::move(blocks)), kept_(make_kept) {
    if (levels.make_workspace) alone_ = levels.make_workspace();
    for (Store& s : stores_) {
        s.light.windows.reserve(blank.windows.capacity());
        s.light.pixel_times.reserve(blank.pixel_times.capacity());
        s.light.rows.reserve(blank.rows.capacity());
        s.light.blocks.reserve(blank.blocks.capacity());
        s.offsets.reserve(blank.blocks.capacity());
        s.light.levels.reserve(max_quality_groups);
        s.light.due.reserve(blank.blocks.capacity());
        s.floats.assign(floats, 0.0F);
        if (levels.floats > 0)
            s.levels = std::make_unique<AdaptiveFrame>(
                levels.floats, levels.pixels, levels.rows, clock_, [this] { changed_.notify(); },
                alone_.get());
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
    withdrawn_.notify();
    thread_.join();
}

void RenderThread::expect_frame_time(std::int64_t frame_ns, std::int32_t height) noexcept {
    const std::int32_t group_rows = FrameQuality::group_rows_for(height);
    controller_.expect_frame_time(frame_ns, (height + group_rows - 1) / group_rows);
}

void RenderThread::expect(const FrameLight& light, const Tolerance& tolerance, Time not_before) noexcept {
    discard();
    const bool at_once = not_before <= clock_.now();
    begin(light, at_once ? Time{} : not_before);
    tolerance_ = tolerance;
    expected_.store(jobs_.load(std::memory_order_relaxed));
    if (at_once) begun_.fetch_add(1, std::memory_order_relaxed);
}

void RenderThread::note_kept(const Store& before) noexcept {
    if (!before.adapts || before.levels->is_whole()) kept_.accept(before.light, last_error_);
}

void RenderThread::take_from(Store& s, const Store& source) noexcept {
    const auto height = static_cast<std::int32_t>(s.light.rows.size());
    const std::int32_t group_rows = FrameQuality::group_rows_for(height);
    s.light.levels.assign(static_cast<std::size_t>((height + group_rows - 1) / group_rows),
                          QualityLevel::repeated);
    s.groups_chosen = 0;
    s.light.keep = nullptr;
    s.light.from = source.light.keep;
    s.light.from->begin_reprojection();
}

void RenderThread::begin(const FrameLight& light, Time not_before, const Store* source,
                         std::optional<double> tolerance_px) noexcept {
    const std::uint32_t job = jobs_.load(std::memory_order_relaxed);
    // The job before has rendered all its blocks, or been cancelled: it stops within a row of a block.
    while (job > 0 && !store(job - 1).stopped.load(std::memory_order_acquire)) {
        const std::uint32_t seen = changed_.value();
        if (!store(job - 1).stopped.load(std::memory_order_acquire))
            changed_.wait(seen, MonotonicClock().now() + cancel_poll_ns);
    }
    Store& s = store(job);
    s.light = light;
    s.source = source;
    s.tolerance_px = tolerance_px;
    s.not_before = not_before;
    s.hold.store(not_before == Time{} ? Hold::none : Hold::waiting, std::memory_order_relaxed);
    if (job > 0) note_kept(store(job - 1));
    s.adapts =
        source == nullptr && s.levels && s.light.adapts && s.levels->begin(s.light, kept_.earlier(s.light));
    s.offsets.clear();
    std::size_t used = 0;
    for (const RowBlock& block : s.light.blocks) {
        const std::size_t floats = s.light.floats(block);
        if (floats > s.floats.size() - used) break;
        s.offsets.push_back(used);
        used += floats;
    }
    if (source != nullptr)
        take_from(s, *source);
    else
        s.light.keep = s.offsets.size() == s.light.blocks.size() ? kept_.begin(s.light) : nullptr;
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
    Store& s = store(jobs - 1);
    s.cancel = true;
    withdrawn_.notify();
    Hold waiting = Hold::waiting;
    if (s.hold.compare_exchange_strong(waiting, Hold::withdrawn)) return;
    discarded_.fetch_add(1, std::memory_order_relaxed);
}

void RenderThread::cancel() noexcept {
    // Cancelling a frame that is claimed meanwhile does no harm: its maker renders what is missing.
    if (const std::uint32_t jobs = expected_.load(); jobs != 0) store(jobs - 1).cancel = true;
    withdrawn_.notify();
}

/// How far the image that is rendered in `s` is from that of `light`, and what follows from it.
RenderThread::Match RenderThread::match(const Store& s, const FrameLight& light,
                                        const GroundTruth& truth) const noexcept {
    const std::optional<std::int64_t> later_ns = light.later_than(s.light);
    Match m;
    if (!later_ns || s.cancel.load() || s.hold.load() != Hold::none) return m;
    bool near = false;
    if (!light.live) {
        if (*later_ns != 0 && tolerance_.exact_time) return m;
        near = std::abs(*later_ns) <= tolerance_.time_ns;
        m.error_px = static_cast<double>(std::abs(*later_ns)) * tolerance_.px_per_ns;
        if (!near)
            m.error_px =
                std::max(m.error_px, light.renderer->image_motion_px({std::min(s.light.mid(), light.mid()),
                                                                      std::max(s.light.mid(), light.mid())}));
    } else {
        // What is rendered later sees the poses of today, or newer ones.
        for (std::size_t i = 0; i < s.seen.load(std::memory_order_acquire); ++i)
            m.error_px = std::max(m.error_px, light.renderer->image_change_px(s.states[i].truth, truth));
        near = m.error_px <= tolerance_.image_px;
    }
    if (const double lamps_px = lamp_change_px(s, light, truth); lamps_px > 0) {
        m.error_px = std::max(m.error_px, lamps_px);
        if (lamps_px > tolerance_.image_px) return m; // reprojection moves no light
    }
    const bool movable = m.error_px > star_tolerance_px && is_near(light, *later_ns, m.error_px) &&
                         s.light.keep != nullptr && s.light.keep->complete(*light.renderer) &&
                         s.ready.load(std::memory_order_acquire) == light.blocks.size();
    if (near)
        m.use = movable ? Match::Use::with_true_stars : Match::Use::as_it_is;
    else if (movable)
        m.use = Match::Use::reprojected;
    return m;
}

/// How far the light of lamps in `s` is from that of `light`, whose scene is in the state `truth`.
double RenderThread::lamp_change_px(const Store& s, const FrameLight& light,
                                    const GroundTruth& truth) const noexcept {
    const std::size_t count = light.renderer->scene().lamps.size();
    if (count == 0 || (!light.live && light.mid() == s.light.mid())) return 0;
    if (count > max_lamps) return std::numeric_limits<double>::infinity();
    std::array<Pose, max_lamps> lamps;
    light.renderer->fill_lamps(light.mid(), lamps);
    const auto change = [&](const State& from) {
        return light.renderer->lamp_change_px(from.truth, std::span(from.lamps).first(count), truth,
                                              std::span(lamps).first(count));
    };
    double max_px = 0;
    if (!light.live) {
        State expected;
        expected.note(*light.renderer, s.light.mid());
        return change(expected);
    }
    for (std::size_t i = 0; i < s.seen.load(std::memory_order_acquire); ++i)
        max_px = std::max(max_px, change(s.states[i]));
    return max_px;
}

void RenderThread::State::note(const renderer::Renderer& renderer, Time t) noexcept {
    renderer.fill_truth(t, truth);
    renderer.fill_lamps(t, lamps);
}

void RenderThread::claim(const FrameLight& light, const GroundTruth& truth) noexcept {
    error_px_ = 0;
    if (const std::uint32_t jobs = expected_.load(); jobs != 0) {
        Store& s = store(jobs - 1);
        const Match m = match(s, light, truth);
        if (m.use != Match::Use::none) {
            error_px_ = m.error_px;
            expected_.store(0);
            if (s.ready.load(std::memory_order_acquire) == light.blocks.size())
                early_.fetch_add(1, std::memory_order_relaxed);
            used_.fetch_add(1, std::memory_order_release);
            claimed_job_ = jobs - 1;
            claim_levels(light);
            if (m.use == Match::Use::as_it_is) return;
            if (s.adapts)
                for (std::size_t i = 0; i < light.blocks.size(); ++i)
                    s.levels->settle(i);
            const bool reproject = m.use == Match::Use::reprojected;
            begin(light, {}, &s, reproject ? std::optional(tolerance_.image_px) : std::nullopt);
            claimed_job_ = jobs_.load(std::memory_order_relaxed) - 1;
            return;
        }
        discard();
    }
    // A frame made from an earlier one may still need its sparse grid rendered; for others only their light
    // is left to be recorded.
    if (const std::uint32_t jobs = jobs_.load(std::memory_order_relaxed); jobs > 0)
        if (Store& last = store(jobs - 1); !last.adapts || !last.levels->all_taken()) last.cancel = true;
    begin(light);
    claimed_job_ = jobs_.load(std::memory_order_relaxed) - 1;
    claim_levels(light);
}

void RenderThread::describe_moved(FrameQuality& quality, const LightUse& use,
                                  std::int32_t height) const noexcept {
    const Store& s = claimed();
    if (s.source == nullptr) return;
    if (s.source->adapts) s.source->levels->describe(quality, use);
    const std::vector<QualityLevel>& own = s.light.levels;
    if (std::find(own.begin(), own.end(), QualityLevel::reprojected) == own.end()) return;
    // Within the tolerance the bodies are those that were rendered.
    std::array<QualityLevel, max_quality_groups> levels{};
    for (std::size_t g = 0; g < own.size(); ++g)
        levels[g] = own[g] != QualityLevel::repeated ? own[g]
                    : s.source->adapts               ? quality.group_level[g]
                                                     : QualityLevel::full;
    describe_levels(quality, std::span(levels).first(own.size()), height);
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
        const Time last_resort = s.levels->last_resort_due(index);
        if (now >= last_resort && !s.levels->block_lit(index)) {
            s.levels->take_earlier(index);
            s.levels->take(index, out);
            return true;
        }
        const Time wake = now < last_resort ? std::min(due, last_resort) : due;
        const std::int64_t wait_ns = now < wake ? std::min(wake - now, cancel_poll_ns) : cancel_poll_ns;
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
    return {begun_.load(std::memory_order_relaxed), used_.load(std::memory_order_acquire),
            discarded_.load(std::memory_order_relaxed), early_.load(std::memory_order_relaxed),
            moved_.load(std::memory_order_relaxed)};
}

void RenderThread::run() noexcept {
    for (std::uint32_t job = 0;; ++job) {
        while (jobs_.load(std::memory_order_acquire) == job)
            jobs_.wait(job, std::memory_order_acquire);
        if (quit_.load(std::memory_order_acquire)) return;
        render(store(job));
    }
}

/// Waits until an expected frame may begin; false if it is not wanted any more.
bool RenderThread::wait_to_begin(Store& s) noexcept {
    if (s.hold.load() == Hold::none) return true;
    for (;;) {
        const std::uint32_t seen = withdrawn_.value();
        if (s.cancel.load()) return false;
        const std::int64_t early_ns = s.not_before - clock_.now();
        if (early_ns <= 0) break;
        withdrawn_.wait(seen, MonotonicClock().now() + std::min(early_ns, hold_poll_ns));
    }
    Hold waiting = Hold::waiting;
    if (!s.hold.compare_exchange_strong(waiting, Hold::none)) return false;
    begun_.fetch_add(1, std::memory_order_relaxed);
    return true;
}

void RenderThread::note_state(Store& s) noexcept {
    if (!s.light.live) return;
    const std::size_t seen = s.seen.load(std::memory_order_relaxed);
    s.states[seen].note(*s.light.renderer, s.light.mid());
    s.seen.store(seen + 1, std::memory_order_release);
}

void RenderThread::render(Store& s) noexcept {
    if (!wait_to_begin(s)) {
        end(s);
        return;
    }
    // The work on a frame that is made from another one includes that one's.
    s.before = s.source != nullptr ? s.source->before : s.light.renderer->work();
    note_state(s);
    if (s.adapts) {
        if (s.levels->render(controller_, s.cancel)) {
            s.work = s.light.renderer->work() - s.before;
            s.ended = clock_.now();
            note_state(s);
            s.ready.store(s.light.blocks.size(), std::memory_order_release);
        }
        end(s);
        return;
    }
    for (std::size_t i = 0; i < s.offsets.size(); ++i) {
        if (!render_block(s, i)) break;
        if (i + 1 == s.light.blocks.size()) {
            if (std::any_of(s.light.levels.begin(), s.light.levels.end(),
                            [](QualityLevel level) { return level == QualityLevel::reprojected; }))
                moved_.fetch_add(1, std::memory_order_relaxed);
            s.work = s.light.renderer->work() - s.before;
            s.ended = s.source != nullptr ? s.source->ended : clock_.now();
            note_state(s);
        }
        s.ready.store(i + 1, std::memory_order_release);
        changed_.notify();
    }
    end(s);
}

bool RenderThread::render_block(Store& s, std::size_t index) noexcept {
    const RowBlock& block = s.light.blocks[index];
    if (s.tolerance_px && !blocks_.choose_levels(s.light, block, *s.tolerance_px, s.groups_chosen, &s.cancel))
        return false;
    return blocks_.render(s.light, block,
                          std::span(s.floats).subspan(s.offsets[index], s.light.floats(block)), &s.cancel);
}

/// No further block of the frame follows.
void RenderThread::end(Store& s) noexcept {
    rendering_with_.store(nullptr);
    s.stopped.store(true, std::memory_order_release);
    changed_.notify();
}

} // namespace obscura::emulator
