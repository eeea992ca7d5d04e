// SPDX-License-Identifier: Apache-2.0
// Terrains through the renderer: the same bytes whatever the threads, rows and tile memory; continuity.
#include "images/writers/fits.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "support.hpp"
#include "terrain_support.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <cmath>

namespace terrain_render_test {

using namespace obscura;
using namespace obscura::test;

namespace {

constexpr double degree = std::numbers::pi / 180;

/// A rough Moon of 64 pixels over half a turn, heights up to some kilometres.
std::string height_file(const TempFolder& folder) {
    constexpr std::int32_t rows = 64;
    std::vector<float> samples;
    Directions any;
    for (std::int32_t j = 0; j < rows; ++j)
        for (std::int32_t i = 0; i < 2 * rows; ++i)
            samples.push_back(static_cast<float>(4000 * (any.number() - 0.5)));
    const auto file = folder.path() / "heights.fits";
    images::write_fits_float(file, 2 * rows, rows, 1, samples, "", {});
    return file.string();
}

/// Seen obliquely from 60 km above it, the Sun low.
scene::Scene low_orbit(const std::string& file, std::uint32_t tile_memory_mib = 512,
                       renderer::SunVisibilityKind sun_visibility = renderer::SunVisibilityKind::traced) {
    scene::Scene s;
    renderer::PlanetParameters planet;
    planet.radii_m = {1737400, 1737400, 1737400};
    planet.relief.heights = {whole_body_map(file)};
    planet.relief.tile_memory_mib = tile_memory_mib;
    planet.relief.sun_visibility = sun_visibility;
    s.bodies.push_back({"moon", planet, renderer::LambertParameters{0.3}, {}});
    s.sun.position_m = astronomical_unit_m * at_latitude(0, 75 * degree);
    const Vec3 place = (1737400 + 60e3) * Vec3{1, 0, 0};
    s.camera.width = s.camera.height = 96;
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.focal_length_m = 10e-6 / 0.008;
    s.camera.motion.samples[0].pose = {place, look_along({-0.5, 1, 0.2}, {1, 0, 0})};
    return s;
}

double difference(const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0, total = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
        sum += static_cast<double>(b[k]) - static_cast<double>(a[k]);
        total += static_cast<double>(a[k]);
    }
    return sum / total;
}

} // namespace

TEST_CASE("Threads, rows and tile memory change no byte of a terrain") {
    const TempFolder folder;
    const std::string file = height_file(folder);
    const Region all{0, 0, 96, 96};
    const auto kind = GENERATE(renderer::SunVisibilityKind::traced, renderer::SunVisibilityKind::tiles);
    const scene::Scene s = low_orbit(file, 512, kind);
    const std::uint32_t bounces = kind == renderer::SunVisibilityKind::traced ? GENERATE(0u, 1u) : 0u;
    const auto settings = [&](std::uint32_t threads) {
        renderer::RenderSettings r{2, threads, 11};
        r.max_bounces = bounces;
        r.target_error = bounces == 0 ? 0.05 : 0;
        r.max_samples_per_pixel = 8;
        return r;
    };
    const std::vector<float> one = render_window(renderer::Renderer(s, settings(1)), all, 96);
    CHECK(*std::max_element(one.begin(), one.end()) > 0);
    CHECK(one == render_window(renderer::Renderer(s, settings(2)), all, 31));
    CHECK(one == render_window(renderer::Renderer(low_orbit(file, 128, kind), settings(7)), all, 5));
    // Tiles that are there already change nothing.
    const renderer::Renderer used(low_orbit(file, 2048, kind), settings(2));
    render_window(used, {40, 40, 20, 20});
    CHECK(one == render_window(used, all, 96));
}

TEST_CASE("A terrain's light changes as little as the camera's place") {
    const TempFolder folder;
    const std::string file = height_file(folder);
    scene::Scene s = low_orbit(file);
    s.camera.width = s.camera.height = 48;
    s.camera.focal_length_m = 10e-6 / 0.016;
    const Region all{0, 0, 48, 48};
    const auto image = [&](double higher, std::uint64_t seed) {
        scene::Scene moved = s;
        moved.camera.motion.samples[0].pose.position_m.x += higher * 60e3;
        return render_window(renderer::Renderer(moved, {64, 2, seed}), all);
    };
    // By a thousandth of the distance, as often as levels change over a factor of two of it.
    double worst = 0;
    for (const double at : {0.0, 0.2, 0.5}) {
        const std::vector<float> here = image(at, 3), next = image(at + 1e-3, 3);
        worst = std::max(worst, std::abs(difference(here, next)));
        double changed = 0, pixels = 0;
        for (std::size_t k = 0; k < here.size(); ++k) {
            if (!(here[k] > 0)) continue;
            pixels += 1;
            changed += std::abs(next[k] - here[k]) > 0.5F * std::max(here[k], next[k]) ? 1 : 0;
        }
        CHECK(changed < 0.02 * pixels);
    }
    CHECK(worst < 0.005);
}

TEST_CASE("Without waiting, frames come at once with coarser tiles, and end up as those that waited") {
    const TempFolder folder;
    const std::string file = height_file(folder);
    const Region all{0, 0, 96, 96};
    const auto kind = GENERATE(renderer::SunVisibilityKind::traced, renderer::SunVisibilityKind::tiles);
    const scene::Scene s = low_orbit(file, 512, kind);
    const std::vector<float> wanted = render_window(renderer::Renderer(s, {2, 2, 11}), all);
    for (const double tiles_per_s : {1e-3, 40.0, 0.0}) {
        renderer::RenderSettings settings{2, 2, 11};
        settings.wait_for_tiles = false;
        settings.tiles_per_s = tiles_per_s;
        const renderer::Renderer r(s, settings);
        // The pinned tiles are there, no others: much of the ground is coarser than asked for.
        const std::vector<float> first = render_window(r, all);
        renderer::RenderWork work = r.work();
        CHECK(work.surface_hits > 5000);
        CHECK(work.tiles_missed > 0);
        CHECK(work.surface_coarser[0] > work.surface_hits / 20);
        CHECK(work.surface_coarser[1] > 0);
        CHECK(first != wanted);
        if (tiles_per_s > 0 && tiles_per_s < 1) continue; // a starved loader makes one tile and no more
        std::vector<float> last;
        for (int frame = 0; frame < 100000 && work.tiles_missed > 0; ++frame) {
            const renderer::RenderWork before = r.work();
            last = render_window(r, all);
            work = r.work() - before;
        }
        CHECK(work.tiles_missed == 0);
        CHECK(work.surface_coarser[0] == 0);
        CHECK(last == wanted);
    }
}

TEST_CASE("Tiles that are loaded before are all that a frame needs") {
    const TempFolder folder;
    const std::string file = height_file(folder);
    const auto kind = GENERATE(renderer::SunVisibilityKind::traced, renderer::SunVisibilityKind::tiles);
    const scene::Scene s = low_orbit(file, 512, kind);
    renderer::RenderSettings settings{2, 2, 11};
    settings.wait_for_tiles = false;
    settings.tiles_per_s = 1e-3;
    const renderer::Renderer r(s, settings);
    const std::vector<RowTime> times(96);
    renderer::RenderRequest request;
    request.window = {0, 0, 96, 96};
    request.rows = 96;
    request.row_times = times;
    const std::uint64_t before = r.tiles_made();
    CHECK_FALSE(r.load_tiles(request, [](double share) {
        CHECK(share < 1);
        return false;
    }));
    REQUIRE(r.load_tiles(request, [](double) { return true; }));
    const std::uint64_t loaded = r.tiles_made();
    CHECK(loaded > before + 20);
    const std::vector<float> image = render_window(r, request.window);
    const renderer::RenderWork work = r.work();
    CHECK(work.surface_hits > 5000);
    // Levels are chosen at random: of tiles in a corner of the view, some are met by few samples.
    CHECK(work.tiles_missed < work.surface_hits / 2000);
    CHECK(work.surface_coarser[0] < work.surface_hits / 2000);
    const std::vector<float> wanted = render_window(renderer::Renderer(s, {2, 2, 11}), request.window);
    std::size_t differ = 0;
    for (std::size_t k = 0; k < wanted.size(); ++k)
        differ += image[k] != wanted[k] ? 1 : 0;
    CHECK(differ < wanted.size() / 1000);
    // Nothing is left to do.
    CHECK(r.load_tiles(request, [](double) { return true; }));
    CHECK(r.tiles_made() <= loaded + 1);
}

TEST_CASE("All rows of a frame see the tiles that were there when it began") {
    const TempFolder folder;
    const scene::Scene s = low_orbit(height_file(folder));
    renderer::RenderSettings settings{1, 2, 11};
    settings.wait_for_tiles = false;
    const renderer::Renderer r(s, settings);
    // The same rows of the same frame, while the loader works: as often as blocks of a frame follow each
    // other.
    const std::vector<RowTime> times(96);
    const auto rows = [&](std::uint64_t frame, std::int32_t first) {
        renderer::RenderRequest request;
        request.window = {0, 0, 96, 96};
        request.first_row = first;
        request.rows = 32;
        request.row_times = std::span(times).subspan(0, 32);
        request.common_mid = renderer::common_mid(times);
        request.frame_id = frame;
        std::vector<float> out(96 * 32);
        r.render(request, out);
        return out;
    };
    int changed = 0;
    std::vector<float> before;
    for (std::uint64_t frame = 1; frame < 40; ++frame) {
        rows(frame, 0);
        const std::vector<float> once = rows(frame, 48);
        for (int again = 0; again < 3; ++again)
            REQUIRE(once == rows(frame, 48));
        changed += before.empty() || once == before ? 0 : 1;
        before = once;
    }
    CHECK(changed > 0);
}

} // namespace terrain_render_test
