// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "renderer/planets/detail_parameters.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/renderer/terrain_support.hpp"
#include "tests/unit/terrain/made_tiles.hpp"

namespace detail_parameters_test {

using namespace obscura;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

const std::string planet =
    "[[body]]\nshape = \"planet\"\nradii_m = [2e5, 2e5, 2e5]\nalbedo = 0.1\n[body.detail]\n";

renderer::DetailParameters read(const test::TempFolder& folder, const std::string& keys) {
    const scene::Scene scene = scene::load_scene(folder.write("s.toml", planet + keys));
    return scene.bodies[0].shape.get<renderer::PlanetParameters>().relief.detail;
}

std::string refusal(const std::string& keys) {
    const test::TempFolder folder;
    try {
        (void)read(folder, keys);
    } catch (const Error& error) {
        const std::string line = error.what();
        CHECK(line.find('\n') == std::string::npos);
        return line.substr(line.find("s.toml"));
    }
    return "accepted";
}

} // namespace

TEST_CASE("Detail of planets is a table of their body") {
    const test::TempFolder folder;
    const renderer::DetailParameters own =
        read(folder, "terrain = \"own\"\nbaselines_m = [1, 100]\nslopes_deg = [10, 5]\nseed = 9\n"
                     "crater_age_ga = 3.5\nboulders_per_m2 = 1e-3\n");
    CHECK(own.terrain == renderer::DetailTerrain::own);
    CHECK(own.baselines_m == std::vector<double>{1, 100});
    CHECK(own.seed == 9);
    CHECK(own.crater_age_ga == 3.5);
    const terrain::SurfaceDomain domain = terrain::SurfaceDomain::ellipsoid({2e5, 2e5, 2e5});
    CHECK(renderer::make_detail(own, domain, false).layers.size() == 3);
    CHECK(renderer::make_detail({}, domain, false).layers.empty());
    renderer::DetailParameters other = own;
    CHECK(renderer::identity_of(other) == renderer::identity_of(own));
    other.slopes_deg[1] = 6;
    CHECK(renderer::identity_of(other) != renderer::identity_of(own));

    CHECK(refusal("terrain = \"own\"\n") ==
          "s.toml:6:11: body[0].detail.terrain: \"own\" wants baselines_m and slopes_deg");
    CHECK(refusal("terrain = \"own\"\nbaselines_m = [1, 2]\nslopes_deg = [3]\n") ==
          "s.toml:8:14: body[0].detail.slopes_deg: 1 slopes for 2 baselines");
    CHECK(refusal("terrain = \"own\"\nbaselines_m = [2, 1]\nslopes_deg = [3, 4]\n") ==
          "s.toml:7:15: body[0].detail.baselines_m: 1 after 2: allowed are rising baselines");
    CHECK(refusal("terrain = \"maria\"\nhurst = 0.7\n") ==
          "s.toml:7:9: body[0].detail.hurst: goes with terrain = \"own\"");
    CHECK(refusal("crater_least_m = 3\n") ==
          "s.toml:6:18: body[0].detail.crater_least_m: goes with crater_age_ga above 0");
    CHECK(refusal("boulder_index = 3\n") ==
          "s.toml:6:17: body[0].detail.boulder_index: goes with boulders_per_m2 above 0");
    CHECK(refusal("boulder_rock_px = 8\n") ==
          "s.toml:6:19: body[0].detail.boulder_rock_px: goes with boulders_per_m2 above 0");
    CHECK_THAT(refusal("terrain = \"sea\"\n"), ContainsSubstring("s.toml:6:11: body[0].detail.terrain"));
    CHECK_THAT(refusal("crater_age_ga = 5\n"),
               ContainsSubstring("s.toml:6:17: body[0].detail.crater_age_ga"));
}

TEST_CASE("Rays meet the detail of a planet where its layers have it") {
    renderer::DetailParameters detail;
    detail.terrain = renderer::DetailTerrain::highlands;
    detail.crater_age_ga = 4;
    const double radius_m = 2e5;
    const terrain::SurfaceDomain domain = terrain::SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m});
    const auto layers = renderer::make_detail(detail, domain, false).layers;
    constexpr int level = 4;
    const renderer::TerrainShape shape(domain, layers, test::at_level(level));
    std::vector<const terrain::HeightLayer*> bare;
    for (const auto& layer : layers)
        bare.push_back(layer.get());
    double highest = 0;
    for (const terrain::TileKey key : {terrain::TileKey{0, level, 7, 9}, terrain::TileKey{5, level, 0, 15}}) {
        const terrain::MadeTile tile = terrain::make_tile(domain, key, bare);
        for (int n = 3; n < 250; n += 19) {
            const Vec3 p = tile.position(n, 253 - n), up = normalized(p);
            const double height = tile.at(n, 253 - n);
            CHECK_THAT(3 * radius_m - test::distance_to(shape, 3 * radius_m * up, -up),
                       WithinAbs(radius_m + height, 0.1));
            highest = std::max(highest, std::abs(height));
        }
    }
    CHECK(highest > 100);
}

} // namespace detail_parameters_test
