// SPDX-License-Identifier: Apache-2.0
#include "tools/irradiance/patch_table.hpp"

#include "renderer/received/receivers.hpp"
#include "tools/pictures/colour_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>

namespace obscura::tools {
namespace {

/// Adds a column for each band of values by patch and band.
void add_bands(const std::string& name, const std::vector<float>& values, std::size_t bands,
               PatchTable& out) {
    for (std::size_t b = 0; b < bands && !values.empty(); ++b) {
        PatchColumn column{bands > 1 ? fmt::format("{}_{}", name, b + 1) : name, "W m-2", {}};
        for (std::size_t k = b; k < values.size(); k += bands)
            column.values.push_back(values[k]);
        out.columns.push_back(std::move(column));
    }
}

/// Corners that patches share become one vertex.
void add_geometry(const renderer::Receivers& receivers, PatchTable& out) {
    std::map<std::tuple<double, double, double>, std::uint32_t> numbers;
    for (std::size_t patch = 0; patch < receivers.patches().size(); ++patch) {
        std::vector<std::uint32_t> face;
        for (const Vec3 corner : receivers.corners(patch)) {
            const auto [at, added] = numbers.try_emplace({corner.x, corner.y, corner.z},
                                                         static_cast<std::uint32_t>(out.vertices_m.size()));
            if (added) out.vertices_m.push_back(corner);
            face.push_back(at->second);
        }
        out.faces.push_back(std::move(face));
    }
}

} // namespace

PatchTable patch_table(const renderer::BodyReceivedLight& light) {
    PatchTable out;
    out.body = light.name;
    out.rows = light.receivers->rows();
    add_geometry(*light.receivers, out);
    const auto column = [&](const char* name, const char* unit, const auto& value) {
        PatchColumn made{name, unit, {}};
        for (const renderer::Patch& patch : light.receivers->patches())
            made.values.push_back(static_cast<float>(value(patch)));
        out.columns.push_back(std::move(made));
    };
    column("area_m2", "m2", [](const renderer::Patch& p) { return p.area_m2; });
    column("x_m", "m", [](const renderer::Patch& p) { return p.centre_m.x; });
    column("y_m", "m", [](const renderer::Patch& p) { return p.centre_m.y; });
    column("z_m", "m", [](const renderer::Patch& p) { return p.centre_m.z; });
    column("nx", "", [](const renderer::Patch& p) { return p.normal.x; });
    column("ny", "", [](const renderer::Patch& p) { return p.normal.y; });
    column("nz", "", [](const renderer::Patch& p) { return p.normal.z; });
    out.columns.push_back({"lit_share", "", light.lit_share});
    for (const auto& [cause, name] : enum_names(renderer::LightCause{}))
        add_bands(fmt::format("{}_w_m2", name), light.incident_w_m2[static_cast<std::size_t>(cause)],
                  light.bands, out);
    add_bands("absorbed_w_m2", light.absorbed_w_m2, light.bands, out);
    add_bands("radiosity_w_m2", light.radiosity_w_m2, light.bands, out);
    // Colours up to the 99th percentile: one bright patch leaves the others their contrast.
    std::vector<float> sums(light.receivers->patches().size());
    for (std::size_t k = 0; k < light.absorbed_w_m2.size(); ++k)
        sums[k / light.bands] += light.absorbed_w_m2[k];
    std::vector<float> sorted = sums;
    std::sort(sorted.begin(), sorted.end());
    const float full = sorted.empty() ? 0 : sorted[sorted.size() * 99 / 100];
    for (const float sum : sums)
        out.colours.push_back(colour(ColourMap::viridis, full > 0 ? sum / full : 0));
    return out;
}

} // namespace obscura::tools
