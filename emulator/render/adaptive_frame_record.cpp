// SPDX-License-Identifier: Apache-2.0
// AdaptiveFrame: knowledge of the quality of its light, and the record of it.
#include "emulator/render/adaptive_frame.hpp"
#include "emulator/render/frame_work.hpp"
#include "renderer/packets/packet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>

namespace obscura::emulator {
namespace {

/// The render threads had less than this share of a core each while they were at work: other programs took
/// the rest. Of measurements that add up to so much.
constexpr double min_cpu_share = 0.75;
constexpr double min_measured_ns = 1e6;

float nth_of(std::span<float> values, std::size_t n) noexcept {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(n);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

constexpr std::size_t lanes = 16;

/// Sums over the pixels of a row, of each 16 side by side: the same on any machine, and vectors where there
/// are some.
struct PixelSums {
    double light[lanes] = {}, light2[lanes] = {}, variance[lanes] = {}, samples[lanes] = {};
    double lit[lanes] = {}, unknown[lanes] = {};
    double min_samples[lanes];

    PixelSums() noexcept { std::fill_n(min_samples, lanes, std::numeric_limits<float>::max()); }
    [[nodiscard]] static double sum(const double (&of)[lanes]) noexcept {
        return std::accumulate(std::begin(of), std::end(of), 0.0);
    }
};

constexpr double most = std::numeric_limits<float>::max();

/// Adds 16 pixels. `light`: mean over the bands.
OBSCURA_VECTOR_CLONES
void add_pixels(const float* __restrict samples, const float* __restrict variance,
                const double* __restrict light, PixelSums& __restrict sums) {
    // Factors of 0 and 1 instead of branches, which compilers keep out of vectors.
    for (std::size_t i = 0; i < lanes; ++i) {
        const double all = light[i], n = static_cast<double>(samples[i]);
        const double v = static_cast<double>(variance[i]), least = sums.min_samples[i];
        const double sampled = n > 0 ? 1.0 : 0.0, known = v > 0 ? 1.0 : 0.0, shines = all > 0 ? 1.0 : 0.0;
        const double lit = sampled * shines;
        const double own = lit * n + (1 - lit) * most;
        // Also of dark pixels, beside which there may be light.
        sums.variance[i] += sampled * v;
        sums.light[i] += lit * all;
        sums.light2[i] += lit * all * all;
        sums.samples[i] += lit * n;
        sums.lit[i] += lit;
        sums.unknown[i] += lit * (1 - known);
        sums.min_samples[i] = own < least ? own : least;
    }
}

/// Adds a band of 16 pixels to the mean of the bands.
OBSCURA_VECTOR_CLONES
void add_band(const float* __restrict band, double share, double* __restrict light) {
    for (std::size_t i = 0; i < lanes; ++i)
        light[i] += share * static_cast<double>(band[i]);
}

/// Whether any of 16 numbers, none of which is negative, is not 0.
bool any(const float* values) {
    std::array<std::uint64_t, lanes / 2> bits;
    std::memcpy(bits.data(), values, sizeof(bits));
    return std::accumulate(bits.begin(), bits.end(), std::uint64_t{0}, std::bit_or<>()) != 0;
}

} // namespace

void AdaptiveFrame::sum_row(std::size_t part, std::int32_t row, const renderer::RenderedRow& how) noexcept {
    const auto width = static_cast<std::size_t>(area_width_);
    const std::size_t at = static_cast<std::size_t>(row) * width;
    const std::vector<float>& samples = samples_[part / 2];
    const std::vector<float>& variance = variance_[part / 2];
    const std::size_t plane = static_cast<std::size_t>(area_rows_) * width;
    const std::size_t bands = light_->renderer->band_count();
    const double share = 1 / static_cast<double>(bands);
    PixelSums pixels;
    float rest[2][lanes] = {}, padded[lanes] = {}; // at the end of the row
    for (std::size_t x = 0; x < width; x += lanes) {
        const std::size_t count = std::min(lanes, width - x);
        const float* n = samples.data() + at + x;
        const float* v = variance.data() + at + x;
        if (count < lanes) {
            n = std::copy_n(n, count, rest[0]) - count;
            v = std::copy_n(v, count, rest[1]) - count;
        }
        if (!any(n)) continue;
        double light[lanes] = {};
        for (std::size_t b = 0; b < bands; ++b) {
            const float* const own = floats_[part].data() + b * plane + at + x;
            const float* from = own;
            if (count < lanes) from = std::copy_n(own, count, padded) - count;
            add_band(from, share, light);
        }
        add_pixels(n, v, light, pixels);
    }
    RowSums sums;
    sums.instants = how.instants;
    sums.full = how.level == QualityLevel::full;
    sums.light = PixelSums::sum(pixels.light);
    sums.light2 = PixelSums::sum(pixels.light2);
    sums.variance = PixelSums::sum(pixels.variance);
    sums.samples = PixelSums::sum(pixels.samples);
    sums.lit = static_cast<std::int32_t>(PixelSums::sum(pixels.lit));
    sums.unknown = static_cast<std::int32_t>(PixelSums::sum(pixels.unknown));
    sums.min_samples =
        static_cast<float>(*std::min_element(std::begin(pixels.min_samples), std::end(pixels.min_samples)));
    sums_[part][static_cast<std::size_t>(row)] = sums;
}

double AdaptiveFrame::lit_share(std::int32_t group) const noexcept {
    const Group& g = groups_[static_cast<std::size_t>(group)];
    const bool better = g.better.load(std::memory_order_acquire);
    if (!better && !g.sparse.load(std::memory_order_acquire)) return -1;
    const auto first = sums_[better ? 1 : 0].begin() + g.first_row;
    const std::int64_t lit =
        std::accumulate(first, first + g.rows, std::int64_t{0},
                        [](std::int64_t sum, const RowSums& row) { return sum + row.lit; });
    return static_cast<double>(lit) / (static_cast<double>(g.rows) * area_width_);
}

void AdaptiveFrame::learn_moved_error(std::size_t part, std::int32_t first_row, std::int32_t rows) noexcept {
    double light2 = 0, variance = 0;
    for (std::int32_t r = first_row; r < first_row + rows; ++r) {
        light2 += sums_[part][static_cast<std::size_t>(r)].light2;
        variance += sums_[part][static_cast<std::size_t>(r)].variance;
    }
    if (!(light2 > 0)) return;
    moved_age_ns_.store(std::max(1.0, std::abs(static_cast<double>(light_->mid() - earlier_.mid))),
                        std::memory_order_relaxed);
    moved_error2_.store(variance / light2, std::memory_order_relaxed);
}

double AdaptiveFrame::error2(QualityLevel level, std::int32_t first_group,
                             std::int32_t groups) const noexcept {
    constexpr double unknown = -1;
    if (level == QualityLevel::reprojected) {
        const double moved2 = moved_error2_.load(std::memory_order_relaxed);
        if (earlier_.light == nullptr || moved2 < 0 || mover_.load() == Mover::maker) return unknown;
        // Places that were hidden, and shadows that move, grow with the time between.
        const double age = std::abs(static_cast<double>(light_->mid() - earlier_.mid)) /
                           moved_age_ns_.load(std::memory_order_relaxed);
        return earlier_.error * earlier_.error + moved2 * std::max(1.0, age * age);
    }
    const std::size_t part = level == QualityLevel::sixteenth ? 0 : 1;
    double light2 = 0, variance = 0;
    for (std::int32_t g = first_group; g < first_group + groups; ++g) {
        const Group& group = groups_[static_cast<std::size_t>(g)];
        const bool has_level = part == 0
                                   ? group.sparse.load(std::memory_order_acquire)
                                   : group.better.load(std::memory_order_acquire) && group.level == level;
        if (!has_level) return unknown;
        for (std::int32_t r = group.first_row; r < group.first_row + group.rows; ++r) {
            light2 += sums_[part][static_cast<std::size_t>(r)].light2;
            variance += sums_[part][static_cast<std::size_t>(r)].variance;
        }
    }
    return light2 > 0 ? variance / light2 : unknown;
}

std::uint32_t AdaptiveFrame::reasons() const noexcept {
    // Not rendered to its end: the last blocks were taken before.
    std::uint32_t bits = rendered() ? outcome_.reasons : quality_budget;
    const renderer::RenderWork work = rendered() ? work_ : light_->renderer->work() - work_before_;
    const auto measured_ns = static_cast<double>(work.measured_ns);
    if (measured_ns > min_measured_ns &&
        static_cast<double>(work.measured_cpu_ns) < min_cpu_share * measured_ns)
        bits |= quality_stall;
    if (work.page_faults > 0) bits |= quality_page_fault;
    return bits;
}

void AdaptiveFrame::describe(FrameQuality& quality, const LightUse& use) const noexcept {
    const auto height = static_cast<std::int32_t>(light_->rows.size());
    describe_levels(quality, std::span(settled_).first(static_cast<std::size_t>(group_count_)), height);
    quality.bounces_asked = quality.bounces = light_->renderer->bounces_at(QualityLevel::full);
    const double electrons = use.electrons_per_s_per_w_m2 * use.exposure_s;
    RowSums all;
    all.min_samples = std::numeric_limits<float>::max();
    all.instants = std::numeric_limits<std::uint32_t>::max();
    double worst_variance = 0; // mean of a group
    std::array<float, max_quality_groups> means{};
    std::array<float, max_quality_groups> ratios2{};
    std::size_t lit_groups = 0;
    std::int64_t margin_ns = std::numeric_limits<std::int64_t>::max();
    for (std::size_t g = 0; g < static_cast<std::size_t>(group_count_); ++g) {
        const Group& group = groups_[g];
        const std::size_t part = part_of_[g];
        quality.bounces = std::min(quality.bounces, light_->renderer->bounces_at(settled_[g]));
        margin_ns = std::min(margin_ns, due(static_cast<std::int32_t>(g)) - group.ended[part]);
        // What is made from an earlier frame has its error, too.
        const double earlier = settled_[g] >= QualityLevel::reprojected ? earlier_.error * earlier_.error : 0;
        RowSums sums;
        for (std::int32_t r = group.first_row; r < group.first_row + group.rows; ++r) {
            const RowSums& row = sums_[part][static_cast<std::size_t>(r)];
            sums.light += row.light;
            sums.light2 += row.light2;
            sums.variance += row.variance + earlier * row.light2;
            sums.samples += row.samples;
            sums.lit += row.lit;
            sums.unknown += row.unknown;
            all.instants = std::min(all.instants, row.instants);
            if (row.lit > 0) all.min_samples = std::min(all.min_samples, row.min_samples);
        }
        if (sums.lit == 0) continue;
        all.light2 += sums.light2;
        all.variance += sums.variance;
        all.samples += sums.samples;
        all.lit += sums.lit;
        all.unknown += sums.unknown;
        const double variance = sums.variance / sums.lit;
        worst_variance = std::max(worst_variance, variance);
        means[lit_groups] = static_cast<float>(sums.samples / sums.lit);
        ratios2[lit_groups++] =
            static_cast<float>(variance * electrons * electrons /
                               use.noise.variance_e2(sums.light / sums.lit * electrons, use.exposure_s));
    }
    quality.instants = all.instants;
    if (all.lit > 0 && all.light2 > 0) {
        quality.error_rms = static_cast<float>(std::sqrt(all.variance / all.light2));
        quality.error_worst_group = static_cast<float>(std::sqrt(worst_variance * all.lit / all.light2));
        quality.unknown_share = static_cast<float>(all.unknown) / static_cast<float>(all.lit);
        quality.samples_mean = static_cast<float>(all.samples / all.lit);
        quality.samples_min = all.min_samples;
        quality.samples_median = nth_of(std::span(means).first(lit_groups), lit_groups / 2);
        quality.noise_ratio_p95 =
            std::sqrt(nth_of(std::span(ratios2).first(lit_groups), (19 * lit_groups - 1) / 20));
    }
    quality.reasons = quality.level_max == QualityLevel::full ? 0 : reasons();
    if (used_earlier_) quality.reasons |= quality_budget;
    quality.spent_us = ((rendered() ? outcome_.end : now()) - begin_) / ns_per_us;
    // The source of another frame has no deadlines.
    if (!claimed_.load()) return;
    quality.budget_us = (block_due(light_->blocks.size() - 1) - begin_) / ns_per_us;
    quality.margin_us = margin_ns / ns_per_us;
}

} // namespace obscura::emulator
