// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/adaptive_frame.hpp"

#include "core/clock.hpp"
#include "emulator/render/frame_work.hpp"
#include "emulator/render/render_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace obscura::emulator {
namespace {

/// For the maker to wake in time for the last resort.
constexpr std::int64_t wake_ns = 500'000;

} // namespace

AdaptiveFrame::AdaptiveFrame(std::size_t floats, std::size_t pixels, std::size_t rows, const Clock& clock,
                             std::function<void()> changed, renderer::Workspace* alone)
    : clock_(clock), changed_(std::move(changed)), alone_(alone) {
    for (std::vector<float>& part : floats_)
        part.assign(floats, 0.0F);
    for (auto* const planes : {&variance_, &samples_})
        for (std::vector<float>& plane : *planes)
            plane.assign(pixels, 0.0F);
    for (std::vector<RowSums>& part : sums_)
        part.resize(rows);
    times_.reserve(rows);
    levels_.reserve(rows);
    earlier_levels_.reserve(rows);
}

bool AdaptiveFrame::begin(const FrameLight& light, const KeptFrames::Earlier& earlier) noexcept {
    light_ = nullptr;
    if (light.windows.size() != 1 || light.push_broom || light.blocks.empty() ||
        light.due.size() != light.blocks.size())
        return false;
    const auto height = static_cast<std::int32_t>(light.rows.size());
    const RowBlock& first = light.blocks.front();
    halo_above_ = first.halo_above;
    area_rows_ = halo_above_ + height + light.blocks.back().halo_below;
    area_width_ = light.width(first);
    const std::size_t pixels = static_cast<std::size_t>(area_rows_) * static_cast<std::size_t>(area_width_);
    if (pixels > variance_[0].size() || pixels * light.renderer->band_count() > floats_[0].size() ||
        static_cast<std::size_t>(area_rows_) > sums_[0].size())
        return false;
    group_rows_ = FrameQuality::group_rows_for(height);
    group_count_ = (height + group_rows_ - 1) / group_rows_;
    times_.clear();
    for (std::int32_t r = 0; r < area_rows_; ++r)
        times_.push_back(light.rows[static_cast<std::size_t>(std::clamp(r - halo_above_, 0, height - 1))]);
    for (std::int32_t g = 0; g < group_count_; ++g) {
        Group& group = groups_[static_cast<std::size_t>(g)];
        group.first_row = g == 0 ? 0 : halo_above_ + g * group_rows_;
        const std::int32_t end = g + 1 == group_count_ ? area_rows_ : halo_above_ + (g + 1) * group_rows_;
        group.rows = end - group.first_row;
        group.rows_done.store(0, std::memory_order_relaxed);
        group.sparse.store(false, std::memory_order_relaxed);
        group.better.store(false, std::memory_order_relaxed);
        group.settled.store(false, std::memory_order_relaxed);
        group.optional_begun = false;
        group.level = QualityLevel::missing;
    }
    samples_kept_.begin_frame();
    from_plan_ns_ = light.from_plan_ns;
    claimed_ = false;
    rendered_.store(false, std::memory_order_relaxed);
    sparse_begun_ = false;
    outcome_ = {};
    earlier_ = alone_ != nullptr ? earlier : KeptFrames::Earlier{};
    mover_.store(Mover::none, std::memory_order_relaxed);
    used_earlier_ = false;
    if (earlier_.light != nullptr) earlier_.light->begin_reprojection();
    light_ = &light;
    return true;
}

std::size_t AdaptiveFrame::group_of(std::int32_t area_row) const noexcept {
    return static_cast<std::size_t>(std::clamp((area_row - halo_above_) / group_rows_, 0, group_count_ - 1));
}

std::pair<std::size_t, std::size_t> AdaptiveFrame::groups_of_block(std::size_t index) const noexcept {
    const RowBlock& block = light_->blocks[index];
    const std::int32_t top = halo_above_ + block.first_row - block.halo_above;
    return {group_of(top), group_of(top + block.lines() - 1)};
}

bool AdaptiveFrame::render(QualityController& controller, const std::atomic<bool>& cancel) noexcept {
    cancel_ = &cancel;
    begin_ = now();
    work_before_ = light_->renderer->work();
    // All threads come together after each slab: few of them, but enough to follow the clock.
    const std::int32_t slab = std::max(1, std::min(128 / group_rows_, group_count_ / 8));
    outcome_ = controller.run(*this, {group_count_, light_->period_ns, slab});
    if (outcome_.complete) work_ = light_->renderer->work() - work_before_;
    if (!outcome_.complete) return false;
    rendered_.store(true, std::memory_order_release);
    keep_settled();
    return true;
}

void AdaptiveFrame::keep_settled() noexcept {
    if (light_->keep == nullptr) return;
    for (std::size_t g = 0; g < static_cast<std::size_t>(group_count_); ++g) {
        const Group& group = groups_[g];
        const bool sparse = group.settled.load(std::memory_order_acquire)
                                ? part_of_[g] == 0
                                : !group.better.load(std::memory_order_relaxed);
        if (!sparse || !group.optional_begun || group.rows_done.load(std::memory_order_relaxed) == 0)
            continue;
        levels_.assign(static_cast<std::size_t>(group.rows), QualityLevel::sixteenth);
        // From samples that are there; its pixels are those that the maker takes.
        renderer::RenderRequest request = request_for(group.first_row, group.rows, levels_);
        request.kept = &samples_kept_;
        request.keep = light_->keep;
        const std::size_t at =
            static_cast<std::size_t>(group.first_row) * static_cast<std::size_t>(area_width_);
        static_cast<void>(render_noting(*light_->renderer, request, std::span(floats_[1]).subspan(at),
                                        nullptr, light_->faults));
    }
}

bool AdaptiveFrame::all_taken() const noexcept {
    return !used_earlier_ &&
           std::all_of(groups_.begin(), groups_.begin() + group_count_,
                       [](const Group& group) { return group.settled.load(std::memory_order_relaxed); });
}

bool AdaptiveFrame::is_whole() const noexcept {
    return rendered() && all_taken() &&
           std::all_of(settled_.begin(), settled_.begin() + group_count_,
                       [](QualityLevel level) { return level < QualityLevel::reprojected; });
}

Time AdaptiveFrame::now() const noexcept {
    return clock_.now();
}

Time AdaptiveFrame::due(std::int32_t group) const noexcept {
    const std::int64_t from_plan_ns = from_plan_ns_.load();
    if (from_plan_ns == FrameLight::unknown_clock) return never_due;
    // An edge that did not come when it was expected may come at any time.
    if (!claimed_.load() && clock_.now() > light_->due.front() + from_plan_ns) return never_due;
    const Group& g = groups_[static_cast<std::size_t>(group)];
    // The first block that contains a row of the group counts.
    const auto block = std::find_if(light_->blocks.begin(), light_->blocks.end(), [&](const RowBlock& b) {
        return halo_above_ + b.first_row + b.rows + b.halo_below > g.first_row;
    });
    const auto index = std::min<std::ptrdiff_t>(block - light_->blocks.begin(),
                                                static_cast<std::ptrdiff_t>(light_->blocks.size()) - 1);
    return light_->due[static_cast<std::size_t>(index)] + from_plan_ns;
}

Time AdaptiveFrame::block_due(std::size_t index) const noexcept {
    return light_->due[index] + from_plan_ns_.load();
}

bool AdaptiveFrame::block_lit(std::size_t index) const noexcept {
    const auto [first, last] = groups_of_block(index);
    return std::all_of(&groups_[first], &groups_[last] + 1, [](const Group& group) {
        return group.settled.load(std::memory_order_relaxed) ||
               group.sparse.load(std::memory_order_acquire) || group.better.load(std::memory_order_acquire);
    });
}

bool AdaptiveFrame::block_final(std::size_t index) const noexcept {
    if (rendered()) return block_lit(index);
    const auto [first, last] = groups_of_block(index);
    return std::all_of(&groups_[first], &groups_[last] + 1, [](const Group& group) {
        return group.settled.load(std::memory_order_relaxed) || group.better.load(std::memory_order_acquire);
    });
}

bool AdaptiveFrame::wants(std::int32_t r) noexcept {
    if (cancel_->load(std::memory_order_relaxed)) return false;
    if (!optional_) return true;
    const Group& group = groups_[group_of(first_row_ + r)];
    // Light of the optional part may be taken at any time from now on.
    if (group.settled.load(std::memory_order_acquire) || group.better.load(std::memory_order_acquire))
        return false;
    return !cut_when_due_ || !claimed_.load();
}

void AdaptiveFrame::done(std::int32_t r, const renderer::RenderedRow& how) noexcept {
    const std::int32_t row = first_row_ + r;
    const std::size_t part = optional_ ? 1 : 0;
    sum_row(part, row, how);
    Group& group = groups_[group_of(row)];
    if (group.rows_done.fetch_add(1, std::memory_order_acq_rel) + 1 != group.rows) return;
    group.ended[part] = now();
    if (optional_) {
        group.level = level_;
        group.better.store(true, std::memory_order_release);
    } else {
        group.sparse.store(true, std::memory_order_release);
    }
    changed_();
}

renderer::RenderRequest AdaptiveFrame::request_for(std::int32_t first_row, std::int32_t rows,
                                                   std::span<const QualityLevel> levels) const noexcept {
    const FrameLight::Window& window = light_->windows.front();
    renderer::RenderRequest request;
    request.window = {window.sensor.x - light_->blocks.front().halo_left, window.sensor.y - halo_above_,
                      area_width_, area_rows_};
    request.first_row = first_row;
    request.rows = rows;
    request.row_times =
        std::span(times_).subspan(static_cast<std::size_t>(first_row), static_cast<std::size_t>(rows));
    request.frame_id = light_->frame_id;
    request.common_mid = light_->common_mid;
    request.levels = levels;
    request.frame_times = times_;
    request.frame_y = request.window.y;
    request.plane_rows = area_rows_;
    return request;
}

bool AdaptiveFrame::becomes_mover(Mover who) noexcept {
    Mover now = Mover::none;
    return mover_.compare_exchange_strong(now, who) || now == who;
}

bool AdaptiveFrame::render(QualityLevel level, std::int32_t first_group, std::int32_t groups) noexcept {
    const bool moves = level == QualityLevel::reprojected;
    if (moves && !becomes_mover(Mover::render_thread)) return !cancel_->load();
    optional_ = level != QualityLevel::sixteenth;
    sparse_begun_ = sparse_begun_ || !optional_;
    cut_when_due_ = optional_ && !sparse_begun_ && !claimed_.load() && due(first_group) == never_due;
    level_ = level;
    for (std::int32_t g = first_group; g < first_group + groups; ++g) {
        groups_[static_cast<std::size_t>(g)].rows_done.store(0, std::memory_order_relaxed);
        groups_[static_cast<std::size_t>(g)].optional_begun = optional_;
    }
    const Group& last = groups_[static_cast<std::size_t>(first_group + groups - 1)];
    first_row_ = groups_[static_cast<std::size_t>(first_group)].first_row;
    const std::int32_t rows = last.first_row + last.rows - first_row_;
    const auto first = static_cast<std::size_t>(first_row_);
    levels_.assign(static_cast<std::size_t>(rows), level);

    renderer::RenderRequest request = request_for(first_row_, rows, levels_);
    const std::size_t at = first * static_cast<std::size_t>(area_width_);
    const std::size_t pixels = static_cast<std::size_t>(rows) * static_cast<std::size_t>(area_width_);
    request.samples = std::span(samples_[0]).subspan(at, pixels);
    request.variance = std::span(variance_[0]).subspan(at, pixels);
    request.kept = &samples_kept_;
    // Light that was moved is not moved again: see KeptFrames.
    request.keep = moves ? nullptr : light_->keep;
    request.from = moves ? earlier_.light : nullptr;
    request.gate = this;
    static_cast<void>(render_noting(*light_->renderer, request,
                                    std::span(floats_[optional_ ? 1 : 0]).subspan(at), nullptr,
                                    light_->faults));
    if (moves && std::all_of(groups_.begin() + first_group, groups_.begin() + first_group + groups,
                             [](const Group& g) { return g.better.load(std::memory_order_relaxed); }))
        learn_moved_error(1, first_row_, rows);
    return !cancel_->load();
}

Time AdaptiveFrame::last_resort_due(std::size_t index) const noexcept {
    if (earlier_.light == nullptr) return never_due;
    Time begin = never_due;
    double needed_ns = 0;
    for (std::size_t i = index; i < light_->blocks.size(); ++i) {
        needed_ns += 1.25 * earlier_row_ns_ * light_->blocks[i].lines();
        begin = std::min(begin, block_due(i) - static_cast<std::int64_t>(needed_ns));
    }
    return begin - wake_ns;
}

void AdaptiveFrame::make_earlier(const Group& group, QualityLevel level) noexcept {
    earlier_levels_.assign(static_cast<std::size_t>(group.rows), level);
    renderer::RenderRequest request = request_for(group.first_row, group.rows, earlier_levels_);
    const std::size_t at = static_cast<std::size_t>(group.first_row) * static_cast<std::size_t>(area_width_);
    const std::size_t pixels = static_cast<std::size_t>(group.rows) * static_cast<std::size_t>(area_width_);
    request.samples = std::span(samples_[1]).subspan(at, pixels);
    request.variance = std::span(variance_[1]).subspan(at, pixels);
    request.from = earlier_.light;
    request.alone = alone_;
    static_cast<void>(render_noting(*light_->renderer, request, std::span(floats_[2]).subspan(at), nullptr,
                                    light_->faults));
    for (std::int32_t row = group.first_row; row < group.first_row + group.rows; ++row)
        sum_row(2, row, {1, level});
}

void AdaptiveFrame::take_earlier(std::size_t index) noexcept {
    // The render thread moves groups after the mandatory part only: then all have light.
    if (!becomes_mover(Mover::maker)) return;
    const auto [first, last] = groups_of_block(index);
    for (std::size_t g = first; g <= last; ++g) {
        Group& group = groups_[g];
        if (group.settled.load(std::memory_order_relaxed) || group.sparse.load(std::memory_order_acquire) ||
            group.better.load(std::memory_order_acquire))
            continue;
        group.settled.store(true, std::memory_order_release);
        const Time begin = clock_.now();
        const double needed_ns = earlier_row_ns_ * group.rows;
        const bool in_time = begin + static_cast<std::int64_t>(needed_ns) <= block_due(index);
        settled_[g] = in_time ? QualityLevel::reprojected : QualityLevel::repeated;
        make_earlier(group, settled_[g]);
        part_of_[g] = 2;
        group.ended[2] = clock_.now();
        used_earlier_ = true;
        if (in_time)
            earlier_row_ns_ +=
                0.3 * (static_cast<double>(clock_.now() - begin) / group.rows - earlier_row_ns_);
    }
}

void AdaptiveFrame::try_last_resort() noexcept {
    if (earlier_.light == nullptr || earlier_row_ns_ > 0 || !becomes_mover(Mover::maker)) return;
    const Group& group = groups_[static_cast<std::size_t>(group_count_ / 2)];
    const Time begin = clock_.now();
    make_earlier(group, QualityLevel::reprojected);
    earlier_row_ns_ = std::max(1.0, static_cast<double>(clock_.now() - begin) / group.rows);
    learn_moved_error(2, group.first_row, group.rows);
}

/// Whether no body is near its rows.
bool AdaptiveFrame::same_as_full(const Group& group, std::size_t part) const noexcept {
    const auto first = sums_[part].begin() + group.first_row;
    return std::all_of(first, first + group.rows, [](const RowSums& row) { return row.full; });
}

void AdaptiveFrame::settle(std::size_t index) noexcept {
    const auto [first, last] = groups_of_block(index);
    for (std::size_t g = first; g <= last; ++g) {
        Group& group = groups_[g];
        if (group.settled.load(std::memory_order_relaxed)) continue;
        // A level that is reached from now on is not used: `settled` says so to those who render.
        const std::size_t part = group.better.load(std::memory_order_acquire) ? 1 : 0;
        part_of_[g] = part;
        settled_[g] = same_as_full(group, part) ? QualityLevel::full
                      : part == 0               ? QualityLevel::sixteenth
                                                : group.level;
        group.settled.store(true, std::memory_order_release);
    }
}

void AdaptiveFrame::take(std::size_t index, std::span<float> out) noexcept {
    settle(index);
    const RowBlock& block = light_->blocks[index];
    const auto width = static_cast<std::size_t>(area_width_);
    const std::size_t plane = static_cast<std::size_t>(area_rows_) * width;
    const std::int32_t top = halo_above_ + block.first_row - block.halo_above;
    const std::size_t bands = light_->renderer->band_count();
    for (std::int32_t line = 0; line < block.lines(); ++line) {
        const std::int32_t row = top + line;
        const std::size_t part = part_of_[group_of(row)];
        for (std::size_t b = 0; b < bands; ++b) {
            const auto from = floats_[part].begin() +
                              static_cast<std::ptrdiff_t>(b * plane + static_cast<std::size_t>(row) * width);
            std::copy_n(from, width,
                        out.begin() +
                            static_cast<std::ptrdiff_t>((b * static_cast<std::size_t>(block.lines()) +
                                                         static_cast<std::size_t>(line)) *
                                                        width));
        }
    }
}

} // namespace obscura::emulator
