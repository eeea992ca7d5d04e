// SPDX-License-Identifier: Apache-2.0
// Commands that give the picture, its maps and intersections.
#include "core/io/memory_budget.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/packed_bytes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::serve::compatible {
namespace {

/// The last picture, of which there is memory for a form with so many bytes a pixel. Throws Failure without
/// one.
const Picture& picture_of(Request& r, std::size_t pixel_bytes) {
    if (!r.client_state.picture)
        throw Failure(FailureCode::bad_argument,
                      fmt::format("{}: there is no picture; render makes one", r.command.name));
    const std::size_t bytes = r.client_state.picture->pixels() * pixel_bytes;
    r.reply.share = r.client_state.hold(bytes);
    require_memory(bytes, "picture");
    return *r.client_state.picture;
}

void send(Request& r, std::int32_t width, std::int32_t height, std::string_view name, std::string data) {
    // Lengths of the protocol are of 32 bits, and clients take them for signed ones.
    constexpr std::size_t max_bytes = (std::size_t{1} << 31) - 1;
    const std::int32_t level = r.client_state.rendering.compression;
    if (data.size() > max_bytes)
        throw Failure(FailureCode::too_large,
                      fmt::format("{}: {} bytes, allowed {}", r.command.name, data.size(), max_bytes));
    r.reply.set("w", width);
    r.reply.set("h", height);
    r.reply.set("compressed", level > 0);
    r.reply.set_bytes(name, level > 0 ? deflate_packed(data, level) : std::move(data));
}

template<typename Form>
Handler image(Form form, std::size_t pixel_bytes) {
    return [=](Request& r) {
        const Picture& picture = picture_of(r, pixel_bytes);
        send(r, picture.width, picture.height, "image_data", form(picture));
    };
}

bool backward(const Request& r) {
    return r.client_state.conventions.camera == 0;
}

void send_spectrum(Request& r) {
    const Picture& picture = picture_of(r, sizeof(float));
    const std::vector<double> given = r.arguments.vector("spectrum", channels);
    Channels weights{};
    std::copy(given.begin(), given.end(), weights.begin());
    std::string data = weighted_float(picture, weights);
    if (r.client_state.rendering.compression > 0) data = byte_planes(data);
    send(r, picture.width, picture.height, "image_data", std::move(data));
}

/// A ray: 6 numbers, or an origin and a direction.
renderer::Ray ray_of(const Request& r, const Value& value) {
    std::vector<double> numbers;
    if (!to_numbers(value, numbers)) {
        const List* const pair = value.as<List>();
        std::vector<double> direction;
        if (pair == nullptr || pair->size() != 2 || !to_numbers((*pair)[0], numbers) ||
            !to_numbers((*pair)[1], direction))
            numbers.clear();
        else
            numbers.insert(numbers.end(), direction.begin(), direction.end());
    }
    if (numbers.size() != 6 ||
        !std::all_of(numbers.begin(), numbers.end(), [](double v) { return std::isfinite(v); }))
        throw r.arguments.refused("rays", "holds what is no ray",
                                  "rows of origin x, y, z and direction x, y, z");
    const Vec3 direction{numbers[3], numbers[4], numbers[5]};
    if (!(length(direction) > 0) || !std::isfinite(length(direction)))
        throw r.arguments.refused("rays", "holds a direction of length 0", "any other length");
    return {{numbers[0], numbers[1], numbers[2]}, direction};
}

void intersect(Request& r) {
    const List* const rows = r.arguments.value("rays").as<List>();
    std::vector<double> flat;
    std::vector<renderer::Ray> rays;
    if (rows == nullptr) throw r.arguments.refused("rays", "is no list", "a list of rays");
    if (rows->size() == 6 && to_numbers(r.arguments.value("rays"), flat))
        rays.push_back(ray_of(r, r.arguments.value("rays")));
    else
        for (const Value& row : *rows)
            rays.push_back(ray_of(r, row));
    const std::vector<double> distances = r.client_state.intersect(rays, r.work);
    r.reply.set("distance_to_hit", List(distances.begin(), distances.end()));
}

} // namespace

void add_output_calls(Handlers& handlers) {
    handlers["getImage"] = image(as_float, channels * sizeof(float));
    handlers["getImageRGBA8"] = image(as_bytes, channels);
    handlers["getImageGray32F"] = image(gray_float, sizeof(float));
    handlers["getImageGray8"] = image(gray_bytes, 1);
    handlers["getImageSpectrumProjection"] = send_spectrum;
    handlers["getDepthMap"] = [](Request& r) {
        (void)picture_of(r, sizeof(double));
        r.client_state.find_surfaces(r.work);
        send(r, r.client_state.picture->width, r.client_state.picture->height, "depth_data",
             depth_map(*r.client_state.picture));
    };
    handlers["getNormalMap"] = [](Request& r) {
        (void)picture_of(r, 3 * sizeof(float));
        r.client_state.find_surfaces(r.work);
        send(r, r.client_state.picture->width, r.client_state.picture->height, "normal_data",
             normal_map(*r.client_state.picture, backward(r)));
    };
    handlers["getLOSMap"] = [](Request& r) {
        const Picture& p = picture_of(r, 3 * sizeof(float));
        send(r, p.los ? p.width : 0, p.los ? p.height : 0, "los_data",
             p.los ? los_map(p, backward(r)) : std::string());
    };
    handlers["getTimeMap"] = [](Request& r) {
        const Picture& p = picture_of(r, sizeof(float));
        send(r, p.time ? p.width : 0, p.time ? p.height : 0, "time_data",
             p.time ? time_map(p) : std::string());
    };
    handlers["intersectScene"] = intersect;
}

} // namespace obscura::serve::compatible
