// SPDX-License-Identifier: Apache-2.0
// Kept visibility of a Sun that moves: replaced beside the frames, each of which sees one state of it.
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "support.hpp"
#include "terrain_support.hpp"

#include <chrono>
#include <cmath>
#include <thread>

namespace sun_replacement_test {

using namespace obscura;
using namespace obscura::test;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr std::int32_t size = 64;

/// A Sun that sinks by 0.04 degrees a second from 9 degrees above the ground at (1, 0, 0).
class Sunset final : public scene::PosePath {
public:
    [[nodiscard]] Pose at(double time_s) const noexcept override {
        const double elevation = (9 - 0.04 * time_s) * degree;
        return {astronomical_unit_m * Vec3{std::sin(elevation), std::cos(elevation), 0}, {}};
    }
    [[nodiscard]] Vec3 velocity_m_s(double /*time_s*/) const noexcept override { return {}; }
    [[nodiscard]] scene::PoseAges ages(double /*time_s*/) const noexcept override { return {}; }
    [[nodiscard]] std::vector<double> times_s() const override { return {0}; }
};

scene::Scene evening() {
    scene::Scene s;
    renderer::PlanetParameters planet;
    planet.radii_m = {1737400, 1737400, 1737400};
    planet.relief.detail.terrain = renderer::DetailTerrain::highlands;
    planet.relief.sun_visibility = renderer::SunVisibilityKind::tiles;
    s.bodies.push_back({"moon", planet, renderer::LambertParameters{0.12}, {}});
    s.sun.path = std::make_shared<Sunset>();
    s.camera = camera_at({1737400 + 500e3, 0, 0}, size, 0.002);
    return s;
}

Time frame_time(int frame) {
    return Time{frame * 500'000'000LL};
}

/// Rows [first, first + 24) of a frame.
std::vector<float> rows_of(const renderer::Renderer& r, int frame, std::int32_t first) {
    const std::vector<RowTime> times(24, RowTime{frame_time(frame), frame_time(frame)});
    renderer::RenderRequest request;
    request.window = {0, 0, size, size};
    request.first_row = first;
    request.rows = 24;
    request.row_times = times;
    request.common_mid = renderer::common_mid(times);
    request.frame_id = static_cast<std::uint64_t>(frame);
    std::vector<float> out(24 * size);
    r.render(request, out);
    return out;
}

void load_first(const renderer::Renderer& r) {
    const std::vector<RowTime> times(size);
    renderer::RenderRequest request;
    request.window = {0, 0, size, size};
    request.rows = size;
    request.row_times = times;
    REQUIRE(r.load_tiles(request, [](double) { return true; }));
}

double difference(const std::vector<float>& image, const std::vector<float>& truth) {
    double squares = 0, sum = 0;
    for (std::size_t k = 0; k < truth.size(); ++k) {
        const double d = static_cast<double>(image[k]) - static_cast<double>(truth[k]);
        squares += d * d;
        sum += static_cast<double>(truth[k]);
    }
    return std::sqrt(squares * static_cast<double>(truth.size())) / sum;
}

} // namespace

TEST_CASE("While the Sun moves its visibility is replaced between frames, never within one") {
    using namespace std::chrono_literals;
    const scene::Scene s = evening();
    renderer::RenderSettings settings{1, 2, 11};
    settings.wait_for_tiles = false;
    const renderer::Renderer moving(s, settings);
    settings.tiles_per_s = 1e-3;
    const renderer::Renderer starved(s, settings);
    load_first(moving);
    load_first(starved);
    const std::uint64_t loaded = moving.tiles_made(), kept = starved.tiles_made();

    constexpr int last = 60;
    int replaced_within = 0;
    for (int frame = 1; frame <= last; ++frame) {
        rows_of(moving, frame, 0);
        const std::uint64_t before = moving.tiles_made();
        const std::vector<float> once = rows_of(moving, frame, 40);
        for (int again = 0; again < 3; ++again) {
            std::this_thread::sleep_for(10ms);
            REQUIRE(once == rows_of(moving, frame, 40));
        }
        replaced_within += moving.tiles_made() > before ? 1 : 0;
        // Without a loader that gets anywhere frames are there all the same, with the visibility of before.
        rows_of(starved, frame, 0);
    }
    CHECK(replaced_within > 3);
    CHECK(moving.tiles_made() > loaded + 10);
    CHECK(starved.tiles_made() <= kept + 2);
    CHECK(starved.work().tiles_missed > 0);

    // The Sun of the last frame: what the loader has made is that of a renderer that waits.
    settings.wait_for_tiles = true;
    const std::vector<float> wanted = rows_of(renderer::Renderer(s, settings), last, 0);
    std::vector<float> image;
    std::uint64_t missed = 1;
    for (int attempt = 0; attempt < 6000 && missed > 0; ++attempt) {
        const renderer::RenderWork before = moving.work();
        image = rows_of(moving, last, 0);
        missed = (moving.work() - before).tiles_missed;
        std::this_thread::sleep_for(20ms);
    }
    CHECK(missed == 0);
    const double followed = difference(image, wanted), stale = difference(rows_of(starved, last, 0), wanted);
    CAPTURE(followed, stale);
    CHECK(followed < 0.03);
    CHECK(stale > 3 * followed);
}

} // namespace sun_replacement_test
