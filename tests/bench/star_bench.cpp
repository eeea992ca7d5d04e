// SPDX-License-Identifier: Apache-2.0
// Speed of a star catalogue file and of star-only frames, as JSON on standard output. Arguments: the
// catalogue file, and where frames are made of another one, that file. Each time is the median of
// many runs on one core, in processor time, which holds on a busy machine; times to load are those with the
// file in the page cache.
#include "ephemeris/stars/star_file.hpp"
#include "renderer/renderer.hpp"
#include "renderer/world/view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

namespace {

using namespace obscura;

constexpr double degree = std::numbers::pi / 180;

double cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double median_ms(int runs, const std::function<void(int)>& run) {
    std::vector<double> times;
    for (int i = 0; i < runs; ++i) {
        const double start = cpu_ms();
        run(i);
        times.push_back(cpu_ms() - start);
    }
    std::sort(times.begin(), times.end());
    return times[times.size() / 2];
}

std::vector<Vec3> random_directions(std::size_t count) {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    std::vector<Vec3> out;
    while (out.size() < count)
        out.push_back(normalized(Vec3{normal(random), normal(random), normal(random)}));
    return out;
}

void bench_file(const char* name) {
    std::vector<ephemeris::StarFile> keep;
    const double load_ms = median_ms(15, [&](int) {
        keep.clear();
        keep.emplace_back(std::filesystem::path(name));
    });
    const ephemeris::StarFile& file = keep.front();
    std::vector<std::uint32_t> found(file.size());
    const std::vector<Vec3> axes = random_directions(400);
    fmt::print("  \"stars\": {}, \"bytes\": {}, \"bytes_per_star\": {:.2f}, \"load_ms\": {:.3f},\n",
               file.size(), file.bytes(), static_cast<double>(file.bytes()) / file.size(), load_ms);
    for (const double field_deg : {5.0, 10.0, 20.0}) {
        double stars = 0;
        const double ms = median_ms(400, [&](int i) {
            const Vec3 axis = axes[static_cast<std::size_t>(i)];
            stars += static_cast<double>(file.find({axis, field_deg / 2 * degree}, 40, found));
        });
        fmt::print("  \"query_{:.0f}_deg_ms\": {:.4f}, \"query_{:.0f}_deg_stars\": {:.0f},\n", field_deg, ms,
                   field_deg, stars / 400);
    }
}

/// Star-only frame of 1024 x 1024 pixels under a rolling shutter, the camera turning by `slew_deg_s`.
void bench_frame(const char* name, double field_deg, double limiting_v, double slew_deg_s, double exposure_ms,
                 bool last) {
    constexpr std::int32_t size = 1024;
    scene::Scene scene;
    scene.catalogue.file = std::make_shared<const ephemeris::StarFile>(std::filesystem::path(name));
    scene.catalogue.limiting_v = limiting_v;
    scene.camera.width = scene.camera.height = size;
    scene.camera.pixel_pitch_m = 10e-6;
    scene.camera.focal_length_m = scene.camera.pixel_pitch_m * size / 2 / std::tan(field_deg / 2 * degree);
    scene.camera.psf_sigma_px = 0.76;     // 11 x 11 pixels get light
    const Vec3 boresight{0.3, -0.5, 0.4}; // Orion's neighbourhood
    scene.camera.motion.samples[0].pose.orientation = look_along(normalized(boresight), {0, 0, 1});
    scene.camera.motion.spin_axis = {1, 0.3, 0};
    scene.camera.motion.spin_rate_rad_s = slew_deg_s * degree;
    renderer::RenderSettings settings;
    settings.threads = 1;
    const renderer::Renderer renderer(scene, settings);
    constexpr std::int64_t row_ns = 20'000;
    std::vector<RowTime> times;
    for (std::int32_t y = 0; y < size; ++y)
        times.push_back({Time{y * row_ns}, Time{y * row_ns + std::llround(exposure_ms * 1e6)}});
    renderer::RenderRequest request;
    request.window = {0, 0, size, size};
    request.rows = size;
    request.row_times = times;
    std::vector<float> image(static_cast<std::size_t>(size) * size);
    const double ms = median_ms(25, [&](int i) {
        request.frame_id = static_cast<std::uint64_t>(i);
        renderer.render(request, image);
    });
    const auto lit = std::count_if(image.begin(), image.end(), [](float e) { return e > 0; });
    fmt::print("  {{\"field_deg\": {:g}, \"limiting_v\": {:g}, \"slew_deg_s\": {:g}, \"exposure_ms\": {:g}, "
               "\"stars\": {}, \"lit_pixels\": {}, \"frame_ms\": {:.2f}}}{}\n",
               field_deg, limiting_v, slew_deg_s, exposure_ms, renderer.view(Time{0}).stars, lit, ms,
               last ? "" : ",");
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fputs("usage: star_bench CATALOGUE [CATALOGUE_OF_FRAMES]\n", stderr);
        return 64;
    }
    const char* const frames = argv[argc - 1];
    fmt::print("{{\n");
    bench_file(argv[1]);
    fmt::print("  \"frames\": [\n");
    bench_frame(frames, 12, 8, 0, 1, false);
    bench_frame(frames, 12, 8, 1, 1, false);
    bench_frame(frames, 20, 8, 1, 1, false);
    bench_frame(frames, 20, 8, 1, 100, false);
    bench_frame(frames, 20, 8, 10, 10, true);
    fmt::print("  ]\n}}\n");
    return 0;
}
