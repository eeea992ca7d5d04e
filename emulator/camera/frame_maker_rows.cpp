// SPDX-License-Identifier: Apache-2.0
// Row blocks of a frame: how its light is divided into them, and their way through the detector.
#include "core/camera/image_pattern.hpp"
#include "core/camera/scene_truth.hpp"
#include "emulator/camera/frame_maker.hpp"

#include <algorithm>

namespace obscura::emulator {
namespace {

/// Rows that the detector exposes and reports at a time: the first ones of a block can leave while it works
/// on the others.
constexpr std::int32_t rows_at_a_time = 64;
/// Rows of a frame, and lines of a push-broom sensor's first block, that come first, each time twice as many:
/// with a short exposure they are due soon.
constexpr std::int32_t first_rows = 4;

} // namespace

void FrameMaker::describe_light(const FrameOrder& order, const sensors::ReadoutPlan& plan,
                                const renderer::Renderer& renderer, FrameLight& light) const noexcept {
    light.renderer = &renderer;
    light.frame_id = order.frame_id;
    light.faults = settings_.real_time ? &faults_ : nullptr;
    light.live = settings_.live_poses;
    light.push_broom = readout_.shutter == Shutter::push_broom;
    light.windows.clear();
    for (const FrameWindow& window : plan.windows)
        light.windows.push_back({window.sensor, window.image_y});
    light.rows.clear();
    for (const RowTime& row : plan.rows)
        light.rows.push_back({order.shown.at(row.reset), order.shown.at(row.read)});
    light.common_mid = renderer::common_mid(light.rows);
    light.pixel_times.clear();
    if (plan.pixel_timing != nullptr)
        for (std::size_t w = 0; w < plan.windows.size(); ++w)
            light.pixel_times.push_back(
                pixel_times_of(plan, w, order.shown.at(plan.timed_windows[w].trigger), order.shown.rate));
    light.adapts = settings_.adapts && fixed_levels_.empty() && light.windows.size() == 1 &&
                   !light.push_broom && light.pixel_times.empty();
    const auto height = static_cast<std::int32_t>(light.rows.size());
    const std::int32_t group_rows = FrameQuality::group_rows_for(height);
    light.levels.clear();
    // A list that is too short leaves the rest full.
    if (!fixed_levels_.empty())
        for (std::int32_t g = 0; g < (height + group_rows - 1) / group_rows; ++g)
            light.levels.push_back(static_cast<std::size_t>(g) < fixed_levels_.size()
                                       ? fixed_levels_[static_cast<std::size_t>(g)]
                                       : QualityLevel::full);
    light.from_plan_ns = FrameLight::unknown_clock;
    light.period_ns = 0;
    list_row_blocks(light);
    set_due(plan, light);
}

/// The detector works on the first rows of a block before any of them can leave.
void FrameMaker::set_due(const sensors::ReadoutPlan& plan, FrameLight& light) const noexcept {
    light.due.clear();
    if (!light.adapts) return;
    const std::int64_t early_ns = detector_rows_ns_.load(std::memory_order_relaxed) * 3 / 2 + reserve_ns_;
    for (const RowBlock& block : light.blocks)
        light.due.push_back(plan.release[static_cast<std::size_t>(block.first_row)] - early_ns);
}

void FrameMaker::list_row_blocks(FrameLight& light) const noexcept {
    light.blocks.clear();
    const bool columns = detector_.needs_whole_columns();
    const std::int32_t halo = detector_.halo_rows();
    for (std::size_t w = 0; w < light.windows.size(); ++w) {
        const FrameLight::Window& window = light.windows[w];
        const Region& r = window.sensor;
        for (std::int32_t row = 0; row < r.height;) {
            RowBlock block{.window = w, .first_row = window.image_y + row};
            if (light.push_broom) {
                block.rows = std::min({first_rows + row, buffer_rows_, r.height - row});
            } else if (columns) {
                block.rows = r.height;
                block.halo_above = r.y;
                block.halo_below = readout_.height - r.y - r.height;
            } else {
                // Rows of one block wait for each other.
                const std::int32_t most = light.adapts ? rows_at_a_time : settings_.band_rows;
                block.rows = std::min({most, settings_.band_rows, buffer_rows_, r.height - row});
                block.halo_above = std::min(halo, r.y + row);
                block.halo_below = std::min(halo, readout_.height - r.y - row - block.rows);
            }
            block.halo_left = std::min(halo, r.x);
            block.halo_right = std::min(halo, readout_.width - r.x - r.width);
            light.blocks.push_back(block);
            row += block.rows;
        }
    }
}

void FrameMaker::run_detector() noexcept {
    for (std::uint32_t number = 0;; ++number) {
        while (posted_.load(std::memory_order_acquire) == number)
            posted_.wait(number, std::memory_order_acquire);
        if (stopping_.load(std::memory_order_acquire)) return;
        expose_row_block(number);
        done_.store(number + 1); // sequentially consistent, see Releaser::run()
        done_.notify_one();
    }
}

void FrameMaker::expose_row_block(std::uint32_t number) noexcept {
    const std::size_t index = number - frame_start_;
    const RowBlock& block = light_.blocks[index];
    // Smear is a sum over whole columns, made anew for each call of the detector.
    const bool whole = detector_.needs_whole_columns();
    std::int32_t step = whole ? block.rows : index == 0 ? first_rows : rows_at_a_time;
    for (std::int32_t row = 0, next = 0; row < block.rows;
         row = next, step = std::min(2 * step, rows_at_a_time)) {
        next = row + step;
        RowBlock part = block;
        part.first_row += row;
        part.rows = std::min(step, block.rows - row);
        part.halo_above += row;
        part.halo_below += block.rows - row - part.rows;
        expose_rows(part, block_light_[index], index != 0);
    }
}

void FrameMaker::expose_rows(const RowBlock& block, std::span<const float> light, bool timed) noexcept {
    Frame& frame = *frame_;
    const Time begin_time = work_ != nullptr || settings_.adapts ? clock_.now() : Time{};
    const sensors::IrradianceBand band{block.first_row, block.rows,       light_.width(block),
                                       light,           block.halo_above, block.halo_below,
                                       block.halo_left, block.halo_right};
    const std::size_t begin =
        static_cast<std::size_t>(block.first_row) * static_cast<std::size_t>(plan_.width);
    const std::size_t pixels = static_cast<std::size_t>(block.rows) * static_cast<std::size_t>(plan_.width);
    sensors::ExposureTruth truth;
    if (PixelTruth* whole = frame.pixel_truth()) {
        truth.mean_e = std::span(whole->mean_e).subspan(begin, pixels);
        truth.saturated = std::span(whole->saturated).subspan(begin, pixels);
    }
    const std::uint32_t saturated =
        detector_.expose(plan_, band, frame.info.frame_id, {frame.info.gain_db, black_shift_dn_},
                         frame.pixels().subspan(begin, pixels), truth);
    if (saturated != 0) frame.saturated_windows.fetch_or(saturated, std::memory_order_relaxed);
    if (const FrameWindow& window = plan_.windows[block.window]; measured_ && window.request == 0)
        for (std::int32_t row = block.first_row; row < block.first_row + block.rows; ++row)
            histogram_.add(frame.row(row).first(static_cast<std::size_t>(window.sensor.width)));
    if (pattern_ != ImagePattern::off) paint_pattern(block.first_row, block.rows);
    const std::int32_t ready = block.first_row + block.rows;
    if (work_ != nullptr) work_->detector_ns += clock_.now() - begin_time;
    if (settings_.adapts && timed) {
        const std::int64_t mean_ns = detector_rows_ns_.load(std::memory_order_relaxed);
        const std::int64_t spent_ns = clock_.now() - begin_time;
        detector_rows_ns_.store(mean_ns == 0 ? spent_ns : mean_ns + (spent_ns - mean_ns) / 8,
                                std::memory_order_relaxed);
    }
    if (ready == plan_.height) frame.info.detector_end = clock_.now();
    if (sink_ != nullptr)
        sink_->rows_exposed(ready);
    else
        frame.publish_rows(ready);
}

void FrameMaker::paint_pattern(std::int32_t first_row, std::int32_t rows) noexcept {
    Frame& frame = *frame_;
    std::uint32_t w = 0;
    for (std::int32_t row = first_row; row < first_row + rows; ++row) {
        while (w + 1 < frame.info.window_count && frame.info.windows[w + 1].image_y <= row)
            ++w;
        const Region& window = frame.info.windows[w].sensor;
        fill_pattern(pattern_, frame.info.frame_id, window.x, plan_.sensor_row[static_cast<std::size_t>(row)],
                     adc_bits_, frame.row(row).first(static_cast<std::size_t>(window.width)));
    }
}

} // namespace obscura::emulator
