// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/detail_parameters.hpp"

#include "core/units.hpp"
#include "terrain/detail/octaves.hpp"

#include <fmt/format.h>

#include <functional>

namespace obscura::renderer {
namespace {

config::Keys keys_of(DetailParameters& d) {
    return {
        config::key("terrain", &d.terrain)
            .help(
                "Class of terrain whose table of slopes the noise follows: the Moon's highlands or maria, Mars, a rubble pile, the own table of baselines_m and slopes_deg, or no noise"),
        config::key("baselines_m", &d.baselines_m)
            .unit("m")
            .range(1e-3, 1e9)
            .help("Baselines of the own table, rising"),
        config::key("slopes_deg", &d.slopes_deg)
            .unit("deg")
            .range(1e-6, 60)
            .help(
                "Rms slope over each of the baselines: the arc tangent of the rms difference of heights at that distance over the distance"),
        config::key("hurst", &d.hurst)
            .range(0, 1)
            .help(
                "Hurst exponent of an own table of one slope: the rms difference of heights grows with this power of the distance, up to a quarter of the body's radius; "
                "0: none"),
        config::key("seed", &d.seed).help("Another number gives another surface of the same kind"),
        config::key("crater_age_ga", &d.crater_age_ga)
            .unit("Ga")
            .range(0, 4.5)
            .help(
                "Age of the surface, which has the Moon's craters of that time, fresh and worn, not more than equilibrium allows; "
                "0: no craters. Noise makes the part of the slopes that craters leave"),
        config::key("crater_least_m", &d.crater_least_m)
            .unit("m")
            .range(0.01, 1e6)
            .help("Diameter of the smallest craters"),
        config::key("crater_largest_m", &d.crater_largest_m)
            .unit("m")
            .range(0.01, terrain::CraterLaw::largest_diameter_m)
            .help(
                "Diameter of the largest craters, at most a third of the least radius, or of half the edge of a plane"),
        config::key("boulders_per_m2", &d.boulders_per_m2)
            .unit("1/m2")
            .range(0, 10)
            .help(
                "Boulders larger than 1 m on a square metre away from young craters (the Moon: 1e-4 to 2e-3); 0: none"),
        config::key("boulder_index", &d.boulder_index)
            .range(1, 6)
            .help(
                "Index of the sizes of boulders: the number larger than D goes with D to minus this power (the Moon 1.8 to 2.7, Ryugu 2.65, Itokawa 3.1)"),
        config::key("boulder_least_m", &d.boulder_least_m)
            .unit("m")
            .range(0.01, 1000)
            .help("Longest axis of the smallest boulders"),
        config::key("boulder_largest_m", &d.boulder_largest_m)
            .unit("m")
            .range(0.01, 1000)
            .help("Longest axis of the largest boulders"),
        config::key("boulder_ejecta", &d.boulder_ejecta)
            .range(0, 1000)
            .help("Boulders at the rim of a crater that was just made, over those elsewhere, less 1; "
                  "fewer with the distance and with the age of the crater, up to 0.3 Ga"),
        config::key("boulder_rock_px", &d.boulder_rock_px)
            .unit("px")
            .range(0, 1e6)
            .help(
                "Size in the picture from which a boulder that overhangs is a rock that stands on the ground, with a form of its own, instead of a dome in the surface; "
                "from a quarter of it on for more and more of the samples. 0: all are domes"),
        config::key("truth_least_px", &d.truth_least_px)
            .unit("px")
            .range(3, 1e6)
            .help(
                "Craters and boulders of at least this diameter in the picture are listed in its truth table (docs/truth.md)"),
        config::key("truth_most", &d.truth_most)
            .range(0, 4096)
            .help("Largest number of features in the truth table, biggest first; 0: none"),
    };
}

void check(const DetailParameters& d, const config::ReadTable& table) {
    const bool own = d.terrain == DetailTerrain::own;
    for (const char* key : {"baselines_m", "slopes_deg", "hurst"})
        if (table.has(key) && !own) table.refuse(key, "goes with terrain = \"own\"");
    if (own && d.baselines_m.empty()) table.refuse("terrain", "\"own\" wants baselines_m and slopes_deg");
    if (d.baselines_m.size() != d.slopes_deg.size())
        table.refuse("slopes_deg",
                     fmt::format("{} slopes for {} baselines", d.slopes_deg.size(), d.baselines_m.size()));
    for (std::size_t n = 1; n < d.baselines_m.size(); ++n)
        if (!(d.baselines_m[n] > d.baselines_m[n - 1])) {
            table.refuse("baselines_m", fmt::format("{} after {}: allowed are rising baselines",
                                                    d.baselines_m[n], d.baselines_m[n - 1]));
            break;
        }
    if (d.hurst > 0 && d.baselines_m.size() > 1)
        table.refuse("hurst", fmt::format("goes with one slope, there are {}", d.baselines_m.size()));
    for (const char* key : {"crater_least_m", "crater_largest_m"})
        if (table.has(key) && !(d.crater_age_ga > 0)) table.refuse(key, "goes with crater_age_ga above 0");
    for (const char* key :
         {"boulder_index", "boulder_least_m", "boulder_largest_m", "boulder_ejecta", "boulder_rock_px"})
        if (table.has(key) && !(d.boulders_per_m2 > 0))
            table.refuse(key, "goes with boulders_per_m2 above 0");
    if (d.boulder_least_m >= d.boulder_largest_m)
        table.refuse("boulder_least_m", fmt::format("{}: allowed is less than boulder_largest_m, {}",
                                                    d.boulder_least_m, d.boulder_largest_m));
    if (d.crater_least_m >= d.crater_largest_m)
        table.refuse("crater_least_m", fmt::format("{}: allowed is less than crater_largest_m, {}",
                                                   d.crater_least_m, d.crater_largest_m));
}

terrain::SlopeTable slopes_of(const DetailParameters& d, const terrain::SurfaceDomain& domain) {
    using terrain::SlopeTable;
    using terrain::TerrainClass;
    switch (d.terrain) {
    case DetailTerrain::maria:
        return SlopeTable::of_class(TerrainClass::maria);
    case DetailTerrain::mars:
        return SlopeTable::of_class(TerrainClass::mars);
    case DetailTerrain::rubble_pile:
        return SlopeTable::of_class(TerrainClass::rubble_pile);
    case DetailTerrain::own:
        break;
    default:
        return SlopeTable::of_class(TerrainClass::highlands);
    }
    std::vector<terrain::BaselineSlope> entries;
    for (std::size_t n = 0; n < d.baselines_m.size(); ++n)
        entries.push_back({d.baselines_m[n], d.slopes_deg[n] * degree});
    if (d.hurst > 0)
        return SlopeTable::of_hurst(entries.front(), d.hurst,
                                    domain.spacing_m(0) * (terrain::tile_cells / 8.0));
    return SlopeTable(entries);
}

} // namespace

config::Section detail_section(DetailParameters& detail) {
    config::Section section{
        "detail",
        "Procedural detail of a planet or terrain between and below the samples of its height maps, or on its bare reference surface: noise, craters and boulders, by position and seed."};
    section.keys = keys_of(detail);
    section.check = [&detail](const config::ReadTable& table) { check(detail, table); };
    return section;
}

std::string identity_of(DetailParameters detail) {
    return config::print_keys(keys_of(detail));
}

DetailLayers make_detail(const DetailParameters& detail, const terrain::SurfaceDomain& domain, bool over_maps,
                         double rock_cells) {
    DetailLayers made;
    std::function<double(double)> made_m2;
    if (detail.crater_age_ga > 0) {
        const terrain::Craters::Settings settings{detail.crater_age_ga, detail.crater_least_m,
                                                  detail.crater_largest_m};
        made.craters = std::make_shared<terrain::Craters>(domain, settings, detail.seed, over_maps);
        made_m2 = [&craters = *made.craters](double baseline_m) { return craters.deviation_m2(baseline_m); };
    }
    if (detail.terrain != DetailTerrain::none)
        made.layers.push_back(std::make_shared<terrain::Octaves>(domain, slopes_of(detail, domain),
                                                                 detail.seed, over_maps, made_m2));
    if (made.craters) made.layers.push_back(made.craters);
    if (detail.boulders_per_m2 > 0) {
        const terrain::Boulders::Settings settings{detail.boulders_per_m2, detail.boulder_index,
                                                   detail.boulder_least_m, detail.boulder_largest_m,
                                                   detail.boulder_ejecta,  rock_cells};
        made.boulders = std::make_shared<terrain::Boulders>(domain, settings, detail.seed, made.craters);
        made.layers.push_back(made.boulders);
    }
    return made;
}

} // namespace obscura::renderer
