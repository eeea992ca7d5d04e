// SPDX-License-Identifier: Apache-2.0
// Speed of the renderer on fixed scenes, as JSON on standard output. Options: --threads N, --size PIXELS,
// --only WORD (the scenes with it in their name), --write-asteroid FILE.ply (writes the 200k-facet body, no
// more). Rates are per second of processor time as well as of wall time: the first hold on a busy machine.
// The scene "asteroid 200k facets" also tells, per core, how many samples a second cost both a camera ray and
// a shadow ray, and how much faster two threads are than one (wall time: of an idle machine only).
#include "core/philox.hpp"
#include "core/solar_spectrum.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/renderer.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "tests/bench/asteroid_200k.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace {

using namespace obscura;

struct Options {
    unsigned threads = 2;
    std::int32_t size = 1024;
    std::string only;
};

struct Case {
    std::string name;
    scene::Scene scene;
    renderer::RenderSettings settings;
    std::int64_t exposure_ns = 0;
};

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// A body of 500 m at the origin that fills about a third of the field, Sun at 60 degrees phase, 1000 stars.
scene::Scene scene_with(scene::Shape shape, scene::Material material, std::int32_t size) {
    scene::Scene s;
    s.bodies.push_back({"body", std::move(shape), material, {}});
    s.sun.position_m = {-astronomical_unit_m, 0, 0};
    s.camera.width = s.camera.height = size;
    s.camera.pixel_pitch_m = 10e-6;
    const double distance_m = 1e5;
    s.camera.focal_length_m = s.camera.pixel_pitch_m * distance_m * (0.36 * size) / 500;
    const Vec3 to_camera{-0.5, std::sqrt(0.75), 0};
    s.camera.motion.samples[0].pose = {distance_m * to_camera, look_along(-to_camera, {0, 0, 1})};
    for (int i = 0; i < 1000; ++i) {
        const double angle = 2.399963 * i; // golden angle: spread over a disc about the boresight
        const double off = 0.02 * std::sqrt(i / 1000.0);
        const Vec3 d = rotate(s.camera.motion.samples[0].pose.orientation,
                              {off * std::cos(angle), off * std::sin(angle), 1});
        const Vec3 n = normalized(d);
        s.stars.push_back({std::atan2(n.y, n.x), std::asin(n.z), 2 + i * 0.006, 0.5});
    }
    return s;
}

/// The scene with its body on its way across `pixels` of the field in a second.
scene::Scene moving(scene::Scene s, double pixels) {
    const Vec3 across = rotate(s.camera.motion.samples[0].pose.orientation, {1, 0.3, 0});
    const Vec3 half_m = across * (pixels * 500 / (0.36 * s.camera.width) / length(across) / 2);
    s.bodies[0].motion.samples = {{-0.5, {-half_m, {}}}, {0.5, {half_m, {}}}};
    s.stars.clear(); // their streaks are splatted one by one
    return s;
}

/// One frame of a renderer: what it took.
struct Frame {
    double wall_s, cpu_s;
    std::uint64_t samples, rays;
};

Frame render_frame(const renderer::Renderer& r, std::uint64_t frame_id, std::vector<float>& image,
                   Time when = {}, std::int64_t exposure_ns = 0) {
    const std::int32_t size = r.scene().camera.width;
    const std::vector<RowTime> times(static_cast<std::size_t>(size),
                                     {when - exposure_ns / 2, when + exposure_ns / 2});
    image.resize(r.band_count() * static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
    renderer::RenderRequest request;
    request.window = {0, 0, size, size};
    request.rows = size;
    request.row_times = times;
    request.common_mid = when;
    request.frame_id = frame_id;
    const std::uint64_t samples_before = r.samples_taken();
    const std::uint64_t rays_before = r.rays_traced();
    const double cpu_before = cpu_seconds();
    const auto before = std::chrono::steady_clock::now();
    r.render(request, image);
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count(),
            cpu_seconds() - cpu_before, r.samples_taken() - samples_before, r.rays_traced() - rays_before};
}

/// The facet count that the peers are measured with: one thread and two by turns, the best of each; every
/// pixel gets the same number of samples.
void measure_200k(scene::Scene s, const std::string& name, bool last) {
    const test::TempFolder folder;
    const std::filesystem::path file = folder.path() / "asteroid.ply";
    bench::write_asteroid_200k(file);
    s.bodies[0].shape = renderer::MeshFileParameters{file.string(), 1, false};
    const renderer::Renderer one(s, {16, 1, 1});
    const renderer::Renderer two(s, {16, 2, 1});
    std::vector<float> image;
    Frame best_one{1e9, 1e9, 0, 0};
    double best_two_s = 1e9;
    for (std::uint64_t frame = 0; frame < 7; ++frame) {
        const Frame f = render_frame(one, frame, image);
        best_one = {std::min(best_one.wall_s, f.wall_s), std::min(best_one.cpu_s, f.cpu_s), f.samples,
                    f.rays};
        best_two_s = std::min(best_two_s, render_frame(two, frame, image).wall_s);
    }
    const auto samples = static_cast<double>(best_one.samples);
    // Each sample has a camera ray; those on lit facets have a shadow ray as well.
    const double shadowed = static_cast<double>(best_one.rays) - samples;
    fmt::print("  {{\"scene\": \"{}\", \"size\": {}, \"facets\": 199692, \"frame_ms_1_thread\": {:.1f}, "
               "\"frame_ms_2_threads\": {:.1f}, \"thread_ratio\": {:.3f}, \"samples\": {}, "
               "\"samples_per_core_s\": {:.4g}, \"samples_with_shadow_ray_per_core_s\": {:.4g}, "
               "\"rays_per_core_s\": {:.4g}}}{}\n",
               name, s.camera.width, best_one.wall_s * 1e3, best_two_s * 1e3, best_one.wall_s / best_two_s,
               best_one.samples, samples / best_one.cpu_s, shadowed / best_one.cpu_s,
               static_cast<double>(best_one.rays) / best_one.cpu_s, last ? "" : ",");
}

/// What the wings of an f/20 PSF add to a frame, in every one of which they are new: the best of some frames
/// with and without them, by turns.
void measure_wings(const std::string& name, scene::Scene s, unsigned threads, bool last) {
    s.camera.psf.model = scene::PointSpread::Model::airy;
    s.camera.aperture_m = s.camera.focal_length_m / 20;
    s.stars.clear(); // their wings are splatted one by one
    const renderer::RenderSettings settings{4, threads, 1};
    const renderer::Renderer without(s, settings);
    s.camera.psf.wings_px = 1024;
    const renderer::Renderer with(s, settings);
    std::vector<float> image;
    Frame best[2] = {{1e9, 1e9, 0, 0}, {1e9, 1e9, 0, 0}};
    for (std::int64_t frame = 0; frame < 7; ++frame)
        for (const bool wings : {false, true}) {
            const Frame f = render_frame(wings ? with : without, static_cast<std::uint64_t>(frame), image,
                                         Time{frame * 10'000'000'000});
            Frame& b = best[wings ? 1 : 0];
            b = {std::min(b.wall_s, f.wall_s), std::min(b.cpu_s, f.cpu_s), f.samples, f.rays};
        }
    const double megapixels = 1e-6 * s.camera.width * s.camera.height;
    fmt::print(
        "  {{\"scene\": \"{}\", \"size\": {}, \"threads\": {}, \"frame_ms\": {:.1f}, "
        "\"frame_ms_without_wings\": {:.1f}, \"added_samples\": {}, \"added_ms_per_megapixel\": {:.1f}, "
        "\"added_cpu_ms_per_megapixel\": {:.1f}}}{}\n",
        name, s.camera.width, threads, best[1].wall_s * 1e3, best[0].wall_s * 1e3,
        best[1].samples - best[0].samples, (best[1].wall_s - best[0].wall_s) * 1e3 / megapixels,
        (best[1].cpu_s - best[0].cpu_s) * 1e3 / megapixels, last ? "" : ",");
}

/// Renders some frames and prints one JSON object; the best frame counts.
void measure(const std::string& name, const scene::Scene& s, const renderer::RenderSettings& settings,
             std::int64_t exposure_ns, bool last) {
    const auto start = std::chrono::steady_clock::now();
    const renderer::Renderer r(s, settings);
    const double build_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::vector<float> image;
    Frame best{1e9, 1e9, 0, 0};
    for (std::uint64_t frame = 0; frame < 5; ++frame) {
        const Frame f = render_frame(r, frame, image, {}, exposure_ns);
        best = {std::min(best.wall_s, f.wall_s), std::min(best.cpu_s, f.cpu_s), f.samples, f.rays};
    }
    const auto lit = std::count_if(image.begin(), image.end(), [](float v) { return v > 0; });
    const auto n = static_cast<double>(best.samples);
    fmt::print(
        "  {{\"scene\": \"{}\", \"size\": {}, \"threads\": {}, \"lit_pixels\": {}, \"build_s\": {:.3f}, "
        "\"frame_ms\": {:.1f}, \"cpu_ms\": {:.1f}, \"samples\": {}, \"rays\": {}, "
        "\"samples_per_s\": {:.4g}, \"samples_per_cpu_s\": {:.4g}, \"rays_per_cpu_s\": {:.4g}}}{}\n",
        name, s.camera.width, settings.threads, lit, build_s, best.wall_s * 1e3, best.cpu_s * 1e3,
        best.samples, best.rays, n / best.wall_s, n / best.cpu_s, static_cast<double>(best.rays) / best.cpu_s,
        last ? "" : ",");
}

/// Nanoseconds of processor time per evaluation of a scattering law, in packets of random angles.
double law_ns(const scene::Material& description) {
    const auto material = renderer::make_material(description, "bench");
    std::vector<renderer::ScatterPacket> packets(64);
    std::uint32_t n = 0;
    for (renderer::ScatterPacket& p : packets)
        for (int i = 0; i < renderer::packet_size; ++i) {
            const auto random = philox4x32({n++, 0, 0, 0}, {1, 2});
            p.cos_in[i] = uniform_double(random[0]);
            p.cos_out[i] = uniform_double(random[1]);
            const double sines =
                std::sqrt((1 - p.cos_in[i] * p.cos_in[i]) * (1 - p.cos_out[i] * p.cos_out[i]));
            p.cos_phase[i] = p.cos_in[i] * p.cos_out[i] +
                             sines * std::cos(2 * std::numbers::pi * uniform_double(random[2]));
        }
    double best_s = std::numeric_limits<double>::max();
    double sum = 0; // used, so that nothing is left out
    for (int round = 0; round < 50; ++round) {
        const double before = cpu_seconds();
        for (int k = 0; k < 16; ++k)
            for (const renderer::ScatterPacket& p : packets) {
                renderer::Doubles r;
                material->reflectance(p, r);
                sum += r[0];
            }
        best_s = std::min(best_s, cpu_seconds() - before);
    }
    return sum > 0 ? best_s * 1e9 / static_cast<double>(16 * packets.size() * renderer::packet_size) : 0;
}

} // namespace

int main(int argc, char* argv[]) {
    Options o;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::strcmp(argv[i], "--threads") == 0) o.threads = static_cast<unsigned>(std::atoi(argv[i + 1]));
        if (std::strcmp(argv[i], "--size") == 0) o.size = std::atoi(argv[i + 1]);
        if (std::strcmp(argv[i], "--only") == 0) o.only = argv[i + 1];
        if (std::strcmp(argv[i], "--write-asteroid") == 0) {
            bench::write_asteroid_200k(argv[i + 1]);
            return 0;
        }
    }
    if (o.threads < 1 || o.size < 16 || o.size > 8192) {
        fmt::print(stderr, "render_bench: --threads from 1, --size 16 to 8192\n");
        return 64;
    }
    const renderer::ProceduralBodyParameters small{500, {1, 0.9, 0.8}, 1, 6};
    const renderer::ProceduralBodyParameters large{500, {1, 0.9, 0.8}, 1, 7};
    const renderer::LambertParameters lambert{0.1};
    const renderer::HapkeParameters hapke{0.3, 0.3, 0.5, 1, 0.05, 0.5, 0.1, 0.35, 0.2};
    renderer::RenderSettings fixed{16, o.threads, 1};
    renderer::RenderSettings one_thread{16, 1, 1};
    renderer::RenderSettings real_time{2, o.threads, 1};
    real_time.target_error = 0.01;
    renderer::RenderSettings blurred{4, o.threads, 1};
    renderer::RenderSettings blurred_adaptive{4, o.threads, 1};
    blurred_adaptive.target_error = 0.01;
    const std::int64_t second_ns = 1'000'000'000;
    const std::string facets_200k = "asteroid 200k facets, 16 samples, 1 and 2 threads";
    const std::string ball_wings = "ellipsoid, wings to 1024 px";
    const std::string facet_wings = "asteroid 82k facets, wings to 1024 px";
    std::vector<Case> cases{
        {facets_200k, scene_with(small, lambert, o.size), fixed},
        {"asteroid 82k facets, 16 samples", scene_with(small, lambert, o.size), fixed},
        {"asteroid 328k facets, 16 samples", scene_with(large, lambert, o.size), fixed},
        {"asteroid 328k facets, 16 samples, 1 thread", scene_with(large, lambert, o.size), one_thread},
        {"asteroid 82k facets, rough Hapke, 16 samples", scene_with(small, hapke, o.size), fixed},
        {"ellipsoid, 16 samples", scene_with(renderer::EllipsoidParameters{{500, 450, 400}}, lambert, o.size),
         fixed},
        {"asteroid 82k facets, adaptive 1 %", scene_with(small, lambert, o.size), real_time},
        {"asteroid 328k facets, adaptive 1 %", scene_with(large, lambert, o.size), real_time},
        {"asteroid 82k facets, at rest, 4 samples", moving(scene_with(small, lambert, o.size), 0), blurred,
         second_ns},
        {"asteroid 82k facets, motion of 40 px, 4 samples", moving(scene_with(small, lambert, o.size), 40),
         blurred, second_ns},
        {"asteroid 82k facets, motion of 40 px, adaptive 1 %", moving(scene_with(small, lambert, o.size), 40),
         blurred_adaptive, second_ns},
        {ball_wings, scene_with(renderer::EllipsoidParameters{{500, 450, 400}}, lambert, o.size), fixed},
        {facet_wings, scene_with(small, lambert, o.size), fixed},
    };
    std::erase_if(cases, [&](const Case& c) { return c.name.find(o.only) == std::string::npos; });
    fmt::print("[\n");
    if (o.only.empty() || o.only == "Hapke")
        fmt::print("  {{\"law\": \"rough Hapke\", \"ns_per_evaluation\": {:.1f}}},\n", law_ns(hapke));
    for (const Case& c : cases)
        if (c.name == facets_200k)
            measure_200k(c.scene, c.name, &c == &cases.back());
        else if (c.name == ball_wings || c.name == facet_wings)
            measure_wings(c.name, c.scene, o.threads, &c == &cases.back());
        else
            measure(c.name, c.scene, c.settings, c.exposure_ns, &c == &cases.back());
    fmt::print("]\n");
    return 0;
}
