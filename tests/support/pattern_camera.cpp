// SPDX-License-Identifier: Apache-2.0
#include "tests/support/pattern_camera.hpp"

#include <algorithm>
#include <chrono>

namespace obscura::test {

PatternCamera::PatternCamera(const CameraLimits& limits, std::size_t pool_frames)
    : limits_(limits),
      pool_(pool_frames,
            static_cast<std::size_t>(limits.sensor_width) * static_cast<std::size_t>(limits.sensor_height),
            static_cast<std::size_t>(limits.sensor_height)) {
    settings_.region = {0, 0, limits.sensor_width, limits.sensor_height};
    settings_.frame_trigger.enabled = false;
    settings_.frame_rate_hz = 50;
    thread_ = std::thread([this] { loop(); });
}

PatternCamera::~PatternCamera() {
    acquisition_stop(true);
    {
        const std::lock_guard lock(mutex_);
        quit_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

CameraSettings PatternCamera::settings() const {
    const std::lock_guard lock(mutex_);
    return settings_;
}

bool PatternCamera::apply(const CameraSettings& settings) {
    if (!explain_invalid(settings, limits_).empty()) return false;
    const std::lock_guard lock(mutex_);
    settings_ = settings;
    changed_.notify_all();
    return true;
}

bool PatternCamera::acquisition_start() {
    const std::lock_guard lock(mutex_);
    if (acquiring_) return false;
    acquiring_ = true;
    abort_ = false;
    frame_id_ = 0;
    pending_ = 0;
    start_awaited_ = settings_.start_trigger.enabled;
    sequence_step_ = sequence_.start;
    next_ = clock_.now();
    starts_.fetch_add(1);
    changed_.notify_all();
    return true;
}

void PatternCamera::acquisition_stop(bool abort) {
    std::unique_lock lock(mutex_);
    acquiring_ = false;
    abort_ = abort;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !making_; });
}

bool PatternCamera::acquiring() const {
    const std::lock_guard lock(mutex_);
    return acquiring_;
}

bool PatternCamera::set_sequence(const Sequence& sequence) {
    const std::lock_guard lock(mutex_);
    if (acquiring_ || !explain_invalid(sequence, settings_, limits_).empty()) return false;
    sequence_ = sequence;
    return true;
}

CameraActivity PatternCamera::activity() const {
    const std::lock_guard lock(mutex_);
    CameraActivity a = activity_;
    a.trigger_ready = acquiring_ && !making_ && !start_awaited_;
    a.start_awaited = acquiring_ && start_awaited_;
    marks_.fill(a);
    return a;
}

void PatternCamera::reset_counter(std::size_t i) {
    marks_.reset_counter(settings().counters[i], i, io_inputs(*this, clock_));
}

void PatternCamera::reset_timer(std::size_t i) {
    marks_.reset_timer(i, clock_.now());
}

bool PatternCamera::take_start(TriggerSource source, bool falling) {
    if (!acquiring_ || !start_awaited_ || !settings_.start_trigger.accepts(source, falling)) return false;
    start_awaited_ = false;
    next_ = clock_.now();
    changed_.notify_all();
    return true;
}

bool PatternCamera::software_start_trigger(Time) {
    const std::lock_guard lock(mutex_);
    return take_start(TriggerSource::software, false);
}

bool PatternCamera::trigger(TriggerSource source, Time edge, bool falling) {
    const std::lock_guard lock(mutex_);
    if (source == TriggerSource::line0) {
        ++activity_.lines[0].edges;
        activity_.lines[0].edge = edge;
    }
    if (take_start(source, falling)) return true;
    if (!acquiring_ || start_awaited_ || !settings_.frame_trigger.accepts(source, falling)) return false;
    triggers_.fetch_add(1);
    ++activity_.frame_triggers;
    ++pending_;
    pending_edge_ = edge;
    changed_.notify_all();
    return true;
}

bool PatternCamera::software_trigger(Time edge) {
    return trigger(TriggerSource::software, edge);
}
bool PatternCamera::action_trigger(Time edge) {
    return trigger(TriggerSource::action1, edge);
}
bool PatternCamera::line_trigger(Time edge, bool falling) {
    return trigger(TriggerSource::line0, edge, falling);
}

void PatternCamera::loop() {
    std::unique_lock lock(mutex_);
    while (!quit_) {
        if (!acquiring_ || start_awaited_ || (settings_.frame_trigger.enabled && pending_ == 0)) {
            changed_.wait(lock);
            continue;
        }
        Time edge = pending_edge_;
        if (settings_.frame_trigger.enabled) {
            --pending_;
        } else {
            const Time due = next_;
            if (const std::int64_t ahead = due - clock_.now(); ahead > 0) {
                changed_.wait_for(lock, std::chrono::nanoseconds(ahead));
                continue;
            }
            next_ += static_cast<std::int64_t>(1e9 / settings_.frame_rate_hz);
            edge = clock_.now();
        }
        CameraSettings settings = settings_;
        activity_.sequence_step = sequence_.enabled ? sequence_step_ : 0;
        if (sequence_.enabled) {
            settings = with_step(settings, sequence_, sequence_step_);
            sequence_step_ = sequence_.steps[sequence_step_].next;
        }
        ++activity_.frames;
        activity_.frame_start = activity_.exposure_start = edge;
        activity_.frame_end = activity_.exposure_end = edge + settings.exposure_ns;
        const std::uint64_t id = ++frame_id_;
        const bool last = settings.acquisition_mode == AcquisitionMode::single_frame ||
                          (settings.acquisition_mode == AcquisitionMode::multi_frame &&
                           id >= settings.acquisition_frame_count);
        making_ = true;
        const std::uint32_t step = activity_.sequence_step;
        std::vector<Region> windows = windows_;
        if (windows.empty())
            for (std::size_t w = 0; w < settings.window_count(); ++w)
                windows.push_back(settings.window(w).region);
        lock.unlock();
        const bool taken = make_frame(settings, windows, id, edge, step);
        lock.lock();
        making_ = false;
        if (!taken) --frame_id_; // its pixels tell the block's id, and there was no block
        if (taken && last) acquiring_ = false;
        changed_.notify_all();
    }
}

bool PatternCamera::make_frame(const CameraSettings& settings, const std::vector<Region>& windows,
                               std::uint64_t id, Time edge, std::uint32_t step) {
    const FrameRef frame = pool_.acquire();
    if (!frame) return false;
    frame->info.frame_id = id;
    frame->info.trigger_id = id;
    frame->info.trigger_edge = edge;
    frame->info.tai_offset_ns = clock_.tai_offset_ns();
    frame->info.bits_per_pixel = limits_.adc_bits;
    frame->info.pixel_format = settings.pixel_format;
    frame->info.exposure_ns = settings.exposure_ns;
    frame->info.gain_db = settings.gain_db;
    frame->info.line_status = settings.frame_trigger.source == TriggerSource::line0 ? line_status_line0 : 0U;
    frame->info.sequence_step = step;
    frame->info.window_count = static_cast<std::uint32_t>(windows.size());
    std::int32_t width = 0, height = 0;
    for (std::size_t w = 0; w < windows.size(); ++w) {
        const std::int64_t exposure_ns =
            w < settings.window_count() ? settings.window(w).exposure_ns : settings.exposure_ns;
        frame->info.windows[w] = {windows[w], height, exposure_ns, 0};
        frame->info.windows[w].request = static_cast<std::uint32_t>(w);
        // As if the chip's grid had taken its toll.
        frame->info.windows[w].exposure_min_ns = exposure_ns - 100'000;
        frame->info.windows[w].exposure_max_ns = exposure_ns + 100'000;
        width = std::max(width, windows[w].width);
        height += windows[w].height;
    }
    frame->info.width = width;
    frame->info.height = height;
    GroundTruth& truth = frame->info.truth;
    truth.camera.position_m = {1.5 * static_cast<double>(id), 0, 0};
    truth.camera_pose_age_s = 0.25;
    if (degraded_) frame->flags.fetch_or(frame_degraded);
    FrameQuality& quality = frame->info.quality;
    quality.level_max = QualityLevel::quarter;
    quality.reasons = quality_stall;
    quality.rows_degraded = 16;
    quality.tiles_missing = 3;
    quality.error_rms = 0.25F, quality.error_worst_group = 0.5F, quality.samples_mean = 1.5F;
    quality.lod_deficit_share = 0.125F;
    quality.budget_us = 90'000, quality.spent_us = 70'000, quality.margin_us = -500;
    quality.instants = 4, quality.error_goal = 0.0625F, quality.noise_ratio_p95 = 0.75F;
    truth.sun_position_m = {0, 0, -1e11};
    truth.intrinsics = {{2000, 1250}, {31.5, 23.5}, {10e-6, 16e-6}};
    truth.body_count = 2;
    truth.bodies[0].name = {"body"};
    truth.bodies[1].name = {"moon"};
    truth.bodies[1].pose = {{0, 25143.0, 0}, {0.6, 0, 0, 0.8}};
    truth.bodies[1].pose_age_s = 0.5;
    if (transport_ == nullptr || !transport_->submit(frame)) {
        frame->abandon();
        return false;
    }
    frames_made_.fetch_add(1);
    if (blank_) {
        frame->publish_rows(height);
        return true;
    }
    for (std::int32_t y = 0; y < height;) {
        const std::int32_t end = std::min(height, y + band_rows_.load());
        if (band_ns_ > 0) clock_.sleep_until(clock_.now() + band_ns_);
        const std::int32_t give_up = abandon_after_.load();
        if (abort_ || (give_up > 0 && y >= give_up)) {
            frame->abandon();
            return true;
        }
        for (; y < end; ++y) {
            std::size_t w = windows.size() - 1;
            while (frame->info.windows[w].image_y > y)
                --w;
            const Region& r = windows[w];
            const std::int32_t sensor_y = r.y + y - frame->info.windows[w].image_y;
            const auto row = frame->row(y);
            for (std::int32_t x = 0; x < width; ++x)
                row[static_cast<std::size_t>(x)] =
                    x < r.width ? pattern_pixel(id, r.x + x, sensor_y, limits_.adc_bits) : std::uint16_t{0};
            frame->row_times()[static_cast<std::size_t>(y)] = {edge, edge + settings.exposure_ns};
        }
        frame->publish_rows(end);
    }
    return true;
}

} // namespace obscura::test
