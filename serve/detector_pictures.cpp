// SPDX-License-Identifier: Apache-2.0
#include "serve/detector_pictures.hpp"

#include "config/shipped_files.hpp"
#include "core/clock.hpp"
#include "core/io/memory_budget.hpp"
#include "emulator/camera/frame_maker.hpp"
#include "models/values/model_values.hpp"
#include "sensors/sensor_file.hpp"
#include "service/failure.hpp"

#include <atomic>
#include <chrono>
#include <future>
#include <utility>

namespace obscura::serve {
namespace {

using service::bad_argument;

/// Tells how many rows have been exposed.
class RowCount final : public emulator::RowSink {
public:
    explicit RowCount(Frame& frame) : frame_(frame) {}
    void rows_exposed(std::int32_t rows) noexcept override {
        frame_.publish_rows(rows);
        rows_.store(rows, std::memory_order_relaxed);
    }
    [[nodiscard]] std::uint64_t rows() const noexcept {
        return static_cast<std::uint64_t>(rows_.load(std::memory_order_relaxed));
    }

private:
    Frame& frame_;
    std::atomic<std::int32_t> rows_{0};
};

emulator::FrameOrder order_of(const ExposureRequest& request, const SensorDescription& sensor) {
    emulator::FrameOrder order;
    order.frame_id = order.trigger_id = request.frame;
    order.trigger_edge = order.seen = order.scene_time = request.trigger;
    order.settings.region =
        request.window.value_or(Region{0, 0, sensor.readout.width, sensor.readout.height});
    order.settings.exposure_ns = request.exposure_ns;
    order.settings.gain_db = request.gain_db;
    order.settings.black_level_dn = sensor.detector.offset_dn;
    return order;
}

} // namespace

const SensorDescription& DetectorPictures::read(const nlohmann::json& field) {
    if (field == field_) return sensor_;
    if (!field.is_string() && !field.is_object())
        throw bad_argument("sensor", "sensor: allowed a name, or a map of the keys of [sensor]");
    SensorDescription sensor;
    scene_.check_scene([&] {
        if (field.is_string()) {
            sensor = sensors::load_sensor(scene_.file(config::shipped_sensors, field.get<std::string>()));
        } else {
            const auto file = field.find("file");
            // It is looked up as the section does it, once it is known to be allowed.
            if (file != field.end() && file->is_string())
                (void)scene_.file(config::shipped_sensors, file->get<std::string>());
            const config::Value table = service::value_of(field, "sensor");
            const config::Member* const model = table.find("model");
            const config::Member* const text = model == nullptr ? nullptr : model->value.find("model");
            if (text != nullptr && text->value.kind == config::Value::Kind::string)
                (void)scene_.file(models::shipped_models("sensor"), text->value.string);
            config::Mistakes mistakes;
            read_section(&table, table.at, {scene_.own_file(), "sensor"},
                         sensors::referring_section_of(sensor), mistakes);
            mistakes.throw_if_any();
        }
        const DetectorSettings& detector = sensor.detector;
        for (const std::string& map : {detector.response_map, detector.dark_map, detector.offset_map})
            if (!map.empty()) scene_.check_file(map, map);
        if (sensor.model.loaded != nullptr) {
            const std::string& file = sensor.model.loaded->model->name();
            scene_.check_file(file, file);
        }
    });
    made_.reset();
    sensor_ = std::move(sensor);
    field_ = field;
    return sensor_;
}

sensors::Detector& DetectorPictures::detector(const renderer::Renderer& renderer, std::uint64_t seed) {
    const std::uint64_t revision = scene_.document().revision();
    if (made_ && made_->revision == revision && made_->seed == seed) return made_->detector;
    made_.reset();
    scene_.check_scene([&] {
        const auto pixels = static_cast<std::uint64_t>(sensor_.readout.width) *
                            static_cast<std::uint64_t>(sensor_.readout.height);
        constexpr std::uint64_t bytes_a_pixel = 3 * sizeof(float); // response, dark current, offset
        require_memory(pixels * bytes_a_pixel, "detector");
        const scene::Scene& scene = renderer.scene();
        made_ = std::make_unique<Made>(
            Made{revision, seed, sensors::Detector(sensor_, scene.bands, scene.camera.aperture_m, seed)});
    });
    return made_->detector;
}

ExposedFrame DetectorPictures::expose(const renderer::Renderer& renderer, const ExposureRequest& request,
                                      service::Work& work) {
    sensors::Detector& detector = this->detector(renderer, request.seed);
    detector.begin_run(request.run);
    const emulator::FrameOrder order = order_of(request, sensor_);
    const Region& region = order.settings.region;
    const MonotonicClock clock;
    // A maker of its own: what was read out before does not delay this frame.
    emulator::FrameMaker maker(
        renderer, detector, sensor_, clock,
        {.max_rows = region.height, .seed = request.seed, .run = request.run, .same_run = true});
    ExposedFrame exposed;
    exposed.pool = std::make_unique<FramePool>(1, static_cast<std::size_t>(region.area()),
                                               static_cast<std::size_t>(region.height));
    exposed.frame = exposed.pool->acquire();
    if (const std::string refusal = maker.prepare(order, *exposed.frame); !refusal.empty())
        throw bad_argument("sensor", "sensor: " + refusal);
    exposed.rows.assign(maker.plan().rows.begin(), maker.plan().rows.end());
    RowCount rows(*exposed.frame);
    auto filled =
        std::async(std::launch::async, [&] { return maker.fill(*exposed.frame, &rows, &work.cancelled()); });
    const auto height = static_cast<std::uint64_t>(maker.plan().height);
    do
        work.progress(rows.rows(), height);
    while (filled.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready);
    if (!filled.get()) throw service::cancelled();
    return exposed;
}

} // namespace obscura::serve
