// SPDX-License-Identifier: Apache-2.0
// Scenes and whole-frame rendering for the renderer's tests.
#pragma once

#include "core/camera/scene_truth.hpp"
#include "core/solar_spectrum.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/renderer.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/polygons.hpp"
#include "renderer/truth/scene_truth.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace obscura::test {

/// One band of a frame.
struct Image {
    std::int32_t width = 0, height = 0;
    std::vector<float> values;

    [[nodiscard]] float at(std::int32_t x, std::int32_t y) const {
        return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    }
    [[nodiscard]] double sum() const {
        double s = 0;
        for (const float v : values)
            s += static_cast<double>(v);
        return s;
    }
};

/// All bands of the window, in bands of `band_rows` rows, all rows exposed for `exposure_ns` about `t`.
inline std::vector<float> render_window(const renderer::Renderer& r, Region window,
                                        std::int32_t band_rows = 64, std::uint64_t frame_id = 1, Time t = {},
                                        std::int64_t exposure_ns = 0) {
    const std::vector<RowTime> times(static_cast<std::size_t>(window.height),
                                     RowTime{t - exposure_ns / 2, t + exposure_ns / 2});
    const auto width = static_cast<std::size_t>(window.width);
    const std::size_t plane = width * static_cast<std::size_t>(window.height);
    std::vector<float> image(r.band_count() * plane);
    for (std::int32_t first = 0; first < window.height; first += band_rows) {
        const std::int32_t rows = std::min(band_rows, window.height - first);
        const std::size_t part = width * static_cast<std::size_t>(rows);
        std::vector<float> band(r.band_count() * part);
        renderer::RenderRequest request;
        request.window = window;
        request.first_row = first;
        request.rows = rows;
        request.row_times =
            std::span(times).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(rows));
        request.common_mid = renderer::common_mid(times);
        request.frame_id = frame_id;
        r.render(request, band);
        for (std::size_t b = 0; b < r.band_count(); ++b)
            std::copy_n(band.begin() + static_cast<std::ptrdiff_t>(b * part), part,
                        image.begin() +
                            static_cast<std::ptrdiff_t>(b * plane + static_cast<std::size_t>(first) * width));
    }
    return image;
}

inline Image render(const renderer::Renderer& r, std::uint64_t frame_id = 1, Time t = {}) {
    const scene::Camera& c = r.scene().camera;
    Image image{c.width, c.height, render_window(r, {0, 0, c.width, c.height}, 64, frame_id, t)};
    image.values.resize(static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height));
    return image;
}

/// A camera at `position_m` that looks at the origin.
inline scene::Camera camera_at(Vec3 position_m, std::int32_t size, double pixel_angle_rad) {
    scene::Camera c;
    c.width = c.height = size;
    c.pixel_pitch_m = 10e-6;
    c.focal_length_m = c.pixel_pitch_m / pixel_angle_rad;
    const Vec3 up = std::abs(position_m.z) < 0.9 * length(position_m) ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
    c.motion.samples[0].pose = {position_m, look_along(-position_m, up)};
    return c;
}

/// A body of radius 500 m at the origin with the Sun along -x at 1 au, seen at phase angle `phase_rad` from
/// 100 km, `radius_px` pixels in radius.
inline scene::Scene sphere_scene(scene::Material material, double phase_rad, double radius_px,
                                 std::int32_t size) {
    scene::Scene s;
    const double radius_m = 500;
    const double distance_m = 1e5;
    s.bodies.push_back({"ball", renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}}, material, {}});
    s.sun.position_m = {-astronomical_unit_m, 0, 0};
    const Vec3 to_camera{-std::cos(phase_rad), std::sin(phase_rad), 0};
    s.camera = camera_at(distance_m * to_camera, size, std::asin(radius_m / distance_m) / radius_px);
    return s;
}

/// A room from -1 to 1 m along each axis: a cube wound so that its outer side is the one inside.
inline renderer::PolygonsParameters inward_cube() {
    renderer::PolygonsParameters room;
    for (const double side : {-1.0, 1.0}) {
        room.faces_m.push_back({{side, -1, -1}, {side, 1, -1}, {side, 1, 1}, {side, -1, 1}});
        room.faces_m.push_back({{-1, side, -1}, {-1, side, 1}, {1, side, 1}, {1, side, -1}});
        room.faces_m.push_back({{-1, -1, side}, {1, -1, side}, {1, 1, side}, {-1, 1, side}});
        if (side > 0)
            for (std::size_t f = room.faces_m.size() - 3; f < room.faces_m.size(); ++f)
                std::reverse(room.faces_m[f].begin(), room.faces_m[f].end());
    }
    return room;
}

/// Entries of one kind in the truth table of a square frame, edge_px wide, of the instant `t`.
inline std::vector<TruthEntry> truth_entries(const renderer::Renderer& r, TruthKind kind,
                                             std::int32_t edge_px, Time t = {}) {
    FrameWindow window;
    window.sensor = {0, 0, edge_px, edge_px};
    const std::vector<RowTime> rows(static_cast<std::size_t>(edge_px), RowTime{t, t});
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    SceneTruth truth;
    r.list_truth(request, truth);
    std::vector<TruthEntry> found;
    for (const TruthEntry& e : truth.entries)
        if (e.kind == kind) found.push_back(e);
    return found;
}

/// The Sun's irradiance at 1 au in the scene's first band.
inline double sun(const scene::Scene& s) {
    return renderer::sun_irradiance_w_m2(s.bands[0]) * s.sun.irradiance_scale;
}

} // namespace obscura::test
