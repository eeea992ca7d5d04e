// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/client_state.hpp"

#include "core/io/memory_budget.hpp"
#include "core/text/printable.hpp"
#include "serve/compatible/scene_tables.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

namespace obscura::serve::compatible {

using nlohmann::json;
using service::Failure;
using service::FailureCode;

namespace {

/// Turns vectors of a camera that looks along +z, y down, into one that looks along -z, y up; its own inverse
/// but for the sign.
constexpr Quat half_turn{0, 1, 0, 0};

/// Rows whose surfaces are found at a time.
constexpr std::int32_t block_rows = 64;

bool looks_somewhere(Object::Kind kind) {
    return kind == Object::Kind::camera || kind == Object::Kind::light;
}

using PupilPoint = std::array<double, 2>;

/// Points of the pupil through which the picture is rendered, each with an equal share of its light: one in
/// the middle where all is sharp, else as the seeds of a sunflower lie (Vogel 1979), about their mean.
std::vector<PupilPoint> pupil_points(const CameraSettings& camera, std::uint32_t samples) {
    if (!(camera.focus_m > 0)) return {PupilPoint{}};
    if (camera.lens != PictureLens{})
        throw service::bad_argument(
            "focus_plane_Z",
            "render: defocus (setFocus) beside another projection than a pinhole without distortion, allowed one of the two");
    const std::uint32_t count = std::clamp(samples, 16U, 64U);
    const double golden_rad = std::numbers::pi * (3 - std::sqrt(5.0));
    std::vector<PupilPoint> points;
    PupilPoint mean{};
    for (std::uint32_t i = 0; i < count; ++i) {
        const double r = camera.pupil_radius_m * std::sqrt((i + 0.5) / count);
        points.push_back({r * std::cos(golden_rad * i), r * std::sin(golden_rad * i)});
        for (std::size_t k = 0; k < mean.size(); ++k)
            mean[k] += points.back()[k] / count;
    }
    for (PupilPoint& point : points)
        point = {point[0] - mean[0], point[1] - mean[1]};
    return points;
}

/// Sets the point of the pupil, back to the middle at the end.
class AtPoint {
public:
    AtPoint(CameraSettings& camera, const PupilPoint& point) : camera_(camera) {
        camera_.pupil_point_m = point;
    }
    ~AtPoint() { camera_.pupil_point_m = {}; }
    AtPoint(const AtPoint&) = delete;
    AtPoint& operator=(const AtPoint&) = delete;

private:
    CameraSettings& camera_;
};

/// Adds planes of a window to the picture.
void add(const std::vector<float>& planes, float share, const Region& window, Picture& picture) {
    const auto width = static_cast<std::size_t>(window.width);
    const auto height = static_cast<std::size_t>(window.height);
    for (std::size_t row = 0; row < height * channels; ++row) {
        const std::size_t y = static_cast<std::size_t>(window.y) + row % height;
        float* const out = picture.values.data() + row / height * picture.pixels() +
                           y * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(window.x);
        for (std::size_t x = 0; x < width; ++x)
            out[x] += share * planes[row * width + x];
    }
}

/// Folders and files beside the root that the scene may name.
std::vector<std::filesystem::path> folders_of(const CompatibleSettings& settings, const SessionFolder& own) {
    std::vector<std::filesystem::path> all = settings.resources.files();
    all.push_back(own.path());
    all.push_back(settings.output);
    return all;
}

} // namespace

models::TimedFrame CameraSettings::timed_frame() const {
    return {height, width, std::max<std::int64_t>(std::llround(integration_s * 1e9), 1)};
}

double CameraSettings::exposure_s() const {
    if (timing == nullptr) return integration_s + line_s * (height - 1);
    const models::TimedFrame frame = timed_frame();
    if (latest_.timing != timing || latest_.frame != frame) {
        latest_ = {timing, frame, 0};
        models::TimedRow row;
        for (std::int32_t y = 0; y < height; ++y) {
            timing->sum_up(frame, y, row);
            latest_.read_s = std::max(latest_.read_s, to_seconds(row.last_read.ns));
        }
    }
    return latest_.read_s;
}

service::compatible::List quaternion_of(const Object& object, const Conventions& conventions) {
    Quat q = object.placement.attitude;
    if (looks_somewhere(object.kind) && conventions.camera == 0) q = q * conjugate(half_turn);
    if (conventions.quaternion == 0) return {q.x, q.y, q.z, q.w};
    return {q.w, q.x, q.y, q.z};
}

Quat attitude_of(const std::vector<double>& n, Object::Kind kind, const Conventions& conventions) {
    const Quat given = conventions.quaternion == 0 ? Quat{n.at(3), n.at(0), n.at(1), n.at(2)}
                                                   : Quat{n.at(0), n.at(1), n.at(2), n.at(3)};
    const double length = norm(given);
    if (!(length > 0) || !std::isfinite(length))
        throw Failure(FailureCode::bad_argument, "a quaternion of length 0, or not finite");
    Quat q{given.w / length, given.x / length, given.y / length, given.z / length};
    if (looks_somewhere(kind) && conventions.camera == 0) q = q * half_turn;
    return q;
}

Pose element_of(const Pose& given, Object::Kind kind, const Conventions& conventions) {
    if (!looks_somewhere(kind) || conventions.camera != 0) return given;
    return {rotate(conjugate(half_turn), given.position_m),
            conjugate(half_turn) * given.orientation * half_turn};
}

ClientState::ClientState(const CompatibleSettings& settings, service::MemoryAccount& memory)
    : files(settings.root, settings.output, settings.max_bytes, settings.resources),
      own(settings.scene_bytes),
      settings_(settings),
      memory_(memory),
      scene_calls_(settings.root, folders_of(settings, own)),
      render_call_(scene_calls_, settings.limits) {
    reset();
}

Placement ClientState::inherited_placement(std::string_view name) {
    const Object* const before = find(name);
    if (before == nullptr) return {};
    Placement placement = before->placement;
    placement.element = {};
    return placement;
}

void ClientState::reset() {
    camera = {};
    const std::int32_t compression = rendering.compression;
    rendering = {};
    rendering.compression = compression;
    sun_power_w_sr.fill(std::numbers::pi * au_m * au_m);
    background = {};
    bands = usual_bands;
    objects.clear();
    aliases.clear();
    shapes.clear();
    reflections.clear();
    textures.clear();
    remembered.clear();
    picture.reset();
    own.clear();
    Object seeing{Object::Kind::camera};
    seeing.placement.attitude = half_turn; // along -z, y up
    objects.emplace("camera", seeing);
    Object sun{Object::Kind::sun};
    sun.placement.position_m = {0, 0, au_m};
    objects.emplace("sun", sun);
}

Object* ClientState::find(std::string_view name) {
    const auto alias = aliases.find(std::string(name));
    const auto found = objects.find(alias != aliases.end() ? alias->second : std::string(name));
    return found != objects.end() ? &found->second : nullptr;
}

Object& ClientState::object(std::string_view name, std::string_view call) {
    if (Object* const found = find(name)) return *found;
    std::string known;
    for (const auto& [other, object] : objects)
        if (known.size() < 200) known += (known.empty() ? "" : ", ") + other;
    throw service::bad_argument("object_name", fmt::format("{}: no object is called \"{}\", there are {}",
                                                           call, printable(name, 60), printable(known, 260)));
}

json ClientState::scene() {
    return scene_tables(*this);
}

void ClientState::load_scene(service::Work& work) {
    json tree = scene();
    if (tree == loaded_) return;
    loaded_ = nullptr;
    const service::Calls calls = scene_calls_.calls();
    (void)service::bind(service::find_call(calls, "scene.load"), {{"call", "scene.load"}, {"scene", tree}})
        .run(work);
    loaded_ = std::move(tree);
}

void ClientState::render(service::Work& work) {
    render({Region{0, 0, camera.width, camera.height}}, work);
}

void ClientState::render(const std::vector<Region>& windows, service::Work& work) {
    picture.reset();
    Picture made;
    made.width = camera.width;
    made.height = camera.height;
    if (made.pixels() > limits().pixels)
        throw Failure(FailureCode::too_large, fmt::format("render: {} x {} pixels, allowed {} in all",
                                                          camera.width, camera.height, limits().pixels));
    made.share = hold(made.pixels() * channels * sizeof(float));
    made.values.resize(made.pixels() * channels);
    const bool scans = rendering.scanning_device;
    service::MemoryAccount::Share times_share;
    if (scans || camera.timing != nullptr) {
        times_share = hold(made.pixels() * sizeof(RowTime));
        made.times = pixel_times();
    }
    const std::vector<PupilPoint> pupil = pupil_points(camera, rendering.samples);
    const auto count = static_cast<std::uint32_t>(pupil.size());
    for (std::uint32_t i = 0; i < count; ++i) {
        const AtPoint here(camera, pupil[i]);
        load_scene(work);
        for (const Region& window : windows)
            add(scans ? scanned_light(made, window, std::max(1U, rendering.samples / count), i + 1, work)
                      : light_of(window, std::max(1U, rendering.samples / count), i + 1, work),
                1 / static_cast<float>(count), window, made);
    }
    load_scene(work); // through the middle of the pupil
    const double mid_s = camera.exposure_s() / 2;
    GroundTruth truth;
    render_call_.current().fill_truth(Time{std::llround(mid_s * 1e9)}, truth);
    made.eye = truth.camera;
    made.fx_px = truth.intrinsics.focal_length_px[0];
    made.fy_px = truth.intrinsics.focal_length_px[1];
    made.lens = camera.lens;
    made.mid_s = mid_s;
    made.line_s = camera.line_s;
    made.los = rendering.los_mapping;
    made.time = rendering.time_mapping;
    made.scanned = scans;
    if (!scans && !made.time) made.times = {};
    made.times_share = std::move(times_share);
    picture = std::move(made);
}

std::vector<RowTime> ClientState::pixel_times() const {
    const auto width = static_cast<std::size_t>(camera.width);
    std::vector<RowTime> times(width * static_cast<std::size_t>(camera.height));
    const models::TimedFrame frame = camera.timed_frame();
    for (std::int32_t row = 0; row < camera.height; ++row) {
        const std::span pixels = std::span(times).subspan(static_cast<std::size_t>(row) * width, width);
        if (camera.timing == nullptr) {
            const Time reset{std::llround(camera.line_s * 1e9 * row)};
            std::fill(pixels.begin(), pixels.end(), RowTime{reset, reset + frame.exposure_ns});
        } else if (const auto bad = camera.timing->fill_pixels(frame, row, 0, pixels)) {
            throw service::bad_argument("filename",
                                        "render: " + files.without_folders(camera.timing->explain(*bad)));
        }
    }
    return times;
}

std::vector<float> ClientState::scanned_light(const Picture& made, const Region& window,
                                              std::uint32_t samples, std::uint64_t frame,
                                              service::Work& work) {
    std::vector<RowTime> lines;
    for (std::int32_t row = window.y; row < window.y + window.height; ++row) {
        const auto begin = made.times.begin() + std::ptrdiff_t{row} * made.width + window.x;
        lines.insert(lines.end(), begin, begin + window.width);
    }
    render_call_.set_lines(lines);
    struct Back {
        RenderCall& call;
        ~Back() { call.set_lines({}); }
    } const back{render_call_};
    return light_of({0, 0, 1, 1}, samples, frame, work);
}

std::vector<float> ClientState::light_of(const Region& window, std::uint32_t samples, std::uint64_t frame,
                                         service::Work& work) {
    const json request{{"call", "render"},
                       {"time_s", camera.integration_s / 2},
                       {"exposure_s", camera.integration_s},
                       {"window", {window.x, window.y, window.width, window.height}},
                       {"samples", samples},
                       {"frame", frame}};
    render_call_.set_line_time(std::llround(camera.line_s * 1e9));
    return std::move(service::bind(render_call_.call(), request).run(work).arrays.at(0).floats());
}

std::vector<double> ClientState::intersect(const std::vector<renderer::Ray>& rays, service::Work& work) {
    // Before the scene is replaced, what the maps of its picture need is computed.
    if (picture && scene() != loaded_) find_surfaces(work);
    load_scene(work);
    std::vector<double> distances(rays.size());
    const Time when{std::llround(camera.exposure_s() * 0.5e9)};
    if (!render_call_.current().intersect(when, rays, distances, &work.cancelled()))
        throw service::cancelled();
    return distances;
}

void ClientState::find_scanned_surfaces(service::Work& work) {
    Picture& p = *picture;
    const renderer::Renderer& renderer = render_call_.current();
    std::vector<float> aovs(renderer::aov_count);
    std::vector<double> ranges(p.pixels());
    GroundTruth truth;
    for (std::size_t i = 0; i < p.pixels(); ++i) {
        const Time mid = p.times[i].mid();
        const RowTime instant{mid, mid};
        renderer.fill_truth(mid, truth);
        const renderer::Ray ray{truth.camera.position_m, to_matrix(truth.camera.orientation) * p.ray(0, 0)};
        renderer::RenderRequest request;
        request.window = {0, 0, 1, 1};
        request.rows = 1;
        request.row_times = {&instant, 1};
        if (!renderer.intersect(mid, {&ray, 1}, {&ranges[i], 1}, &work.cancelled()) ||
            !renderer.render_aovs(request, aovs, &work.cancelled()))
            throw service::cancelled();
        // In axes in which the camera of the whole picture sees it as the camera of that time.
        const auto normal = [&](std::size_t k) {
            return static_cast<double>(aovs[static_cast<std::size_t>(renderer::Aov::normal_x) + k]);
        };
        const Vec3 turned = rotate(p.eye.orientation * conjugate(truth.camera.orientation),
                                   {normal(0), normal(1), normal(2)});
        for (const auto& [k, value] : {std::pair{0, turned.x}, {1, turned.y}, {2, turned.z}})
            p.normal[static_cast<std::size_t>(k)][i] = static_cast<float>(value);
    }
    p.range_m = std::move(ranges);
}

void ClientState::find_surfaces(service::Work& work) {
    if (!picture || !picture->range_m.empty()) return;
    Picture& p = *picture;
    const renderer::Renderer& renderer = render_call_.current();
    const Time when{std::llround(p.mid_s * 1e9)};
    const auto width = static_cast<std::size_t>(p.width);
    const std::uint64_t bytes = p.pixels() * (sizeof(double) + 3 * sizeof(float));
    service::MemoryAccount::Share share = hold(bytes);
    require_memory(bytes, "depth map");
    std::vector<double> ranges(p.pixels());
    for (std::vector<float>& plane : p.normal)
        plane.resize(p.pixels());
    if (p.scanned) {
        find_scanned_surfaces(work);
        p.surfaces_share = std::move(share);
        return;
    }
    const Mat3 to_scene = to_matrix(p.eye.orientation);
    const std::vector<RowTime> instants(block_rows, RowTime{when, when});
    std::vector<renderer::Ray> rays;
    std::vector<float> aovs;
    for (std::int32_t first = 0; first < p.height; first += block_rows) {
        const std::int32_t rows = std::min(block_rows, p.height - first);
        const std::size_t begin = static_cast<std::size_t>(first) * width;
        const std::size_t count = static_cast<std::size_t>(rows) * width;
        rays.clear();
        for (std::int32_t row = first; row < first + rows; ++row)
            for (std::int32_t column = 0; column < p.width; ++column) {
                const Vec3 ray = p.ray(column, row);
                rays.push_back({p.eye.position_m, to_scene * (ray == Vec3{} ? Vec3{0, 0, 1} : ray)});
            }
        renderer::RenderRequest request;
        request.window = {0, 0, p.width, p.height};
        request.first_row = first;
        request.rows = rows;
        request.row_times = std::span(instants).first(static_cast<std::size_t>(rows));
        aovs.resize(renderer::aov_count * count);
        if (!renderer.intersect(when, rays, std::span(ranges).subspan(begin, count), &work.cancelled()) ||
            !renderer.render_aovs(request, aovs, &work.cancelled()))
            throw service::cancelled();
        for (std::size_t i = 0; i < count; ++i)
            if (p.ray(static_cast<std::int32_t>(i % width), first + static_cast<std::int32_t>(i / width)) ==
                Vec3{})
                ranges[begin + i] = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < 3; ++k)
            std::copy_n(aovs.data() + (static_cast<std::size_t>(renderer::Aov::normal_x) + k) * count, count,
                        p.normal[k].data() + begin);
    }
    p.range_m = std::move(ranges);
    p.surfaces_share = std::move(share);
}

} // namespace obscura::serve::compatible
