// SPDX-License-Identifier: Apache-2.0
// Noise of planetshine, as JSON on standard output: Jupiter over the night side of Io, the Earth over that of
// the Moon. Noise is the standard deviation of a pixel over frames with different numbers, over its mean;
// `samples_per_cpu_s` is what a camera sample costs. Option: --frames N (16).
#include "core/solar_spectrum.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/renderer.hpp"
#include "renderer/shapes/ellipsoid.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <numbers>
#include <vector>

namespace {

using namespace obscura;

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

scene::Body ball(const char* name, double radius_m, double albedo, Vec3 position_m) {
    scene::Body body{name,
                     renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}},
                     renderer::LambertParameters{albedo},
                     {}};
    body.motion.samples[0].pose.position_m = position_m;
    return body;
}

/// A moon at the origin, the Sun along -x, a planet seen at phase `phase_rad`; 32 x 32 pixels look down on
/// the point of the night side that is half way between the planet and the point opposite to the Sun.
scene::Scene night(double moon_m, double planet_m, double distance_m, double sun_au, double phase_rad) {
    scene::Scene s;
    s.sun.position_m = {-sun_au * astronomical_unit_m, 0, 0};
    s.bodies.push_back(ball("moon", moon_m, 0.3, {}));
    s.bodies.push_back(
        ball("planet", planet_m, 0.5, distance_m * Vec3{std::cos(phase_rad), std::sin(phase_rad), 0}));
    const Vec3 normal{std::cos(phase_rad / 2), std::sin(phase_rad / 2), 0};
    s.camera.width = s.camera.height = 32;
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.focal_length_m = 1;
    s.camera.motion.samples[0].pose = {normal * (2 * moon_m), look_along(-normal, {0, 0, 1})};
    return s;
}

void measure(const char* name, const scene::Scene& s, std::uint32_t samples, int frames, bool last) {
    renderer::RenderSettings settings{samples, 1, 1};
    settings.max_bounces = 1;
    const renderer::Renderer r(s, settings);
    constexpr std::int32_t size = 32;
    const std::vector<RowTime> times(size);
    std::vector<float> image(size * size);
    std::vector<double> sum(image.size());
    std::vector<double> square(image.size());
    renderer::RenderRequest request;
    request.window = {0, 0, size, size};
    request.rows = size;
    request.row_times = times;
    const double before = cpu_seconds();
    for (int frame = 0; frame < frames; ++frame) {
        request.frame_id = static_cast<std::uint64_t>(frame);
        r.render(request, image);
        for (std::size_t i = 0; i < image.size(); ++i) {
            const auto value = static_cast<double>(image[i]);
            sum[i] += value / frames;
            square[i] += value * value / frames;
        }
    }
    const double cpu_s = cpu_seconds() - before;
    double mean = 0;
    double variance = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
        mean += sum[i] / static_cast<double>(sum.size());
        variance += (square[i] - sum[i] * sum[i]) * frames / (frames - 1) / static_cast<double>(sum.size());
    }
    fmt::print("  {{\"scene\": \"{}\", \"samples\": {}, \"mean_w_m2\": {:.6g}, \"mean_error\": {:.2g}, "
               "\"noise\": {:.4f}, \"samples_per_cpu_s\": {:.4g}}}{}\n",
               name, samples, mean, std::sqrt(variance / (frames * static_cast<double>(sum.size()))) / mean,
               std::sqrt(variance) / mean, static_cast<double>(r.samples_taken()) / cpu_s, last ? "" : ",");
}

} // namespace

int main(int argc, char* argv[]) {
    int frames = 16;
    if (argc == 3 && std::strcmp(argv[1], "--frames") == 0) frames = std::atoi(argv[2]);
    if (frames < 2) {
        fmt::print(stderr, "planetshine_bench: --frames from 2\n");
        return 64;
    }
    constexpr double deg = std::numbers::pi / 180;
    fmt::print("[\n");
    for (const double phase_deg : {20.0, 90.0, 140.0})
        for (const std::uint32_t samples : {4u, 16u, 64u, 256u}) {
            measure(fmt::format("Jupiter from Io, phase {}", phase_deg).c_str(),
                    night(1.8216e6, 6.9911e7, 4.217e8, 5.2, phase_deg * deg), samples, frames, false);
            measure(fmt::format("Earth from the Moon, phase {}", phase_deg).c_str(),
                    night(1.7374e6, 6.371e6, 3.844e8, 1, phase_deg * deg), samples, frames,
                    phase_deg == 140 && samples == 256);
        }
    fmt::print("]\n");
    return 0;
}
