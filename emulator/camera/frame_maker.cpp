// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/frame_maker.hpp"

#include "core/camera/image_pattern.hpp"
#include "core/camera/scene_truth.hpp"
#include "core/error.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/camera/frame_truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>

namespace obscura::emulator {

namespace {

/// For the poses of some ten thousand row instants.
constexpr std::size_t truth_workspace_bytes = std::size_t{16} << 20;

sensors::WindowRequest request_of(const CameraWindow& w) {
    return {w.region, w.exposure_ns, w.sampling, w.reads};
}

/// Rows that the detector exposes and reports at a time: the first ones of a block can leave while it works
/// on the others.
constexpr std::int32_t rows_at_a_time = 64;
/// Rows of a frame, and lines of a push-broom sensor's first block, that come first, each time twice as many:
/// with a short exposure they are due soon.
constexpr std::int32_t first_rows = 4;

/// Whether rows are made of an earlier frame.
bool uses_earlier(const FrameLight& light) {
    return std::any_of(light.levels.begin(), light.levels.end(),
                       [](QualityLevel level) { return level >= QualityLevel::reprojected; });
}

struct Requests {
    explicit Requests(const CameraSettings& s) : count(s.window_count()) {
        for (std::size_t i = 0; i < count; ++i)
            list[i] = request_of(s.window(i));
    }
    [[nodiscard]] std::span<const sensors::WindowRequest> all() const { return {list.data(), count}; }

    std::array<sensors::WindowRequest, max_windows> list;
    std::size_t count;
};

} // namespace

FrameMaker::FrameMaker(const renderer::Renderer& renderer, sensors::Detector& detector,
                       const SensorDescription& sensor, const Clock& clock, FrameMakerSettings settings)
    : renderer_(&renderer),
      detector_(detector),
      clock_(clock),
      sensor_(sensor),
      readout_(sensor_.readout),
      adc_bits_(sensor.detector.adc_bits),
      offset_dn_(sensor.detector.offset_dn),
      settings_(settings),
      band_count_(renderer.band_count()),
      run_(settings.run),
      histogram_(sensor.detector.adc_bits) {
    // Plan once in full size, so that later plans need no allocation.
    const sensors::WindowRequest whole{{0, 0, readout_.width, readout_.height}, 10 * ns_per_ms};
    const auto rows = static_cast<std::size_t>(std::max(settings_.max_rows, readout_.height));
    for (sensors::ReadoutPlan* plan : {&plan_, &expected_plan_}) {
        if (const std::string refusal = plan_readout(readout_, {&whole, 1}, Time{}, *plan); !refusal.empty())
            throw ConfigError(fmt::format("sensor: {}", refusal));
        plan->windows.reserve(max_windows);
        plan->rows.reserve(rows);
        plan->sensor_row.reserve(rows);
        plan->release.reserve(rows);
    }
    sequencer_.reserve(readout_);
    expected_sequencer_.reserve(readout_);
    for (FrameLight* light : {&light_, &expected_light_}) {
        light->windows.reserve(max_windows);
        light->rows.reserve(rows);
        light->blocks.reserve(rows + max_windows);
        light->due.reserve(rows + max_windows);
        light->levels.reserve(max_quality_groups);
    }
    block_light_.resize(rows + max_windows);

    const bool lines = readout_.shutter == Shutter::push_broom;
    buffer_rows_ = lines ? std::min(settings_.band_rows, static_cast<std::int32_t>(rows))
                   : detector_.needs_whole_columns()
                       ? readout_.height
                       : std::min(settings_.band_rows + 2 * detector_.halo_rows(), readout_.height);
    if (settings_.scene_truth) truth_workspace_.resize(truth_workspace_bytes);
    const std::size_t line = band_count_ * static_cast<std::size_t>(readout_.width);
    for (std::vector<float>& buffer : buffers_)
        buffer.assign(line * static_cast<std::size_t>(buffer_rows_), 0.0F);
    const auto block_renderer = [&] { return BlockRenderer(buffer_rows_); };
    blocks_ = std::make_unique<BlockRenderer>(block_renderer());
    if (settings_.enter_render) {
        // Any frame with the halo of each of its blocks; where those are whole columns, what there is room
        // for.
        const std::size_t blocks = rows / static_cast<std::size_t>(settings_.band_rows) + max_windows;
        const std::size_t lines_kept = rows + 2 * blocks * static_cast<std::size_t>(detector_.halo_rows());
        const std::size_t area_rows = rows + 2 * static_cast<std::size_t>(detector_.halo_rows());
        LevelStore levels;
        if (settings_.adapts)
            levels = {line * area_rows, line * area_rows / band_count_, area_rows, [&] {
                          return std::make_unique<renderer::Workspace>(renderer, readout_.width,
                                                                       static_cast<std::int32_t>(area_rows));
                      }};
        KeptFrames::Make make_kept;
        if (settings_.reprojects || settings_.adapts) make_kept = [this] { return make_kept_light(); };
        render_thread_ = std::make_unique<RenderThread>(light_, line * lines_kept, block_renderer(), clock_,
                                                        settings_.enter_render, levels, make_kept);
    }
    thread_ = std::thread([this] {
        enter_thread("detector", settings_.thread);
        declare_this_thread_realtime();
        run_detector();
    });
}

FrameMaker::~FrameMaker() {
    stopping_ = true;
    posted_.fetch_add(1);
    posted_.notify_all();
    thread_.join();
}

std::string FrameMaker::plan_frame(const FrameOrder& order) {
    // Clear the sensor's state, so that every acquisition gives the same frames.
    if (order.frame_id == 1) {
        if (std::exchange(has_run_, true) && !settings_.same_run)
            run_.store(run() + 1, std::memory_order_relaxed);
        ++acquisitions_;
        detector_.begin_run(run());
        lag_from_frame_ = 0;
        sequencer_.restart();
    }
    const CameraSettings& s = order.settings;
    const Requests requests(s);
    asked_start_ = order.scene_time + s.trigger_delay_ns;
    sensors::TriggerVerdict verdict = sequencer_.next(readout_, requests.all(), asked_start_, plan_);
    if (verdict == sensors::TriggerVerdict::over_trigger) {
        // The caller knows that the chip was free: the frame rate differs from nominal.
        sequencer_.restart();
        verdict = sequencer_.next(readout_, requests.all(), asked_start_, plan_);
    }
    return verdict == sensors::TriggerVerdict::accepted ? std::string() : sequencer_.reason();
}

std::unique_ptr<renderer::KeptLight> FrameMaker::make_kept_light() const {
    const std::int32_t rows = std::max(settings_.max_rows, readout_.height);
    const auto halos = static_cast<std::int32_t>(max_windows) * 2 * detector_.halo_rows();
    return std::make_unique<renderer::KeptLight>(current(), readout_.width, rows + halos, max_windows);
}

/// Sets what the frame prepared last is made of and where its light is kept, without a render thread.
std::string FrameMaker::find_earlier() noexcept {
    // Lines of a frame before show other places.
    light_.keep = light_.push_broom ? nullptr : kept_.begin(light_);
    light_.from = kept_.earlier(light_).light;
    if (light_.from != nullptr) light_.from->begin_reprojection();
    return light_.from == nullptr && uses_earlier(light_)
               ? "its levels ask for rows of an earlier frame, and there is none"
               : std::string();
}

void FrameMaker::skip(const FrameOrder& order) {
    static_cast<void>(plan_frame(order));
}

bool FrameMaker::overlaps(Time scene_time) const noexcept {
    return scene_time < plan_.release.back();
}

std::string FrameMaker::prepare(const FrameOrder& order, Frame& frame) {
    if (const renderer::Renderer* next = next_renderer_.exchange(nullptr))
        renderer_.store(next, std::memory_order_release);
    const CameraSettings& s = order.settings;
    if (std::string refusal = plan_frame(order); !refusal.empty()) return refusal;
    if (!frame.fits(plan_.width, plan_.height) || plan_.width > readout_.width)
        return fmt::format("the windows make an image of {} x {} pixels, for which there is no room",
                           plan_.width, plan_.height);
    describe_light(order, plan_, current(), light_);
    if (std::string refusal = find_earlier(); !refusal.empty()) return refusal;
    scene_to_clock_ns_ = order.trigger_edge - order.scene_time;
    light_.from_plan_ns = scene_to_clock_ns_;
    light_.period_ns = order.frame_id > 1 && last_edge_.ns != 0 ? order.trigger_edge - last_edge_ : 0;
    last_edge_ = order.trigger_edge;

    FrameInfo& info = frame.info;
    info.frame_id = order.frame_id;
    info.trigger_id = order.trigger_id;
    info.trigger_edge = order.trigger_edge;
    info.seen = order.seen;
    info.tai_offset_ns = order.tai_offset_ns;
    info.clock_state = order.clock_state;
    info.width = plan_.width;
    info.height = plan_.height;
    info.bits_per_pixel = adc_bits_;
    info.pixel_format = s.pixel_format;
    info.gain_db = s.gain_db;
    info.exposure_ns = s.exposure_ns;
    black_shift_dn_ = s.black_level_dn - offset_dn_;
    pattern_ = s.test_pattern;
    measured_ = s.exposure_auto != ExposureAuto::off;
    if (measured_) histogram_.clear();
    info.window_count = static_cast<std::uint32_t>(plan_.windows.size());
    std::copy(plan_.windows.begin(), plan_.windows.end(), info.windows.begin());
    const auto clamped = [](const FrameWindow& w) {
        return (w.flags &
                (sensors::exposure_clamped_up | sensors::exposure_clamped_down | sensors::row_shared)) != 0;
    };
    if (std::any_of(plan_.windows.begin(), plan_.windows.end(), clamped))
        frame.flags.fetch_or(frame_readout_clamped, std::memory_order_relaxed);

    if (detector_.lag_frames() > 0 && (order.frame_id == 1 || lag_from_frame_ != order.frame_id - 1))
        frame.flags.fetch_or(frame_lag_unknown, std::memory_order_relaxed);

    std::transform(plan_.rows.begin(), plan_.rows.end(), frame.row_times().begin(), [this](RowTime row) {
        return RowTime{row.reset + scene_to_clock_ns_, row.read + scene_to_clock_ns_};
    });
    if (PixelTruth* truth = frame.pixel_truth()) {
        truth->hits_left_out = detector_.list_hits(plan_, order.frame_id, truth->hits);
        truth->hits_left_out -= truth->hits.size();
        for (ParticleHit& hit : truth->hits)
            hit.time += scene_to_clock_ns_;
        const std::size_t pixels =
            static_cast<std::size_t>(plan_.width) * static_cast<std::size_t>(plan_.height);
        std::fill_n(truth->mean_e.begin(), pixels, 0.0F);
        std::fill_n(truth->saturated.begin(), pixels, std::uint8_t{0});
    }
    const Time mid = midpoint(plan_.rows.front().reset, plan_.rows.back().read);
    current().fill_truth(order.shown.at(mid), info.truth);
    info.truth.mid_exposure = mid + scene_to_clock_ns_;
    info.truth.seed = settings_.seed;
    info.truth.run = run();
    info.pose = clock_.now();
    origins_.note({order.frame_id, order.trigger_edge, &current(), scene_to_clock_ns_, order.shown,
                   s.black_level_dn, pattern_ != ImagePattern::off});
    return {};
}

void FrameMaker::render_ahead(const ExpectedFrame& frame) noexcept {
    const FrameOrder& expected = frame.order;
    if (render_thread_ == nullptr) return;
    expected_sequencer_ = sequencer_;
    if (expected.frame_id == 1) expected_sequencer_.restart();
    const Requests requests(expected.settings);
    const Time start = expected.scene_time + expected.settings.trigger_delay_ns;
    if (expected_sequencer_.next(readout_, requests.all(), start, expected_plan_) !=
        sensors::TriggerVerdict::accepted)
        return;
    const renderer::Renderer* const next = next_renderer_.load();
    describe_light(expected, expected_plan_, next != nullptr ? *next : current(), expected_light_);
    if (frame.edge) {
        expected_light_.from_plan_ns = *frame.edge - expected.scene_time;
        expected_light_.period_ns = expected.frame_id > 1 ? *frame.edge - last_edge_ : 0;
    }
    const Time not_before =
        frame.edge && frame.most_ahead_ns > 0 ? *frame.edge - frame.most_ahead_ns : Time{};
    render_thread_->expect(expected_light_, tolerance(frame), not_before);
}

/// For how long nothing in the frame moves by more than the tolerance, if it may come at another time at all.
RenderThread::Tolerance FrameMaker::tolerance(const ExpectedFrame& frame) const noexcept {
    constexpr std::int64_t span_ns = ns_per_ms;
    constexpr std::int64_t most_ns = 100 * ns_per_ms;
    RenderThread::Tolerance t{.image_px = frame.tolerance_px, .exact_time = frame.exact_time};
    if (expected_light_.live || frame.exact_time || !(frame.tolerance_px > 0)) return t;
    const Time mid = expected_light_.mid();
    t.px_per_ns = expected_light_.renderer->image_motion_px({mid - span_ns / 2, mid + span_ns / 2}) /
                  static_cast<double>(span_ns);
    const double still_ns = frame.tolerance_px / t.px_per_ns;
    t.time_ns = still_ns < static_cast<double>(most_ns) ? static_cast<std::int64_t>(still_ns) : most_ns;
    return t;
}

bool FrameMaker::fill(Frame& frame, RowSink* sink, const std::atomic<bool>* cancel, FrameWork* work,
                      const ExpectedFrame* next) {
    assert(frame.info.height == plan_.height && "prepare() comes first");
    frame_ = &frame;
    sink_ = sink;
    work_ = work;
    if (render_thread_ != nullptr) render_thread_->claim(light_, frame.info.truth);
    const renderer::RenderWork work_before = current().work();
    frame_start_ = posted_.load(std::memory_order_relaxed);
    frame.info.render_begin = clock_.now();

    bool by_level = render_thread_ != nullptr && render_thread_->has_levels();
    std::uint32_t number = frame_start_;
    const std::uint32_t end = number + static_cast<std::uint32_t>(light_.blocks.size());
    while (number != end) {
        const std::span<const float> light = render_block(number, cancel, work, by_level);
        if (light.empty()) break;
        block_light_[number - frame_start_] = light;
        if (++number == end) {
            frame.info.render_end = clock_.now();
            const bool ahead = render_thread_ != nullptr && render_thread_->took_all();
            const renderer::RenderWork done = ahead ? render_thread_->work() : current().work() - work_before;
            note_lod_deficit(frame.info.quality, done);
            if (work != nullptr) {
                work->render = done;
                if (ahead) {
                    work->ahead_error_px = render_thread_->error_px();
                    work->ahead_ns =
                        std::max<std::int64_t>(0, frame.info.trigger_edge - render_thread_->ended());
                }
            }
            finish_quality(frame, by_level);
            list_scene_truth(frame);
        }
        posted_.store(number); // sequentially consistent, see Releaser::run()
        posted_.notify_one();
    }
    const bool complete = number == end;
    if (complete && by_level) render_thread_->end_claimed();
    if (complete && !uses_earlier(light_)) kept_.accept(light_, 0);
    if (complete && next != nullptr) render_ahead(*next);
    for (std::uint32_t done = done_.load(std::memory_order_acquire); done != number;
         done = done_.load(std::memory_order_acquire))
        done_.wait(done, std::memory_order_acquire);
    lag_from_frame_ = complete ? frame.info.frame_id : 0;
    return complete;
}

/// Waits until the detector has finished the block that used the buffer of block `number` last.
void FrameMaker::wait_for_buffer(std::uint32_t number, FrameWork* work) const noexcept {
    const bool full = number - done_.load(std::memory_order_acquire) >= buffer_count;
    const Time wait_begin = full && work != nullptr ? clock_.now() : Time{};
    for (std::uint32_t done = done_.load(std::memory_order_acquire); number - done >= buffer_count;
         done = done_.load(std::memory_order_acquire))
        done_.wait(done, std::memory_order_acquire);
    if (full && work != nullptr) work->detector_wait_ns += clock_.now() - wait_begin;
}

/// Light of a block of the current frame, from the render thread if there is one and it has room; empty if
/// `cancel` became true.
std::span<const float> FrameMaker::render_block(std::uint32_t number, const std::atomic<bool>* cancel,
                                                FrameWork* work, bool& by_level) {
    const std::size_t index = number - frame_start_;
    if (by_level) {
        wait_for_buffer(number, work);
        const std::span<float> light =
            std::span(buffers_[number % buffer_count]).first(light_.floats(light_.blocks[index]));
        if (render_thread_->take_by_level(index, light, cancel)) return light;
        if (cancel != nullptr && cancel->load()) return {};
        by_level = false; // stopped before it was claimed: render the rest here
    } else if (render_thread_ != nullptr) {
        const std::span<const float> light = render_thread_->take(index, cancel);
        if (!light.empty() || (cancel != nullptr && cancel->load())) return light;
    }
    wait_for_buffer(number, work);
    const RowBlock& block = light_.blocks[index];
    const std::span<float> light = std::span(buffers_[number % buffer_count]).first(light_.floats(block));
    if (!blocks_->render(light_, block, light, cancel)) return {};
    return light;
}

void FrameMaker::note_lod_deficit(FrameQuality& quality, const renderer::RenderWork& work) noexcept {
    set_lod_deficit(quality, work);
    if (!(quality.lod_deficit_share > 0) && quality.tiles_missing == 0) return;
    lod_frames_.fetch_add(1, std::memory_order_relaxed);
    lod_tiles_.fetch_add(quality.tiles_missing, std::memory_order_relaxed);
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

void FrameMaker::list_scene_truth(Frame& frame) {
    SceneTruth* const truth = frame.scene_truth();
    if (truth == nullptr) return;
    list_truth({current(), detector_, sensor_, plan_, light_.rows}, frame, *truth,
               {truth->entries.capacity(), truth_workspace_});
    frame.publish_scene_truth();
}

void FrameMaker::describe_light(const FrameOrder& order, const sensors::ReadoutPlan& plan,
                                const renderer::Renderer& renderer, FrameLight& light) const noexcept {
    light.renderer = &renderer;
    light.frame_id = order.frame_id;
    light.live = settings_.live_poses;
    light.push_broom = readout_.shutter == Shutter::push_broom;
    light.windows.clear();
    for (const FrameWindow& window : plan.windows)
        light.windows.push_back({window.sensor, window.image_y});
    light.rows.clear();
    for (const RowTime& row : plan.rows)
        light.rows.push_back({order.shown.at(row.reset), order.shown.at(row.read)});
    light.common_mid = renderer::common_mid(light.rows);
    light.adapts =
        settings_.adapts && fixed_levels_.empty() && light.windows.size() == 1 && !light.push_broom;
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
    const std::int64_t early_ns =
        detector_rows_ns_.load(std::memory_order_relaxed) * 3 / 2 + settings_.reserve_ns;
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

std::string FrameMaker::make(const FrameOrder& order, Frame& frame) {
    if (std::string refusal = prepare(order, frame); !refusal.empty()) return refusal;
    fill(frame);
    return {};
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

ReadoutAnswer FrameMaker::answer(const CameraSettings& s) const {
    ReadoutAnswer answer;
    sensors::ReadoutPlan plan;
    answer.refusal = plan_readout(readout_, Requests(s).all(), Time{}, plan);
    const std::int32_t rows = std::max(settings_.max_rows, readout_.height);
    if (answer.refusal.empty() && (plan.height > rows || plan.width > readout_.width))
        answer.refusal = fmt::format("the windows make an image of {} x {} pixels, {} x {} is allowed",
                                     plan.width, plan.height, readout_.width, rows);
    if (!answer.refusal.empty()) return answer;
    answer.window_count = static_cast<std::uint32_t>(plan.windows.size());
    std::copy(plan.windows.begin(), plan.windows.end(), answer.windows.begin());
    answer.frame_period_ns = plan.frame_period_ns;
    answer.readout_ns = plan.readout_ns;
    return answer;
}

} // namespace obscura::emulator
