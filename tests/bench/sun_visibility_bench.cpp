// SPDX-License-Identifier: Apache-2.0
// What frames of a terrain err by, and cost, with visibility of the Sun from tiles instead of shadow rays, as
// JSON on standard output. The truth are the same pixels with shadow rays and many samples. Errors are root
// mean squares over the lit pixels, in percent of the reference brightness (BodyState::reference_radiance:
// the surface half way between Sun and camera) and of the mean. Options: --size N, pixels along the edge of
// the frame (1024); --window N, of the part about its middle whose error is taken (256); --samples N, of the
// truth (512); --error E, target error of the frames (0.05); --map FILE: heights of the whole Moon with a
// PDS3 label below the detail; --only WORD: views with it in their name; --frames N: frames that are timed
// (10); 0: errors alone, for which no more than the window is rendered.
#include "core/solar_spectrum.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/presets.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <numbers>
#include <string>
#include <vector>

namespace {

using namespace obscura;
using renderer::DetailTerrain;
using renderer::SunVisibilityKind;

constexpr double moon_m = 1737400;
constexpr double degree = std::numbers::pi / 180;

struct Options {
    std::int32_t size = 1024, window = 256;
    std::uint32_t samples = 512;
    double error = 0.05;
    std::uint32_t own = 1;
    std::string map, only;
    int frames = 10;
};

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Ground under the camera, which is on the x axis; `pixel_m`: in the middle of the image.
struct View {
    const char* name;
    DetailTerrain terrain;
    double altitude_m, pixel_m;
};
constexpr View views[] = {{"disc", DetailTerrain::highlands, 2e7, 2 * moon_m / 1024},
                          {"smooth", DetailTerrain::maria, 1e5, 100},
                          {"rough", DetailTerrain::highlands, 1e5, 100}};

scene::Scene scene_of(const View& view, double elevation, bool hapke, SunVisibilityKind kind,
                      const Options& o) {
    scene::Scene s;
    renderer::PlanetParameters planet;
    planet.radii_m = {moon_m, moon_m, moon_m};
    planet.relief.detail.terrain = view.terrain;
    planet.relief.detail.crater_age_ga = view.terrain == DetailTerrain::maria ? 3.2 : 4.1;
    planet.relief.detail.crater_least_m = 200;
    planet.relief.sun_visibility = kind;
    planet.relief.tile_memory_mib = 1024;
    if (!o.map.empty()) {
        renderer::HeightTable table;
        table.file = o.map;
        planet.relief.heights.push_back(table);
    }
    const scene::Material material =
        hapke ? scene::Material(renderer::moon()) : scene::Material(renderer::LambertParameters{0.12});
    s.bodies.push_back({"moon", planet, material, {}});
    s.sun.position_m = astronomical_unit_m * Vec3{std::sin(elevation), std::cos(elevation), 0};
    s.camera.width = s.camera.height = o.size;
    s.camera.pixel_pitch_m = 5.5e-6;
    s.camera.psf_sigma_px = 0.7;
    const Vec3 from{moon_m + view.altitude_m, 0, 0};
    const bool disc = view.altitude_m > moon_m;
    // The whole disc fills the frame.
    const double pixel_rad = disc ? 2 * std::asin(moon_m / from.x) / o.size : view.pixel_m / view.altitude_m;
    s.camera.focal_length_m = s.camera.pixel_pitch_m / pixel_rad;
    s.camera.motion.samples[0].pose = {from, look_along({-1, 0, 0}, {0, 0, 1})};
    return s;
}

std::vector<float> render(const renderer::Renderer& r, Region window, std::uint64_t frame) {
    const std::vector<RowTime> times(static_cast<std::size_t>(window.height));
    std::vector<float> image(static_cast<std::size_t>(window.width) * times.size());
    renderer::RenderRequest request;
    request.window = window;
    request.rows = window.height;
    request.row_times = times;
    request.common_mid = renderer::common_mid(times);
    request.frame_id = frame;
    r.render(request, image);
    return image;
}

struct Errors {
    double rms = 0, bias = 0, mean = 0;
};
Errors compare(const std::vector<float>& image, const std::vector<float>& truth) {
    Errors e;
    double lit = 0;
    for (std::size_t k = 0; k < truth.size(); ++k) {
        if (!(truth[k] > 0 || image[k] > 0)) continue;
        const double d = static_cast<double>(image[k]) - static_cast<double>(truth[k]);
        lit += 1;
        e.rms += d * d;
        e.bias += d;
        e.mean += static_cast<double>(truth[k]);
    }
    return {std::sqrt(e.rms / lit), e.bias / lit, e.mean / lit};
}

void measure(const View& view, double elevation, bool hapke, const Options& o, const char*& separator) {
    const std::string name =
        fmt::format("{}, Sun at {:g} deg, {}", view.name, elevation / degree, hapke ? "moon" : "lambert");
    if (name.find(o.only) == std::string::npos) return;
    const std::int32_t first = (o.size - o.window) / 2;
    const Region part{first, first, o.window, o.window}, all{0, 0, o.size, o.size};
    const renderer::Renderer exact(scene_of(view, elevation, hapke, SunVisibilityKind::traced, o),
                                   {o.samples, 2, 5});
    const std::vector<float> truth = render(exact, part, 1);
    const auto& s = exact.scene();
    // Reference brightness of a pixel in the middle.
    double irradiance = 0;
    for (const SpectralBand& band : s.bands)
        irradiance += renderer::sun_irradiance_w_m2(band);
    const double half = std::cos((std::numbers::pi / 2 - elevation) / 2);
    renderer::ScatterPacket angles;
    for (int i = 0; i < renderer::packet_size; ++i) {
        angles.cos_in[i] = angles.cos_out[i] = half;
        angles.cos_phase[i] = std::sin(elevation);
    }
    renderer::Doubles r;
    renderer::make_material(s.bodies[0].material, "moon")->reflectance(angles, r);
    const double pixel_sr = std::pow(s.camera.pixel_pitch_m / s.camera.focal_length_m, 2);
    const double reference = r[0] * irradiance * pixel_sr;
    for (const SunVisibilityKind kind : {SunVisibilityKind::traced, SunVisibilityKind::tiles}) {
        renderer::RenderSettings settings{o.own, 2, 5};
        settings.target_error = o.error;
        const renderer::Renderer fast(scene_of(view, elevation, hapke, kind, o), settings);
        if (o.frames > 0) render(fast, all, 1); // makes the tiles
        const renderer::RenderWork before = fast.work();
        const double cpu = cpu_seconds();
        const auto wall = std::chrono::steady_clock::now();
        for (int frame = 0; frame < o.frames; ++frame)
            render(fast, all, 2 + static_cast<std::uint64_t>(frame));
        const double wall_ms =
            1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
        const double cpu_ms = 1e3 * (cpu_seconds() - cpu);
        const int timed = std::max(o.frames, 1);
        const renderer::RenderWork work = fast.work() - before;
        const Errors e = compare(render(fast, part, 77), truth);
        fmt::print("{}\n  {{\"view\": \"{}\", \"sun_visibility\": \"{}\", \"error_percent\": {:.2f}, "
                   "\"of_mean_percent\": {:.2f}, \"bias_percent\": {:.2f}, \"mean_percent\": {:.1f}, "
                   "\"frame_cpu_ms\": {:.0f}, \"frame_wall_ms\": {:.0f}, \"rays_per_pixel\": {:.2f}, "
                   "\"samples_per_pixel\": {:.2f}}}",
                   separator, name, name_of(kind), 100 * e.rms / reference, 100 * e.rms / e.mean,
                   100 * e.bias / reference, 100 * e.mean / reference, cpu_ms / timed, wall_ms / timed,
                   static_cast<double>(work.rays) / timed / o.size / o.size,
                   static_cast<double>(work.samples) / timed / o.size / o.size);
        separator = ",";
        std::fflush(stdout);
    }
}

} // namespace

int main(int argc, char** argv) {
    Options o;
    for (int i = 1; i + 1 < argc; i += 2) {
        const auto is = [&](const char* option) { return std::strcmp(argv[i], option) == 0; };
        if (is("--size")) o.size = std::atoi(argv[i + 1]);
        if (is("--window")) o.window = std::atoi(argv[i + 1]);
        if (is("--samples")) o.samples = static_cast<std::uint32_t>(std::atoi(argv[i + 1]));
        if (is("--error")) o.error = std::atof(argv[i + 1]);
        if (is("--own")) o.own = static_cast<std::uint32_t>(std::atoi(argv[i + 1]));
        if (is("--map")) o.map = argv[i + 1];
        if (is("--only")) o.only = argv[i + 1];
        if (is("--frames")) o.frames = std::max(std::atoi(argv[i + 1]), 0);
    }
    fmt::print("[");
    const char* separator = "";
    for (const View& view : views)
        for (const bool hapke : {false, true})
            for (const double elevation : {30 * degree, 8 * degree})
                measure(view, elevation, hapke, o, separator);
    fmt::print("\n]\n");
}
