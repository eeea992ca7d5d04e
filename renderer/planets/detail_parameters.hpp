// SPDX-License-Identifier: Apache-2.0
// Keys of procedural detail of a planet or terrain, and the height layers that are made from them.
#pragma once

#include "config/section.hpp"
#include "terrain/detail/boulders.hpp"
#include "terrain/detail/craters.hpp"
#include "terrain/detail/slope_table.hpp"
#include "terrain/height_layer.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace obscura::renderer {

/// What the slopes of the noise follow.
enum class DetailTerrain : std::uint8_t { none, highlands, maria, mars, rubble_pile, own };
constexpr auto enum_names(DetailTerrain /*type*/) {
    using D = DetailTerrain;
    return std::array{
        EnumName{D::none, "none"}, EnumName{D::highlands, "highlands"},     EnumName{D::maria, "maria"},
        EnumName{D::mars, "mars"}, EnumName{D::rubble_pile, "rubble_pile"}, EnumName{D::own, "own"}};
}

struct DetailParameters {
    DetailTerrain terrain = DetailTerrain::none;
    std::vector<double> baselines_m, slopes_deg; ///< of an own table
    double hurst = 0;                            ///< of an own table of one slope; 0: none
    std::uint64_t seed = 1;
    double crater_age_ga = 0; ///< 0: no craters
    double crater_least_m = 1, crater_largest_m = terrain::CraterLaw::largest_diameter_m;
    double boulders_per_m2 = 0; ///< N(>1 m); 0: no boulders
    double boulder_index = 2.482, boulder_least_m = 0.2, boulder_largest_m = 10, boulder_ejecta = 20;
    double boulder_rock_px = 16;    ///< from which those that overhang are rocks; 0: none
    double truth_least_px = 8;      ///< of craters and boulders that the truth of frames lists
    std::uint32_t truth_most = 100; ///< of those
};

/// The table [body.detail]; `detail` must outlive it.
[[nodiscard]] config::Section detail_section(DetailParameters& detail);

/// All values, as text: the same text makes the same surface.
[[nodiscard]] std::string identity_of(DetailParameters detail);

/// Layers of procedural detail; `craters` and `boulders` are among them, or null.
struct DetailLayers {
    std::vector<std::shared_ptr<const terrain::HeightLayer>> layers;
    std::shared_ptr<const terrain::Craters> craters;
    std::shared_ptr<const terrain::Boulders> boulders;
};
/// From the lowest upwards; `over_maps`: above layers of samples; `rock_cells`: see Boulders::Settings.
[[nodiscard]] DetailLayers make_detail(const DetailParameters& detail, const terrain::SurfaceDomain& domain,
                                       bool over_maps, double rock_cells = 0);

} // namespace obscura::renderer
