// SPDX-License-Identifier: Apache-2.0
// Commands of the camera: size, fields of view, conventions, integration time.
#include "core/units.hpp"
#include "serve/compatible/handlers.hpp"

#include <fmt/format.h>

#include <cmath>

namespace obscura::serve::compatible {
namespace {

void set_fov(Request& r, double unit) {
    const double widest_rad = 2 * r.client_state.camera.lens.max_angle_rad() - degree;
    const double least = 1e-5 * degree / unit, most = widest_rad / unit;
    const GivenFov given{r.arguments.number("fov_x", least, most), r.arguments.number("fov_y", least, most),
                         unit};
    const PictureLens& lens = r.client_state.camera.lens;
    if (!std::isfinite(lens.radius(given.x * unit / 2)) ||
        !std::isfinite(lens.radius(given.y * unit / 2, true)))
        throw r.arguments.refused("fov_x", fmt::format("{} x {}", given.x, given.y),
                                  "a field that the projection shows");
    r.client_state.camera.given_fov = given;
    r.client_state.camera.fov_x_rad = given.x * unit;
    r.client_state.camera.fov_y_rad = given.y * unit;
}

void get_fov(Request& r, double unit) {
    // What was given comes back as it was.
    const CameraSettings& c = r.client_state.camera;
    const auto in_unit = [&](double given, double rad) {
        return c.given_fov.unit_rad == unit && given * unit == rad ? given : rad / unit;
    };
    r.reply.set("fov", List{in_unit(c.given_fov.x, c.fov_x_rad), in_unit(c.given_fov.y, c.fov_y_rad)});
}

} // namespace

void add_camera_calls(Handlers& handlers) {
    handlers["setCameraFOVDeg"] = [](Request& r) { set_fov(r, degree); };
    handlers["setCameraFOVRad"] = [](Request& r) { set_fov(r, 1); };
    handlers["getCameraFOVDeg"] = [](Request& r) { get_fov(r, degree); };
    handlers["getCameraFOVRad"] = [](Request& r) { get_fov(r, 1); };
    handlers["setImageSize"] = [](Request& r) {
        const auto width = r.arguments.integer("width", 1, 65536);
        const auto height = r.arguments.integer("height", 1, 65536);
        if (static_cast<std::uint64_t>(width * height) > r.client_state.limits().pixels)
            throw r.arguments.refused("width", fmt::format("{} x {} pixels", width, height),
                                      fmt::format("{} in all", r.client_state.limits().pixels));
        r.client_state.camera.width = static_cast<std::int32_t>(width);
        r.client_state.camera.height = static_cast<std::int32_t>(height);
    };
    handlers["getImageSize"] = [](Request& r) {
        r.reply.set("size", List{r.client_state.camera.width, r.client_state.camera.height});
    };
    handlers["setConventions"] = [](Request& r) {
        const auto quaternion = r.arguments.integer("quaternion_convention", 0, 1);
        const auto camera = r.arguments.integer("camera_convention", 0, 1);
        r.client_state.conventions = {static_cast<std::int32_t>(quaternion),
                                      static_cast<std::int32_t>(camera)};
    };
    handlers["getConventions"] = [](Request& r) {
        r.reply.set("conventions",
                    List{r.client_state.conventions.quaternion, r.client_state.conventions.camera});
    };
    handlers["setIntegrationTime"] = [](Request& r) {
        r.client_state.camera.integration_s = r.arguments.number("integration_time", 0, 1e6);
    };
    handlers["getIntegrationTime"] = [](Request& r) {
        r.reply.set("integration_time", r.client_state.camera.integration_s);
    };
}

} // namespace obscura::serve::compatible
