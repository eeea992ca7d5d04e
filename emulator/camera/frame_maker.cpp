// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/frame_maker.hpp"

#include "core/camera/scene_truth.hpp"
#include "core/error.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/camera/frame_truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <utility>

namespace obscura::emulator {

namespace {

/// For the poses of some ten thousand row instants.
constexpr std::size_t truth_workspace_bytes = std::size_t{16} << 20;

sensors::WindowRequest request_of(const CameraWindow& w) {
    return {w.region, w.exposure_ns, w.sampling, w.reads};
}

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
      reserve_ns_(settings_.reserve_ns),
      run_(settings.run),
      histogram_(sensor.detector.adc_bits) {
    // Plan once in full size, so that later plans need no allocation.
    const sensors::WindowRequest whole{{0, 0, readout_.width, readout_.height}, 10 * ns_per_ms};
    const auto rows = static_cast<std::size_t>(std::max(settings_.max_rows, readout_.height));
    for (sensors::ReadoutPlan* plan : {&plan_, &expected_plan_}) {
        // A model may refuse an exposure that is never asked for.
        if (const std::string refusal = plan_readout(readout_, {&whole, 1}, Time{}, *plan);
            !refusal.empty() && readout_.timing == nullptr)
            throw ConfigError(fmt::format("sensor: {}", refusal));
        plan->windows.reserve(max_windows);
        plan->rows.reserve(rows);
        plan->sensor_row.reserve(rows);
        plan->release.reserve(rows);
        plan->timed_windows.reserve(max_windows);
    }
    sequencer_.reserve(readout_);
    expected_sequencer_.reserve(readout_);
    for (FrameLight* light : {&light_, &expected_light_}) {
        light->windows.reserve(max_windows);
        light->pixel_times.reserve(max_windows);
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
        if (settings_.reprojects || settings_.adapts)
            make_kept = [this] { return make_reprojection_source(); };
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

std::unique_ptr<renderer::ReprojectionSource> FrameMaker::make_reprojection_source() const {
    const std::int32_t rows = std::max(settings_.max_rows, readout_.height);
    const auto halos = static_cast<std::int32_t>(max_windows) * 2 * detector_.halo_rows();
    return std::make_unique<renderer::ReprojectionSource>(current(), readout_.width, rows + halos,
                                                          max_windows);
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
    if (const renderer::Renderer* next = next_renderer_.exchange(nullptr)) {
        // The detector has nothing to do between two frames.
        const double aperture_m = next->scene().camera.aperture_m;
        if (aperture_m != current().scene().camera.aperture_m) detector_.set_aperture(aperture_m);
        renderer_.store(next, std::memory_order_release);
    }
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
    flag_held_poses(frame);
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
    const Time not_before = frame.edge && frame.max_ahead_ns > 0 ? *frame.edge - frame.max_ahead_ns : Time{};
    render_thread_->expect(expected_light_, tolerance(frame), not_before);
}

/// For how long nothing in the frame moves by more than the tolerance, if it may come at another time at all.
RenderThread::Tolerance FrameMaker::tolerance(const ExpectedFrame& frame) const noexcept {
    constexpr std::int64_t span_ns = ns_per_ms;
    constexpr std::int64_t max_still_ns = 100 * ns_per_ms;
    RenderThread::Tolerance t{.image_px = frame.tolerance_px, .exact_time = frame.exact_time};
    if (expected_light_.live || frame.exact_time || !(frame.tolerance_px > 0)) return t;
    const Time mid = expected_light_.mid();
    t.px_per_ns = expected_light_.renderer->image_motion_px({mid - span_ns / 2, mid + span_ns / 2}) /
                  static_cast<double>(span_ns);
    const double still_ns = frame.tolerance_px / t.px_per_ns;
    t.time_ns =
        still_ns < static_cast<double>(max_still_ns) ? static_cast<std::int64_t>(still_ns) : max_still_ns;
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
            flag_faults(frame);
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

void FrameMaker::list_scene_truth(Frame& frame) {
    SceneTruth* const truth = frame.scene_truth();
    if (truth == nullptr) return;
    list_truth({current(), detector_, sensor_, plan_, light_.rows, light_.pixel_times}, frame, *truth,
               {truth->entries.capacity(), truth_workspace_});
    frame.publish_scene_truth();
}

std::string FrameMaker::make(const FrameOrder& order, Frame& frame) {
    if (std::string refusal = prepare(order, frame); !refusal.empty()) return refusal;
    fill(frame);
    return {};
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
