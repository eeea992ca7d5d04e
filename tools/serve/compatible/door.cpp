// SPDX-License-Identifier: Apache-2.0
#include "tools/serve/compatible/door.hpp"

#include "core/memory_budget.hpp"
#include "service/failure.hpp"
#include "tools/serve/compatible/scene_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

namespace obscura::tools::compatible {

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

/// Folders and files beside the root that the scene may name.
std::vector<std::filesystem::path> folders_of(const DoorSettings& settings, const SessionFolder& own) {
    std::vector<std::filesystem::path> all = settings.resources.files();
    all.push_back(own.path());
    all.push_back(settings.output);
    return all;
}

} // namespace

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

Door::Door(const DoorSettings& settings)
    : files(settings.root, settings.output, settings.most_bytes, settings.resources),
      settings_(settings),
      scene_calls_(settings.root, folders_of(settings, own)),
      render_call_(scene_calls_, settings.limits) {
    reset();
}

void Door::reset() {
    camera = {};
    const std::int32_t compression = rendering.compression;
    rendering = {};
    rendering.compression = compression;
    sun_power_w_sr.fill(std::numbers::pi * au_m * au_m);
    background = {};
    objects.clear();
    aliases.clear();
    shapes.clear();
    reflections.clear();
    textures.clear();
    remembered.clear();
    picture.reset();
    Object seeing{Object::Kind::camera};
    seeing.placement.attitude = half_turn; // along -z, y up
    objects.emplace("camera", seeing);
    Object sun{Object::Kind::sun};
    sun.placement.position_m = {0, 0, au_m};
    objects.emplace("sun", sun);
}

Object* Door::find(std::string_view name) {
    const auto alias = aliases.find(std::string(name));
    const auto found = objects.find(alias != aliases.end() ? alias->second : std::string(name));
    return found != objects.end() ? &found->second : nullptr;
}

Object& Door::object(std::string_view name, std::string_view call) {
    if (Object* const found = find(name)) return *found;
    std::string known;
    for (const auto& [other, object] : objects)
        if (known.size() < 200) known += (known.empty() ? "" : ", ") + other;
    throw service::bad_argument("object_name",
                                fmt::format("{}: no object is called \"{}\", there are {}", call,
                                            config::printable(name, 60), config::printable(known, 260)));
}

json Door::scene() {
    return scene_tables(*this);
}

void Door::load_scene(service::Work& work) {
    json tree = scene();
    if (tree == loaded_) return;
    loaded_ = nullptr;
    const service::Calls calls = scene_calls_.calls();
    (void)service::bind(service::find_call(calls, "scene.load"), {{"call", "scene.load"}, {"scene", tree}})
        .run(work);
    loaded_ = std::move(tree);
}

void Door::render(service::Work& work) {
    picture.reset();
    const std::uint64_t pixels =
        static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
    if (pixels > limits().pixels)
        throw Failure(FailureCode::too_large, fmt::format("render: {} x {} pixels, allowed {} in all",
                                                          camera.width, camera.height, limits().pixels));
    load_scene(work);
    const double mid_s = camera.integration_s / 2;
    const json request{{"call", "render"},
                       {"time_s", mid_s},
                       {"exposure_s", camera.integration_s},
                       {"samples", rendering.samples}};
    service::Answer answer = service::bind(render_call_.call(), request).run(work);
    Picture made;
    made.width = camera.width;
    made.height = camera.height;
    made.values = std::move(answer.arrays.at(0).floats());
    GroundTruth truth;
    render_call_.current().fill_truth(Time{std::llround(mid_s * 1e9)}, truth);
    made.eye = truth.camera;
    made.fx_px = truth.intrinsics.focal_length_px[0];
    made.fy_px = truth.intrinsics.focal_length_px[1];
    made.mid_s = mid_s;
    made.los = rendering.los_mapping;
    made.time = rendering.time_mapping;
    picture = std::move(made);
}

std::vector<double> Door::intersect(const std::vector<renderer::Ray>& rays, service::Work& work) {
    // Of a scene that is about to be replaced, what the picture's maps need is kept.
    if (picture && scene() != loaded_) find_surfaces(work);
    load_scene(work);
    std::vector<double> distances(rays.size());
    const Time when{std::llround(camera.integration_s * 0.5e9)};
    if (!render_call_.current().intersect(when, rays, distances, &work.cancelled()))
        throw service::cancelled();
    return distances;
}

void Door::find_surfaces(service::Work& work) {
    if (!picture || !picture->range_m.empty()) return;
    Picture& p = *picture;
    const renderer::Renderer& renderer = render_call_.current();
    const Time when{std::llround(p.mid_s * 1e9)};
    const auto width = static_cast<std::size_t>(p.width);
    require_memory(p.pixels() * (sizeof(double) + 3 * sizeof(float)), "depth map");
    std::vector<double> ranges(p.pixels());
    for (std::vector<float>& plane : p.normal)
        plane.resize(p.pixels());
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
            for (std::int32_t column = 0; column < p.width; ++column)
                rays.push_back({p.eye.position_m, to_scene * p.ray(column, row)});
        renderer::RenderRequest request;
        request.window = {0, 0, p.width, p.height};
        request.first_row = first;
        request.rows = rows;
        request.row_times = std::span(instants).first(static_cast<std::size_t>(rows));
        aovs.resize(renderer::aov_count * count);
        if (!renderer.intersect(when, rays, std::span(ranges).subspan(begin, count), &work.cancelled()) ||
            !renderer.render_aovs(request, aovs, &work.cancelled()))
            throw service::cancelled();
        for (std::size_t k = 0; k < 3; ++k)
            std::copy_n(aovs.data() + (static_cast<std::size_t>(renderer::Aov::normal_x) + k) * count, count,
                        p.normal[k].data() + begin);
    }
    p.range_m = std::move(ranges);
}

} // namespace obscura::tools::compatible
