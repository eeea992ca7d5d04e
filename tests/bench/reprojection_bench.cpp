// SPDX-License-Identifier: Apache-2.0
// Time of frames made from the light of another one, beside that of rendering them, as JSON on standard
// output; of the 200k-facet body over a third of the field, turning, seen by a camera that turns too.
// Options:
// --threads N, --size PIXELS, --frames N, --only WORD. The best of all frames (11); processor time also holds
// on a busy machine.
#include "core/solar_spectrum.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/renderer.hpp"
#include "tests/bench/asteroid_200k.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

namespace {

using namespace obscura;

double cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

scene::Scene scene_of(const std::string& mesh, std::int32_t size) {
    scene::Scene s;
    s.bodies.push_back(
        {"body", renderer::MeshFileParameters{mesh, 1, false}, renderer::HapkeParameters{}, {}});
    s.bodies[0].motion.samples = {{0, {}}};
    s.bodies[0].motion.spin_rate_rad_s = 0.01;
    const Vec3 from_body{-0.5, std::sqrt(0.75), 0};
    const double pixel_rad = 500 / 1e5 / (0.36 * size);
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.focal_length_m = s.camera.pixel_pitch_m / pixel_rad;
    s.camera.height = s.camera.width = size;
    s.sun.position_m = {-astronomical_unit_m, 0, 0};
    const Pose pose{1e5 * from_body, look_along(-from_body, {0, 0, 1})};
    Pose later = pose;
    later.orientation = pose.orientation * axis_angle({0.3, 1, 0}, 20 * pixel_rad);
    s.camera.motion.samples = {{0, pose}, {1, later}};
    return s;
}

struct Time_ms {
    double wall = 1e9, cpu = 1e9;
};

/// The shortest time of a frame of 0.1 s.
Time_ms measure(const renderer::Renderer& r, QualityLevel level, renderer::ReprojectionSource* keep,
                renderer::ReprojectionSource* from, std::uint64_t frames) {
    const std::int32_t size = r.scene().camera.width;
    const Time when{keep != nullptr ? 0 : 100 * ns_per_ms};
    const auto rows = static_cast<std::size_t>(size);
    const std::vector<RowTime> times(rows, {when, when});
    const std::vector<QualityLevel> levels(rows, level);
    std::vector<float> image(r.band_count() * rows * rows);
    Time_ms best;
    for (std::uint64_t frame = 0; frame < frames; ++frame) {
        if (keep != nullptr) keep->begin_frame(renderer::KeptWindow{{0, 0, size, size}});
        const double cpu_before = cpu_ms();
        const auto before = std::chrono::steady_clock::now();
        if (from != nullptr) from->begin_reprojection();
        renderer::RenderRequest request;
        request.window = {0, 0, size, size};
        request.rows = size;
        request.row_times = request.frame_times = times;
        request.common_mid = when;
        request.frame_id = frame;
        request.levels = levels;
        request.keep = keep;
        request.from = from;
        r.render(request, image);
        best.wall = std::min(
            best.wall,
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count());
        best.cpu = std::min(best.cpu, cpu_ms() - cpu_before);
    }
    return best;
}

} // namespace

int main(int argc, char** argv) {
    unsigned threads = 2;
    std::int32_t size = 1024;
    std::uint64_t frames = 11;
    std::string only;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::strcmp(argv[i], "--threads") == 0) threads = static_cast<unsigned>(std::atoi(argv[i + 1]));
        if (std::strcmp(argv[i], "--size") == 0) size = std::atoi(argv[i + 1]);
        if (std::strcmp(argv[i], "--only") == 0) only = argv[i + 1];
        if (std::strcmp(argv[i], "--frames") == 0)
            frames = static_cast<std::uint64_t>(std::atoi(argv[i + 1]));
    }
    const test::TempFolder folder;
    const std::string mesh = (folder.path() / "asteroid.ply").string();
    bench::write_asteroid_200k(mesh);
    renderer::RenderSettings settings{1, threads, 1};
    settings.target_error = 0.02;
    const renderer::Renderer r(scene_of(mesh, size), settings);
    const auto pixels = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
    renderer::ReprojectionSource kept(r, size, size);
    const double megapixels = static_cast<double>(pixels) / 1e6;
    static_cast<void>(measure(r, QualityLevel::full, &kept, nullptr, 1));
    bool first = true;
    const auto print = [&](const std::string& name, QualityLevel level, renderer::ReprojectionSource* keep,
                           renderer::ReprojectionSource* from) {
        if (name.find(only) == std::string::npos) return;
        const Time_ms t = measure(r, level, keep, from, frames);
        fmt::print("{}  {{\"what\": \"{}\", \"size\": {}, \"threads\": {}, \"ms_per_megapixel\": {:.2f}, "
                   "\"cpu_ms_per_megapixel\": {:.2f}}}",
                   first ? "[\n" : ",\n", name, size, threads, t.wall / megapixels, t.cpu / megapixels);
        first = false;
    };
    print("rendered", QualityLevel::full, nullptr, nullptr);
    print("rendered, kept", QualityLevel::full, &kept, nullptr);
    print("sparse grid", QualityLevel::sixteenth, nullptr, nullptr);
    print("reprojected", QualityLevel::reprojected, nullptr, &kept);
    print("repeated", QualityLevel::repeated, nullptr, &kept);
    fmt::print("{}]\n", first ? "[" : "\n");
    return 0;
}
