// SPDX-License-Identifier: Apache-2.0
// Light received by the 200 000-facet body: direct map, its error, exchange, a hundred places of the Sun.
// Usage: received_light_bench; prints JSON.
#include "asteroid_200k.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/received/received_light.hpp"
#include "renderer/received/receivers.hpp"
#include "renderer/shapes/mesh.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <vector>

using namespace obscura;

namespace {

double seconds_of(const auto& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double resident_mb() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// Places of the Sun on a circle about the body.
Vec3 sun_at(int k) {
    const double turn = 6.283185307179586 * k / 100;
    return 1.495978707e11 * Vec3{std::cos(turn), std::sin(turn), 0.2};
}

/// Root of the mean squared difference over that of the values, of the facets that either says are lit.
double error_of(const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0, all = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        sum += std::pow(static_cast<double>(a[i]) - b[i], 2);
        all += std::pow(static_cast<double>(b[i]), 2);
    }
    return std::sqrt(sum / all);
}

} // namespace

int main() {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("obscura-received-" + std::to_string(::getpid()) + ".ply");
    bench::write_asteroid_200k(file);
    scene::Scene s;
    renderer::MeshFileParameters mesh;
    mesh.path = file.string();
    s.bodies.push_back({"asteroid", mesh, renderer::LambertParameters{0.3}, {}});
    s.camera.motion.samples[0].pose.position_m = {0, 0, 5000};
    renderer::ReceivedLightSettings direct;
    direct.max_bounces = 0;
    renderer::ReceivedLightMap map(s, direct);
    std::filesystem::remove(file);
    std::vector<double> times;
    renderer::ReceivedLight light;
    for (int k = 0; k < 9; ++k)
        times.push_back(seconds_of([&] { light = *map.at(0, sun_at(0)); }));
    std::sort(times.begin(), times.end());
    const auto sun = static_cast<std::size_t>(renderer::LightCause::sun);
    const std::vector<float> one = light.bodies[0].incident_w_m2[sun];
    const std::size_t facets = light.bodies[0].lit_share.size();
    bench::write_asteroid_200k(file);
    const auto error_with = [&](std::uint32_t points) {
        direct.points = points;
        return renderer::ReceivedLightMap(s, direct).at(0, sun_at(0))->bodies[0].incident_w_m2[sun];
    };
    const std::vector<float> exact = error_with(256);
    const double error_1 = error_of(one, exact), error_4 = error_of(error_with(4), exact);
    const double before_mb = resident_mb();
    renderer::ReceivedLightMap full(s, {});
    std::filesystem::remove(file);
    const double first_s = seconds_of([&] { light = *full.at(0, sun_at(0)); });
    const double hundred_s = seconds_of([&] {
        for (int k = 0; k < 100; ++k)
            light = *full.at(0, sun_at(k));
    });
    std::printf(
        "{\"facets\": %zu, \"direct_s\": %.4f, \"rms_error_1_point\": %.5f, \"rms_error_4_points\": %.5f, "
        "\"first_with_exchange_s\": %.3f, \"hundred_suns_s\": %.3f, \"growth_mb\": %.1f}\n",
        facets, times[times.size() / 2], error_1, error_4, first_s, hundred_s, resident_mb() - before_mb);
    return 0;
}
