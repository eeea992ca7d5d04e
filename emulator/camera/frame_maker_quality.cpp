// SPDX-License-Identifier: Apache-2.0
// Quality that a frame was rendered with, and the counters of it.
#include "emulator/camera/frame_maker.hpp"

#include <algorithm>
#include <numeric>

namespace obscura::emulator {

void FrameMaker::note_lod_deficit(FrameQuality& quality, const renderer::RenderWork& work) noexcept {
    set_lod_deficit(quality, work);
    if (quality.rays_doubtful > 0) doubtful_frames_.fetch_add(1, std::memory_order_relaxed);
    if (!(quality.lod_deficit_share > 0) && quality.tiles_missing == 0) return;
    lod_frames_.fetch_add(1, std::memory_order_relaxed);
    lod_tiles_.fetch_add(quality.tiles_missing, std::memory_order_relaxed);
}

void FrameMaker::set_render_speed(std::int64_t frame_ns, std::int64_t reserve_ns) noexcept {
    reserve_ns_ = reserve_ns;
    if (render_thread_ != nullptr) render_thread_->expect_frame_time(frame_ns, readout_.height);
}

/// Before the last rows are posted to the detector.
void FrameMaker::flag_faults(Frame& frame) noexcept {
    if (faults_.count() == 0 || !faults_.take(frame.info.frame_id)) return;
    frame.flags.fetch_or(frame_failed, std::memory_order_relaxed);
    failed_frames_.fetch_add(1, std::memory_order_relaxed);
}

/// By the ground truth of the frame.
void FrameMaker::flag_held_poses(Frame& frame) noexcept {
    const GroundTruth& truth = frame.info.truth;
    const auto bodies = std::span(truth.bodies).first(truth.body_count);
    if (!(truth.camera_pose_age_s > settings_.max_pose_age_s) &&
        std::none_of(bodies.begin(), bodies.end(),
                     [this](const BodyTruth& body) { return body.pose_age_s > settings_.max_pose_age_s; }))
        return;
    frame.flags.fetch_or(frame_pose_held, std::memory_order_relaxed);
    poses_held_.fetch_add(1, std::memory_order_relaxed);
}

/// Before the last rows are posted to the detector.
void FrameMaker::finish_quality(Frame& frame, bool by_level) noexcept {
    FrameQuality& quality = frame.info.quality;
    quality.error_goal = static_cast<float>(settings_.target_error);
    const std::span<const double> electrons = detector_.electrons_per_s_per_w_m2();
    const LightUse use{.electrons_per_s_per_w_m2 = std::accumulate(electrons.begin(), electrons.end(), 0.0),
                       .exposure_s = to_seconds(plan_.rows.front().read - plan_.rows.front().reset),
                       .noise = sensors::pixel_noise(sensor_.detector, frame.info.gain_db)};
    if (by_level)
        render_thread_->describe(quality, use);
    else if (!light_.levels.empty())
        describe_levels(quality, light_.levels, plan_.height);
    else if (render_thread_ != nullptr)
        render_thread_->describe_moved(quality, use, plan_.height);
    if (std::any_of(quality.group_level.begin(), quality.group_level.begin() + quality.groups, is_biased))
        frame.flags.fetch_or(frame_biased, std::memory_order_relaxed);
    worst_[static_cast<std::size_t>(quality.level_max)].fetch_add(1, std::memory_order_relaxed);
    last_level_.store(quality.level_max, std::memory_order_relaxed);
    last_reasons_.store(quality.reasons, std::memory_order_relaxed);
    last_rows_degraded_.store(quality.rows_degraded, std::memory_order_relaxed);
    last_error_.store(quality.error_rms, std::memory_order_relaxed);
    last_margin_us_.store(quality.margin_us, std::memory_order_relaxed);
    if (quality.level_max == QualityLevel::full) return;
    frame.flags.fetch_or(frame_degraded, std::memory_order_relaxed);
    degraded_.fetch_add(1, std::memory_order_relaxed);
    if (settings_.floor > 0 && static_cast<double>(quality.error_rms) > settings_.floor)
        failed_.fetch_add(1, std::memory_order_relaxed);
}

QualityCounters FrameMaker::quality_counters() const noexcept {
    QualityCounters c;
    c.degraded = degraded_.load(std::memory_order_relaxed);
    c.failed = failed_.load(std::memory_order_relaxed);
    c.last_level = last_level_.load(std::memory_order_relaxed);
    c.last_reasons = last_reasons_.load(std::memory_order_relaxed);
    c.last_rows_degraded = last_rows_degraded_.load(std::memory_order_relaxed);
    c.last_error = last_error_.load(std::memory_order_relaxed);
    c.last_margin_us = last_margin_us_.load(std::memory_order_relaxed);
    for (std::size_t l = 0; l < worst_.size(); ++l)
        c.worst[l] = worst_[l].load(std::memory_order_relaxed);
    return c;
}

} // namespace obscura::emulator
