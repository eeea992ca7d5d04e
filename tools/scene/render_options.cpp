// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/render_options.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace obscura::tools {

void RenderOptions::declare(host::CommandLine& line, const std::string& trajectory_help) {
    line.option(
        "--size", &size, "WxH",
        "Width and height in pixels, with the same horizontal field of view (default: from the scene)");
    line.number("--samples", &settings.samples_per_pixel, "N",
                "Samples per pixel, taken where a body may cover the pixel", 1, 65536);
    line.option("--window", &window, "X,Y,WxH",
                "Render only the window of W x H pixels whose upper left corner is (X, Y); "
                "its pixels equal those of the full image");
    line.number(
        "--error", &settings.target_error, "SHARE",
        "Adaptive sampling: add samples until the relative standard error of a pixel is about this (0: --samples everywhere)",
        0, 1);
    line.number("--max-samples", &settings.max_samples_per_pixel, "N",
                "With --error: largest number of samples per pixel", 1, 65536);
    line.number("--bounces", &settings.max_bounces, "N",
                "Maximum path depth: reflections after the first (the scene's own number if that is larger)",
                0, 1000);
    line.number("--seed", &settings.seed, "N", "Seed of the random numbers", 0, 9e15);
    line.number("--time", &time_s, "S", "Scene time of the first frame in seconds", -1e9, 1e9);
    line.number(
        "--exposure", &exposure_s, "S",
        "Exposure time in seconds, centred on the frame's scene time; moving bodies and the moving camera blur",
        0, 1e6);
    line.number("--step", &step_s, "S", "Scene time between consecutive frames in seconds", -1e9, 1e9);
    line.flag("--trajectory", trajectory,
              "Render one frame at each time stamp of the camera's trajectory; " + trajectory_help);
    line.flag(
        "--layers", layers,
        "With EXR and FITS: also write the AOVs (body, range, depth, normals, latitude, longitude, slope, angles, texture coordinates, albedo, material), and the samples and the estimated variance of each pixel, as layers or image extensions");
}

void RenderOptions::check() const {
    std::int32_t width = 0, height = 0;
    if (!size.empty()) host::parse_size(size, width, height);
}

void RenderOptions::resize(scene::Scene& scene) const {
    if (size.empty()) return;
    std::int32_t width = 0, height = 0;
    host::parse_size(size, width, height);
    const double larger = static_cast<double>(scene.camera.width) / width;
    scene.camera.pixel_pitch_m *= larger, scene.camera.pixel_pitch_y_m *= larger;
    scene.camera.width = width, scene.camera.height = height;
}

Region RenderOptions::region(const scene::Camera& camera, std::string_view program) const {
    if (window.empty()) return {0, 0, camera.width, camera.height};
    const std::size_t comma = window.rfind(',');
    const auto number = [](std::string_view digits, std::int32_t& value) {
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        return error == std::errc{} && end == digits.data() + digits.size() && value >= 0;
    };
    const std::string corner = comma == std::string::npos ? "" : window.substr(0, comma);
    const std::size_t middle = corner.find(',');
    Region r;
    bool good = middle != std::string::npos && number(corner.substr(0, middle), r.x) &&
                number(corner.substr(middle + 1), r.y);
    if (good) host::parse_size(std::string_view(window).substr(comma + 1), r.width, r.height);
    good = good && r.x < camera.width && r.y < camera.height && r.width <= camera.width - r.x &&
           r.height <= camera.height - r.y;
    if (!good)
        throw host::UsageError(fmt::format(
            "{}: --window \"{}\": allowed is X,Y,WIDTHxHEIGHT inside the {} x {} pixels, for example 8,16,64x32",
            program, window.substr(0, 60), camera.width, camera.height));
    return r;
}

double RenderOptions::time_of(const scene::Camera& camera, std::uint64_t number) const {
    if (trajectory) return camera.motion.samples.at(number - 1).time_s;
    return time_s + static_cast<double>(number - 1) * step_s;
}

std::vector<double> RenderOptions::times_s(const scene::Camera& camera, std::uint64_t count) const {
    std::vector<double> out(trajectory ? camera.motion.samples.size() : count);
    for (std::size_t i = 0; i < out.size(); ++i)
        out[i] = time_of(camera, i + 1);
    return out;
}

RowTime RenderOptions::exposure_of(double at_s) const {
    const Time when{std::llround(at_s * 1e9)};
    const std::int64_t half_ns = std::llround(exposure_s * 0.5e9);
    return {when - half_ns, when + half_ns};
}

} // namespace obscura::tools
