// SPDX-License-Identifier: Apache-2.0
// What listing the truth of a frame over ground with craters costs, as JSON on standard output: processor
// time of a call of Renderer::list_truth(), craters listed. Usage: feature_truth_bench [SCENE-FILE [CALLS]];
// without a file 640 x 640 pixels straight down from 600 km.
#include "core/camera/scene_truth.hpp"
#include "core/solar_spectrum.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/renderer.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/truth/scene_truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <vector>

namespace {

using namespace obscura;

scene::Scene from_above() {
    scene::Scene s;
    renderer::PlanetParameters planet;
    planet.radii_m = {1737400, 1737400, 1737400};
    planet.relief.detail.terrain = renderer::DetailTerrain::highlands;
    planet.relief.detail.crater_age_ga = 3.9;
    planet.relief.detail.crater_least_m = 1000;
    s.bodies.push_back({"moon", planet, renderer::LambertParameters{0.2}, {}});
    s.sun.position_m = astronomical_unit_m * normalized(Vec3{0.4, 1, 0.2});
    s.camera.width = s.camera.height = 640;
    s.camera.pixel_pitch_m = 5.5e-6;
    s.camera.focal_length_m = 10e-3;
    s.camera.motion.samples[0].pose = {{1737400 + 600e3, 0, 0}, look_along({-1, 0.1, 0}, {0, 0, 1})};
    return s;
}

double cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

} // namespace

int main(int argc, char** argv) {
    const int calls = argc > 2 ? std::max(std::atoi(argv[2]), 1) : 50;
    const renderer::Renderer r(argc > 1 ? scene::load_scene(argv[1]) : from_above(), {1, 1});
    const scene::Camera& camera = r.scene().camera;
    FrameWindow window;
    window.sensor = {0, 0, camera.width, camera.height};
    const std::vector<RowTime> rows(static_cast<std::size_t>(camera.height));
    std::vector<std::byte> workspace(std::size_t{16} << 20);
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    request.workspace = workspace;
    SceneTruth truth;
    r.list_truth(request, truth); // makes the tiles
    const double before = cpu_ms();
    for (int call = 0; call < calls; ++call)
        r.list_truth(request, truth);
    const double ms = (cpu_ms() - before) / calls;
    const auto craters = std::count_if(truth.entries.begin(), truth.entries.end(),
                                       [](const TruthEntry& e) { return e.kind == TruthKind::crater; });
    fmt::print("{{\"entries\": {}, \"craters\": {}, \"ms\": {:.2f}}}\n", truth.entries.size(), craters, ms);
}
