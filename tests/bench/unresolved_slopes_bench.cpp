// SPDX-License-Identifier: Apache-2.0
// Brightness of rough ground on cells far coarser than its roughness, with and without its slopes in its
// light, over that on cells far finer, as JSON on standard output. Options: --slope DEG, rms
// slope along a direction (10); --packets N, of 16 rays each (8192).
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "rough_ground.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

using namespace obscura;
using test::Geometry;
using test::RoughGround;

int main(int argc, char** argv) {
    double slope_deg = 10;
    int packets = 8192;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::strcmp(argv[i], "--slope") == 0) slope_deg = std::atof(argv[i + 1]);
        if (std::strcmp(argv[i], "--packets") == 0) packets = std::atoi(argv[i + 1]);
    }
    struct Law {
        const char* name;
        std::unique_ptr<renderer::Material> material;
    };
    std::vector<Law> laws;
    renderer::HapkeParameters hapke;
    hapke.single_scattering_albedo = 0.3;
    hapke.roughness_rad = 0;
    hapke.shadow_hiding_b0 = hapke.backscatter_b0 = 0;
    laws.push_back({"hapke", std::make_unique<renderer::Hapke>(hapke)});
    laws.push_back({"lambert", std::make_unique<renderer::Lambert>(renderer::LambertParameters{0.5})});
    const RoughGround fine(slope_deg, RoughGround::fine_level, false),
        coarse(slope_deg, RoughGround::coarse_level, false),
        facets(slope_deg, RoughGround::coarse_level, true);
    std::puts("[");
    const char* comma = "";
    for (const Law& law : laws)
        for (const Geometry at : {Geometry{0, 0, 0},
                                  {0, 60, 0},
                                  {30, 0, 0},
                                  {30, 30, 0},
                                  {30, 60, 0},
                                  {30, 60, 180},
                                  {60, 0, 0},
                                  {60, 30, 0},
                                  {60, 30, 180},
                                  {60, 60, 0},
                                  {60, 60, 90},
                                  {60, 60, 180},
                                  {75, 0, 0},
                                  {75, 60, 0},
                                  {75, 60, 180},
                                  {82, 0, 0},
                                  {82, 60, 180}}) {
            const RoughGround::Mean truth = fine.reflectance(*law.material, at, packets);
            const double without = coarse.reflectance(*law.material, at, 64).value,
                         with = facets.reflectance(*law.material, at, 64).value;
            std::printf(
                "%s{\"law\": \"%s\", \"incidence_deg\": %g, \"emission_deg\": %g, \"azimuth_deg\": %g, "
                "\"resolved\": %.5f, \"standard_error\": %.5f, \"without\": %.4f, \"with\": %.4f}",
                comma, law.name, at.incidence_deg, at.emission_deg, at.azimuth_deg, truth.value, truth.error,
                without / truth.value, with / truth.value);
            std::fflush(stdout);
            comma = ",\n";
        }
    std::puts("\n]");
}
