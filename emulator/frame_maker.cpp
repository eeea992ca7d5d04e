#include "emulator/frame_maker.hpp"

#include "core/error.hpp"
#include "core/image_pattern.hpp"
#include "core/realtime.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace obscura::emulator {

FrameMaker::FrameMaker(const renderer::Renderer& renderer, sensors::Detector& detector,
                       const SensorDescription& sensor, const Clock& clock, FrameMakerSettings settings)
    : renderer_(renderer),
      detector_(detector),
      clock_(clock),
      readout_(sensor.readout),
      adc_bits_(sensor.detector.adc_bits),
      offset_dn_(sensor.detector.offset_dn),
      settings_(settings),
      band_count_(renderer.band_count()) {
    // Planned once in full size, so that later plans find room for every row.
    const sensors::WindowRequest whole{{0, 0, readout_.width, readout_.height}, 10 * ns_per_ms};
    if (const std::string refusal = plan_readout(readout_, {&whole, 1}, Time{}, plan_); !refusal.empty())
        throw ConfigError(fmt::format("sensor: {}", refusal));
    plan_.windows.reserve(max_windows);
    const std::size_t floats = band_count_ * static_cast<std::size_t>(settings_.band_rows) *
                               static_cast<std::size_t>(readout_.width);
    for (std::vector<float>& buffer : buffers_)
        buffer.assign(floats, 0.0F);
    thread_ = std::thread([this] {
        name_this_thread("detector");
        if (settings_.priority > 0) make_this_thread_realtime(settings_.priority);
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

std::string FrameMaker::prepare(const FrameOrder& order, Frame& frame) {
    const CameraSettings& s = order.settings;
    const sensors::WindowRequest window{s.region, s.exposure_ns};
    if (std::string refusal =
            plan_readout(readout_, {&window, 1}, order.scene_time + s.trigger_delay_ns, plan_);
        !refusal.empty())
        return refusal;
    scene_to_clock_ns_ = order.trigger_edge - order.scene_time;

    // The first frame of an acquisition remembers nothing of an earlier one (image lag): it is the same every
    // time.
    if (order.frame_id == 1) detector_.forget();

    FrameInfo& info = frame.info;
    info.frame_id = order.frame_id;
    info.trigger_id = order.trigger_id;
    info.trigger_edge = order.trigger_edge;
    info.seen = order.seen;
    info.tai_offset_ns = order.tai_offset_ns;
    info.width = plan_.width;
    info.height = plan_.height;
    info.bits_per_pixel = adc_bits_;
    info.pixel_format = s.pixel_format;
    info.gain_db = s.gain_db;
    info.exposure_ns = s.exposure_ns;
    black_shift_dn_ = s.black_level_dn - offset_dn_;
    pattern_ = s.test_pattern;
    info.window_count = static_cast<std::uint32_t>(plan_.windows.size());
    std::copy(plan_.windows.begin(), plan_.windows.end(), info.windows.begin());
    const auto clamped = [](const FrameWindow& w) {
        return (w.flags &
                (sensors::exposure_clamped_up | sensors::exposure_clamped_down | sensors::row_shared)) != 0;
    };
    if (std::any_of(plan_.windows.begin(), plan_.windows.end(), clamped))
        frame.flags.fetch_or(frame_readout_clamped, std::memory_order_relaxed);

    std::transform(plan_.rows.begin(), plan_.rows.end(), frame.row_times().begin(), [this](RowTime row) {
        return RowTime{row.reset + scene_to_clock_ns_, row.read + scene_to_clock_ns_};
    });
    const Time mid = midpoint(plan_.rows.front().reset, plan_.rows.back().read);
    renderer_.fill_truth(mid, info.truth);
    info.truth.mid_exposure = mid + scene_to_clock_ns_;
    info.truth.seed = settings_.seed;
    return {};
}

bool FrameMaker::fill(Frame& frame, RowSink* sink, const std::atomic<bool>* cancel) {
    assert(frame.info.height == plan_.height && "prepare() comes first");
    frame_ = &frame;
    sink_ = sink;
    frame_start_ = posted_.load(std::memory_order_relaxed);
    frame.info.render_begin = clock_.now();

    const FrameInfo& info = frame.info;
    assert(info.window_count == 1 && "one window so far");
    const Region window = info.windows[0].sensor;
    std::uint32_t number = frame_start_;
    bool complete = true;
    for (std::int32_t row = 0; row < info.height; row += settings_.band_rows, ++number) {
        // A buffer is free again when the band that used it last has gone through the detector.
        for (std::uint32_t done = done_.load(std::memory_order_acquire); number - done >= buffer_count;
             done = done_.load(std::memory_order_acquire))
            done_.wait(done, std::memory_order_acquire);

        const std::int32_t rows = std::min(settings_.band_rows, info.height - row);
        renderer::RenderRequest request;
        request.window = window;
        request.first_row = row;
        request.rows = rows;
        request.row_times = {plan_.rows.data() + row, static_cast<std::size_t>(rows)};
        request.frame_id = info.frame_id;
        const std::size_t floats =
            band_count_ * static_cast<std::size_t>(rows) * static_cast<std::size_t>(info.width);
        if (!renderer_.render(request, {buffers_[number % buffer_count].data(), floats}, cancel)) {
            complete = false;
            break;
        }
        if (row + rows == info.height) frame.info.render_end = clock_.now();
        posted_.store(number + 1); // sequentially consistent, see Frame::publish_rows()
        posted_.notify_one();
    }
    for (std::uint32_t done = done_.load(std::memory_order_acquire); done != number;
         done = done_.load(std::memory_order_acquire))
        done_.wait(done, std::memory_order_acquire);
    return complete;
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
        expose_band(number);
        done_.store(number + 1); // sequentially consistent, see Frame::publish_rows()
        done_.notify_one();
    }
}

void FrameMaker::expose_band(std::uint32_t number) noexcept {
    Frame& frame = *frame_;
    const std::int32_t first = static_cast<std::int32_t>(number - frame_start_) * settings_.band_rows;
    const std::int32_t rows = std::min(settings_.band_rows, plan_.height - first);
    const std::size_t width = static_cast<std::size_t>(plan_.width);
    const std::size_t pixels = static_cast<std::size_t>(rows) * width;
    const sensors::IrradianceBand light{
        first, rows, plan_.width, {buffers_[number % buffer_count].data(), band_count_ * pixels}};
    detector_.expose(plan_, light, frame.info.frame_id, {frame.info.gain_db, black_shift_dn_},
                     frame.pixels().subspan(static_cast<std::size_t>(first) * width, pixels));
    if (pattern_ != ImagePattern::off) paint_pattern(first, rows);
    if (first + rows == plan_.height) frame.info.detector_end = clock_.now();
    if (sink_ != nullptr)
        sink_->rows_exposed(first + rows);
    else
        frame.publish_rows(first + rows);
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
    const sensors::WindowRequest window{s.region, s.exposure_ns};
    sensors::ReadoutPlan plan;
    answer.refusal = plan_readout(readout_, {&window, 1}, Time{}, plan);
    if (!answer.refusal.empty()) return answer;
    answer.window_count = static_cast<std::uint32_t>(plan.windows.size());
    std::copy(plan.windows.begin(), plan.windows.end(), answer.windows.begin());
    answer.frame_period_ns = plan.frame_period_ns;
    answer.readout_ns = plan.readout_ns;
    return answer;
}

} // namespace obscura::emulator
