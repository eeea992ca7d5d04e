// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/stand_ins.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace obscura::serve::compatible {
namespace {

std::string last_part(const std::string& name) {
    return name.substr(name.find_last_of('/') + 1);
}

} // namespace

std::optional<nlohmann::json> stand_in_mesh(const std::string& name) {
    const std::string file = last_part(name);
    if (!file.starts_with("itokawa") || !file.ends_with(".obj")) return {};
    // Axes 535, 294 and 209 m (Fujiwara et al., Science 312, 2006).
    return nlohmann::json{
        {"shape", "procedural"}, {"mean_radius_m", 160}, {"axis_ratios", {1.0, 0.55, 0.39}}};
}

std::optional<DemFile> stand_in_dem(const std::string& name) {
    const std::string file = last_part(name);
    // Radii in metres: IAU WGCCRE 2015.
    if (file == "FullMoon.dem")
        return DemFile::parse(
            "A_AXIS_RADIUS = 1737400;\nB_AXIS_RADIUS = 1737400;\nC_AXIS_RADIUS = 1737400;\n", file);
    if (file == "Ceres_Dawn.dem")
        return DemFile::parse("A_AXIS_RADIUS = 487300;\nB_AXIS_RADIUS = 487300;\nC_AXIS_RADIUS = 446000;\n",
                              file);
    return {};
}

bool is_program_texture(const std::string& name) {
    constexpr std::array<std::string_view, 5> names{"earth.jpg", "moon.jpg", "default.png",
                                                    "Ceres_texture.big",
                                                    "Kaguya_MI_refl_b2_750nm_global_128ppd.big"};
    return std::find(names.begin(), names.end(), last_part(name)) != names.end();
}

} // namespace obscura::serve::compatible
