// SPDX-License-Identifier: Apache-2.0
#include "serve/render_call.hpp"

#include "core/camera/setting_table.hpp"
#include "core/error.hpp"
#include "core/io/memory_budget.hpp"
#include "core/text/printable.hpp"
#include "renderer/frame_times.hpp"
#include "renderer/lights/detector_response.hpp"
#include "renderer/world/scene_poses.hpp"
#include "sensors/sensor.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace obscura::serve {
namespace {

using nlohmann::json;
using service::Answer;
using service::Failure;
using service::FailureCode;

/// Rows that are rendered at a time, at least: progress is reported between them.
constexpr std::int32_t min_rows = 16;
/// Twice as many follow where they took less than this, up to this part of the picture.
constexpr std::chrono::milliseconds quick{20};
constexpr std::int32_t min_blocks = 16;

/// Lowers the priority of the calling thread, for good: what renders gives way to the thread that answers all
/// clients.
void give_way() {
    constexpr int nice = 10;
    thread_local const bool done = ::setpriority(PRIO_PROCESS, 0, nice) == 0;
    (void)done;
}

Failure bad_render_argument(const std::string& field, const std::string& what, const std::string& allowed) {
    return service::bad_argument(field, fmt::format("render: {}: {}, allowed {}", field, what, allowed),
                                 allowed);
}

json json_of(const Vec3& v) {
    return {v.x, v.y, v.z};
}
json json_of(const Pose& pose) {
    const Quat& q = pose.orientation;
    return {{"position_m", json_of(pose.position_m)}, {"orientation", {q.w, q.x, q.y, q.z}}};
}
json json_of(const renderer::BodyView& view) {
    json row = json_of(view.pose);
    row["range_m"] = view.range_m;
    row["phase_deg"] = view.phase_rad * 180 / std::numbers::pi;
    if (view.pixel) row["pixel"] = {view.pixel->x, view.pixel->y};
    return row;
}

/// Poses at the scene time, and where the centres of the bodies are in the whole sensor.
json truth_of(const scene::Scene& scene, double time_s) {
    const renderer::ScenePoses poses(scene);
    json bodies = json::array();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        bodies.push_back(json_of(poses.body(i, time_s)));
        bodies.back()["name"] = scene.bodies[i].name;
    }
    return {{"camera", json_of(poses.camera(time_s))},
            {"sun", json_of(poses.sun(time_s))},
            {"bodies", std::move(bodies)}};
}

/// The names of an array of AOVs, as indices.
std::vector<std::size_t> aovs_of(const json& layers) {
    std::vector<std::string> known;
    for (std::size_t k = 0; k < renderer::aov_count; ++k)
        known.emplace_back(renderer::aov_name(static_cast<renderer::Aov>(k)));
    const std::string allowed = fmt::format("an array of {}", fmt::join(known, ", "));
    if (layers.is_null()) return {};
    if (!layers.is_array()) throw bad_render_argument("layers", "no array", allowed);
    std::vector<std::size_t> chosen;
    for (const json& layer : layers) {
        const std::string name = layer.is_string() ? layer.get<std::string>() : "no name";
        const auto at = std::find(known.begin(), known.end(), name);
        if (at == known.end())
            throw bad_render_argument("layers", fmt::format("\"{}\" is not known", printable(name, 60)),
                                      allowed);
        chosen.push_back(static_cast<std::size_t>(at - known.begin()));
    }
    return chosen;
}

/// The part of the picture that a request wants; none: the whole.
std::optional<Region> window_of(const std::array<double, 4>& numbers, const scene::Camera& camera) {
    if (std::all_of(numbers.begin(), numbers.end(), [](double v) { return v == 0; })) return {};
    const auto whole = [&](std::size_t i) { return static_cast<std::int32_t>(numbers[i]); };
    const Region part{whole(0), whole(1), whole(2), whole(3)};
    if (part.inside({0, 0, camera.width, camera.height})) return part;
    throw bad_render_argument(
        "window", "is not inside the picture",
        fmt::format("[x, y, width, height] within {} x {}", camera.width, camera.height));
}

/// Digital numbers of a frame.
service::Array array_of(const Frame& frame) {
    const std::span<const std::uint16_t> pixels = frame.pixels();
    return {"dn",
            {static_cast<std::size_t>(frame.info.height), static_cast<std::size_t>(frame.info.width)},
            std::vector<std::uint16_t>(pixels.begin(), pixels.end())};
}

/// What the readout made of the request.
json detector_facts(const Frame& frame, double mid_s) {
    const FrameWindow& window = frame.info.windows[0];
    const std::string flags = sensors::flag_names(frame.window_flags(0));
    return {{"bits", frame.info.bits_per_pixel},
            {"window", {window.sensor.x, window.sensor.y, window.sensor.width, window.sensor.height}},
            {"exposure_s", {to_seconds(window.exposure_min_ns), to_seconds(window.exposure_max_ns)}},
            {"mid_s", mid_s},
            {"flags", flags}};
}

} // namespace

struct RenderCall::Arguments { // NOLINT(bugprone-exception-escape): json does not throw when moved
    double time_s = 0, exposure_s = 0;
    std::int32_t width = 0, height = 0;
    std::array<double, 4> window{};
    renderer::RenderSettings settings;
    std::uint64_t frame = 1;
    bool truth = false;
    double gain_db = 0;
    std::uint32_t run = 0;
    service::Codec codec = service::Codec::none;
    json layers, sensor;
    std::uint32_t max_request_samples = 65536;

    service::Fields fields() {
        constexpr const Setting& gain = setting("Gain");
        const SettingRange gain_range = *widest_range(gain);
        return {
            {config::key("time_s", &time_s)
                 .unit("s")
                 .range(-1e9, 1e9)
                 .help(
                     "Scene time of mid-exposure; with a sensor, of the trigger, at which the first row begins to integrate"),
             config::key("exposure_s", &exposure_s)
                 .unit("s")
                 .range(0, 1e6)
                 .help("Exposure time; moving bodies and the moving camera blur. A sensor needs one"),
             config::key("width", &width)
                 .unit("px")
                 .range(0, 65536)
                 .help("Width of the picture, with the same horizontal field of view; 0: that of the scene"),
             config::key("height", &height)
                 .unit("px")
                 .range(0, 65536)
                 .help("Height of the picture, with width; 0: that of the scene"),
             config::key("window", config::Numbers{window.data(), window.size()})
                 .unit("px")
                 .range(0, 65536)
                 .help(
                     "Column and row of the upper left corner, width and height of the only part that is rendered; "
                     "all 0: the whole picture"),
             config::key("samples", &settings.samples_per_pixel)
                 .range(1, max_request_samples)
                 .help("Samples per pixel, taken where a body may cover the pixel"),
             config::key("error", &settings.target_error)
                 .range(0, 1)
                 .help(
                     "Adaptive sampling: relative standard error of a pixel to sample to; 0: samples everywhere"),
             config::key("max_samples", &settings.max_samples_per_pixel)
                 .range(1, max_request_samples)
                 .help("Largest number of samples per pixel, with error"),
             config::key("bounces", &settings.max_bounces)
                 .range(0, 1000)
                 .help("Reflections after the first (the scene's own number if that is larger)"),
             config::key("seed", &settings.seed).range(0, 9e15).help("Seed of the random numbers"),
             config::key("frame", &frame)
                 .range(1, 9e15)
                 .help("Number of the frame; frames of different numbers have different noise"),
             config::key("truth", &truth)
                 .help("Also tell the poses of camera and bodies, and where they are in the sensor"),
             config::key("gain_db", &gain_db)
                 .unit(gain.unit)
                 .range(gain_range.minimum, gain_range.maximum)
                 .help("With a sensor: analog gain"),
             config::key("run", &run)
                 .help("With a sensor: run word; frames of different ones have different temporal noise"),
             config::key("codec", &codec)
                 .help(
                     "How arrays are sent that become smaller by it: the bytes sorted by their place in the element and compressed")},
            {{"sensor", "string or map",
              "Expose the picture: a shipped sensor, a file below the server's folder, or the keys of [sensor]. "
              "It sets the camera's pixels and has the readout times and noise of the chip",
              &sensor},
             {"layers", "array of strings",
              "Further arrays, one value a pixel: body, range_m, depth_m, normal.x, ... as the layers of `obscura render`",
              &layers}}};
    }
};

/// What a renderer is made of.
struct RendererKey {
    std::uint64_t revision = 0; ///< of the scene
    std::int32_t width = 0, height = 0;
    double pixel_pitch_m = 0, pixel_pitch_y_m = 0;
    std::uint32_t samples = 0, max_samples = 0, bounces = 0;
    double error = 0;
    std::uint64_t seed = 0;
    std::vector<SpectralPoint> efficiency; ///< of the sensor; empty: none

    bool operator==(const RendererKey&) const = default;
};

struct RenderCall::Made {
    RendererKey key;
    renderer::Renderer renderer;
};

RenderCall::RenderCall(const SceneCalls& scene, const PictureLimits& limits)
    : scene_(scene), limits_(limits), detector_(scene) {}
RenderCall::~RenderCall() = default;

scene::Camera RenderCall::camera(const Arguments& a) {
    scene::Camera camera = scene_.document().scene().camera;
    if ((a.width > 0) != (a.height > 0))
        throw bad_render_argument(a.width > 0 ? "height" : "width", "is missing", "both, or none");
    if (!a.sensor.is_null()) {
        if (a.width > 0)
            throw bad_render_argument("width", "is that of the sensor", "no size beside a sensor");
        if (a.exposure_s <= 0) throw bad_render_argument("exposure_s", "0 with a sensor", "more than 0");
        const SensorDescription& sensor = detector_.read(a.sensor);
        if (sensor.readout.shutter == Shutter::push_broom && !a.layers.is_null())
            throw bad_render_argument("layers", "given with a push-broom sensor", "none with such a one");
        camera.width = sensor.readout.width, camera.height = sensor.readout.height;
        camera.pixel_pitch_m = sensor.pixel_pitch_m, camera.pixel_pitch_y_m = sensor.pixel_pitch_y_m;
    } else if (a.width > 0) {
        const double larger = static_cast<double>(camera.width) / a.width;
        camera.pixel_pitch_m *= larger, camera.pixel_pitch_y_m *= larger;
        camera.width = a.width, camera.height = a.height;
    }
    if (static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height) > limits_.pixels)
        throw Failure(FailureCode::too_large, fmt::format("render: {} x {} pixels, allowed {} in all",
                                                          camera.width, camera.height, limits_.pixels));
    return camera;
}

const renderer::Renderer& RenderCall::renderer(const Arguments& a, const scene::Camera& camera) {
    const RendererKey key{scene_.document().revision(),
                          camera.width,
                          camera.height,
                          camera.pixel_pitch_m,
                          camera.pixel_pitch_y_m,
                          a.settings.samples_per_pixel,
                          a.settings.max_samples_per_pixel,
                          a.settings.max_bounces,
                          a.settings.target_error,
                          a.settings.seed,
                          a.sensor.is_null() ? std::vector<SpectralPoint>()
                                             : detector_.sensor().detector.quantum_efficiency};
    if (made_ && made_->key == key) return made_->renderer;
    made_.reset(); // two at a time might be more than the memory holds
    renderer::RenderSettings settings = a.settings;
    settings.threads = limits_.threads;
    settings.enter_worker = give_way;
    settings.shapes = shapes_;
    scene_.check_scene([&] {
        scene::Scene scene = scene_.document().scene();
        scene.camera = camera;
        if (!key.efficiency.empty()) renderer::set_detector_response(scene, key.efficiency);
        made_ = std::make_unique<Made>(Made{key, renderer::Renderer(std::move(scene), settings)});
    });
    return made_->renderer;
}

/// Rows of a picture that are rendered, a block at a time.
struct RenderCall::Rows {
    Region window;
    std::vector<RowTime> times;
    std::optional<Time> common_mid;
    renderer::PixelTimes pixel_times;
    std::uint64_t frame = 1;
    bool lines = false;                ///< all are the first row of the camera
    std::uint64_t done = 0, total = 0; ///< rows of all that the call makes, those before these

    [[nodiscard]] std::size_t pixels() const { return static_cast<std::size_t>(window.area()); }
    /// Place of the first pixel of a row.
    [[nodiscard]] std::size_t at(std::int32_t row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(window.width);
    }

    /// Calls `render` with the request of each block; `work` is told.
    template<typename Render>
    void each_block(service::Work& work, const Render& render) const {
        using Clock = std::chrono::steady_clock;
        Clock::time_point begun = Clock::now();
        const std::int32_t max_chunk_rows = std::max(min_rows, window.height / min_blocks);
        for (std::int32_t y = 0, rows = min_rows; y < window.height;) {
            work.progress(done + static_cast<std::uint64_t>(y), total);
            renderer::RenderRequest request;
            request.window = window;
            request.first_row = y;
            request.rows = std::min(rows, window.height - y);
            request.row_times =
                std::span(times).subspan(static_cast<std::size_t>(y), static_cast<std::size_t>(request.rows));
            request.common_mid = common_mid;
            request.pixel_times = pixel_times;
            if (lines) {
                request.window.height = 1;
                request.first_row = 0;
                request.line = y;
            }
            request.frame_id = frame;
            if (work.cancelled() || !render(request)) throw service::cancelled();
            y += request.rows;
            const Clock::time_point now = Clock::now();
            rows = now - std::exchange(begun, now) < quick ? std::min(2 * rows, max_chunk_rows) : min_rows;
        }
    }
};

service::Array RenderCall::light(const renderer::Renderer& renderer, const Rows& rows, service::Work& work) {
    const std::size_t bands = renderer.band_count();
    service::Array array{
        std::string(name_of(renderer.scene().quantity)),
        {bands, static_cast<std::size_t>(rows.window.height), static_cast<std::size_t>(rows.window.width)},
        std::vector<float>(bands * rows.pixels())};
    rows.each_block(work, [&](renderer::RenderRequest& request) {
        request.plane_rows = rows.window.height;
        return renderer.render(
            request, std::span(array.floats()).subspan(rows.at(request.line.value_or(request.first_row))),
            &work.cancelled());
    });
    return array;
}

void RenderCall::add_layers(const renderer::Renderer& renderer, Rows rows,
                            const std::vector<std::size_t>& aovs, std::vector<service::Array>& arrays,
                            service::Work& work) {
    if (aovs.empty()) return;
    const std::size_t first = arrays.size();
    for (const std::size_t k : aovs)
        arrays.push_back(
            {renderer::aov_name(static_cast<renderer::Aov>(k)),
             {static_cast<std::size_t>(rows.window.height), static_cast<std::size_t>(rows.window.width)},
             std::vector<float>(rows.pixels())});
    for (RowTime& time : rows.times)
        time = {time.mid(), time.mid()};
    std::vector<float> block;
    rows.each_block(work, [&](const renderer::RenderRequest& request) {
        const std::size_t pixels = rows.at(request.rows);
        block.resize(pixels * renderer::aov_count);
        if (!renderer.render_aovs(request, block, &work.cancelled())) return false;
        for (std::size_t i = 0; i < aovs.size(); ++i)
            std::copy_n(block.data() + aovs[i] * pixels, pixels,
                        arrays[first + i].floats().data() + rows.at(request.first_row));
        return true;
    });
}

const renderer::Renderer& RenderCall::current() {
    Arguments arguments;
    if (made_) {
        renderer::RenderSettings& settings = arguments.settings;
        settings.samples_per_pixel = made_->key.samples;
        settings.max_samples_per_pixel = made_->key.max_samples;
        settings.max_bounces = made_->key.bounces;
        settings.target_error = made_->key.error;
        settings.seed = made_->key.seed;
    }
    return renderer(arguments, camera(arguments));
}

service::Answer RenderCall::run(const Arguments& arguments, service::Work& work) {
    give_way();
    const auto begin = std::chrono::steady_clock::now();
    const std::vector<std::size_t> aovs = aovs_of(arguments.layers);
    const scene::Camera camera = this->camera(arguments);
    const std::optional<Region> window = window_of(arguments.window, camera);
    const Time when{std::llround(arguments.time_s * 1e9)};
    const std::int64_t exposure_ns = std::llround(arguments.exposure_s * 1e9);
    Rows rows{window.value_or(Region{0, 0, camera.width, camera.height}), {}, {}, {}, arguments.frame};
    if (!lines_.empty()) rows.window = {0, 0, camera.width, static_cast<std::int32_t>(lines_.size())};
    const auto height = static_cast<std::uint64_t>(rows.window.height);
    rows.total = aovs.empty() ? height : 2 * height;
    const renderer::Renderer& renderer = this->renderer(arguments, camera);
    const std::uint64_t bytes = rows.pixels() * (renderer.band_count() + aovs.size()) * sizeof(float);
    work.reserve(bytes);
    try {
        require_memory(bytes, "picture");
    } catch (const InputError& error) {
        throw Failure(FailureCode::too_large, error.what());
    }

    Answer answer;
    json& head = answer.head;
    const scene::Scene& scene = renderer.scene();
    double shown_s = arguments.time_s;
    if (arguments.sensor.is_null()) {
        const std::int64_t half_ns = std::llround(arguments.exposure_s * 0.5e9);
        rows.times.assign(static_cast<std::size_t>(rows.window.height), {when - half_ns, when + half_ns});
        for (std::size_t i = 0; i < rows.times.size(); ++i) {
            const std::int64_t late_ns = line_ns_ * (rows.window.y + static_cast<std::int64_t>(i));
            rows.times[i] = {rows.times[i].reset + late_ns, rows.times[i].read + late_ns};
        }
        if (line_ns_ == 0) rows.common_mid = when;
        if (!lines_.empty()) {
            rows.times.assign(lines_.begin(), lines_.end());
            rows.common_mid.reset();
            rows.lines = true;
        }
        if (scene.camera.timing != nullptr) {
            renderer::FrameTimes times;
            scene_.check_scene([&] {
                times = renderer::frame_times(scene.camera, rows.window, {when - half_ns, when + half_ns});
            });
            rows.times = std::move(times.rows);
            rows.common_mid = times.common_mid;
            rows.pixel_times = times.pixels;
        }
        answer.arrays.push_back(light(renderer, rows, work));
        head["unit"] = scene.quantity == scene::Quantity::radiance ? "W m-2 sr-1" : "W m-2";
    } else {
        const ExposedFrame exposed =
            detector_.expose(renderer,
                             {when, exposure_ns, arguments.gain_db, window, arguments.settings.seed,
                              arguments.frame, arguments.run},
                             work);
        rows.window = exposed.frame->info.windows[0].sensor;
        rows.times = exposed.rows;
        shown_s = to_seconds(exposed.mid().ns);
        answer.arrays.push_back(array_of(*exposed.frame));
        head["unit"] = "DN";
        head["detector"] = detector_facts(*exposed.frame, shown_s);
    }
    rows.done = height;
    add_layers(renderer, std::move(rows), aovs, answer.arrays, work);
    head["time_s"] = arguments.time_s;
    for (const SpectralBand& band : scene.bands)
        head["bands_nm"].push_back({band.from_m * 1e9, band.to_m * 1e9});
    if (arguments.truth) head["truth"] = truth_of(scene, shown_s);
    for (service::Array& array : answer.arrays)
        encode(array, arguments.codec);
    head["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return answer;
}

service::Call RenderCall::call() {
    service::Call made = service::call<Arguments>(
        "render", service::Permission::scene,
        "Renders the scene: irradiance per pixel and spectral band, the same bytes as `obscura render` with the same settings; "
        "or, with a sensor, its digital numbers, as `obscura capture` makes them.",
        [this](const Arguments& arguments, service::Work& work) { return run(arguments, work); });
    made.results = {
        {"irradiance", "array float32 [bands, height, width]", "W m-2",
         "Irradiance at the entrance pupil from each pixel, first row on top; "
         "called \"radiance\" if the scene's quantity is"},
        {"dn", "array uint16 [height, width]", "DN", "With a sensor, instead: digital numbers"},
        {"unit", "string", "", "Unit of that array"},
        {"bands_nm", "array of [from, to]", "nm", "Spectral bands"},
        {"time_s", "number", "s", "Scene time"},
        {"seconds", "number", "s", "Time that the call took"},
        {"detector", "map", "",
         "With a sensor: bits of its ADC, window that was read (x, y, width, height), exposure_s obtained (shortest and longest of the rows), mid_s of the exposure, flags of the readout separated by '|'"},
        {"truth", "map", "",
         "With truth: camera, sun and bodies with position_m, orientation (w, x, y, z), range_m, phase_deg, pixel (column, row; "
         "missing: behind the lens)"}};
    return made;
}

} // namespace obscura::serve
