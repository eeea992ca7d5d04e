// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/boulders.hpp"

#include "core/philox.hpp"
#include "terrain/detail/exact_math.hpp"
#include "terrain/detail/grid_block.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::terrain {
namespace {

constexpr std::uint32_t boulder_stream = 2;
constexpr double min_height = 0.2, largest_height = 0.45; ///< of the diameter
constexpr double min_boulder_cells = 3;
/// Half the shortest axis of a rock.
constexpr double half_thickness = 0.25; ///< of the diameter

/// Ejecta count to so many radii, of craters at least so many times as large as the boulder.
constexpr double ejecta_radii = 4, ejecta_sizes = 16;
constexpr double ejecta_fall = 0.7; ///< radii
constexpr double gone_ga = 0.3;

std::vector<FeatureOctave> boulder_octaves(const Boulders::Settings& settings, bool ejecta) {
    std::vector<FeatureOctave> octaves;
    const double most = settings.per_m2 * (ejecta ? 1 + settings.ejecta : 1);
    const auto count = [&](double diameter) { return most * exact_pow(diameter, -settings.index); };
    if (!(settings.min_diameter_m < settings.largest_diameter_m)) return octaves;
    const int first = static_cast<int>(std::floor(exact_log2(settings.min_diameter_m)));
    const int last = static_cast<int>(std::ceil(exact_log2(settings.largest_diameter_m))) - 1;
    for (int exponent = first; exponent <= last; ++exponent) {
        const double low = std::ldexp(1.0, exponent);
        octaves.push_back({exponent, count(low) - count(2 * low), low});
    }
    return octaves;
}

} // namespace

Boulders::Boulders(const SurfaceDomain& domain, const Settings& settings, std::uint64_t seed,
                   std::shared_ptr<const Craters> craters)
    : plane_(domain.is_plane()),
      settings_(settings),
      craters_(std::move(craters)),
      field_(domain, seed, boulder_stream, boulder_octaves(settings, craters_ != nullptr)) {}

double Boulders::diameter_m(const Feature& feature) const {
    // N(>D) within the octave, from that of twice the smallest to that of the smallest.
    const double few = exact_exp2(-settings_.index);
    const double left = few + uniform_double(feature.random[0]) * (1 - few);
    return std::ldexp(1.0, field_.octaves()[feature.octave].exponent) * exact_pow(left, -1 / settings_.index);
}

bool Boulders::stands(const Feature& feature, std::span<const Crater> around) const {
    if (craters_ == nullptr) return true;
    const double least = std::ldexp(ejecta_sizes, field_.octaves()[feature.octave].exponent);
    double more = 0;
    for (const Crater& crater : around) {
        const double radius = crater.diameter_m / 2;
        const double square = length_squared(feature.position_m - crater.position_m) / (radius * radius);
        if (crater.diameter_m < least || square > ejecta_radii * ejecta_radii) continue;
        const double r = std::sqrt(square);
        const double fresh = 1 - crater.age_ga / gone_ga;
        more = std::max(more, fresh * exact_exp(-std::max(0.0, r - 1) / ejecta_fall));
    }
    return uniform_double(feature.random[1]) * (1 + settings_.ejecta) <= 1 + settings_.ejecta * more;
}

void Boulders::find_features(FeatureSearch& search) const {
    // Craters around are looked for once for so many cells along an edge.
    constexpr int together = 4;
    std::pmr::vector<Crater> around(&search.memory());
    const auto wants = [&](TileKey square, std::size_t octave, int finer) {
        const double low = std::ldexp(1.0, field_.octaves()[octave].exponent);
        if (!search.wants(square, 2 * low)) return false;
        if (craters_ != nullptr && (finer == together || (finer < together && square.level == 0))) {
            around.clear();
            craters_->add_young(cap_of(field_.domain(), square), ejecta_sizes * low, gone_ga, ejecta_radii,
                                around);
        }
        return true;
    };
    field_.visit(0, field_.octaves().size(), wants, [&](const Feature& feature) {
        const double diameter = diameter_m(feature);
        if (exists(diameter) && search.wants(feature.position_m, diameter) && stands(feature, around))
            search.add({FeatureKind::boulder, feature.id, feature.position_m, diameter});
    });
}

double Boulders::share_left(const SurfaceFeature& feature, double sample_spacing_m) const {
    return Craters::share(feature.diameter_m, sample_spacing_m);
}

double Boulders::Dome::profile(Vec3 way_m) const {
    const double x = dot(way_m, along), y = dot(way_m, across);
    const double square = x * x + y * y;
    return square < 1 ? std::sqrt(1 - square) : 0;
}

std::vector<Boulders::Dome> Boulders::domes(const Cap& cap, double min_diameter_m) const {
    const std::vector<FeatureOctave>& octaves = field_.octaves();
    std::size_t first = 0;
    while (first < octaves.size() && std::ldexp(2.0, octaves[first].exponent) <= min_diameter_m)
        ++first;
    std::vector<Dome> made;
    if (first == octaves.size()) return made;
    std::vector<Feature> features;
    field_.near(cap, first, octaves.size(), features);
    std::vector<Crater> around;
    if (craters_ != nullptr && !features.empty()) {
        const double reach = cap.radius_m + octaves.back().reach_m;
        around = craters_->near({cap.centre_m, reach}, std::ldexp(ejecta_sizes, octaves[first].exponent),
                                ejecta_radii);
        std::erase_if(around, [](const Crater& crater) { return crater.age_ga >= gone_ga; });
    }
    for (const Feature& feature : features) {
        const double diameter = diameter_m(feature);
        if (diameter < min_diameter_m || !exists(diameter)) continue;
        const double limit = cap.radius_m + diameter / 2;
        if (length_squared(feature.position_m - cap.centre_m) > limit * limit) continue;
        if (!stands(feature, around)) continue;
        Dome dome;
        const double share = uniform_double(feature.random[2] << 16);
        dome.boulder = {feature.id, feature.position_m, diameter,
                        diameter * (min_height + share * (largest_height - min_height))};
        // Two directions along the ground, by a point within the unit disc.
        const Vec3 up =
            plane_ ? Vec3{0, 0, 1} : feature.position_m / std::sqrt(length_squared(feature.position_m));
        Vec3 u, v;
        orthonormal_basis(up, u, v);
        double x = 2 * uniform_double(feature.random[2]) - 1, y = 2 * uniform_double(feature.random[3]) - 1;
        const double norm = std::sqrt(x * x + y * y);
        x = norm > 1e-6 ? x / norm : 1;
        y = norm > 1e-6 ? y / norm : 0;
        dome.along = (x * u + y * v) * (2 / diameter);
        dome.across = (x * v - y * u) * (2 * std::numbers::sqrt2 / diameter);
        dome.form = feature.random[3] & 0xffffu;
        made.push_back(dome);
    }
    return made;
}

void Boulders::apply(const VertexGrid& grid, std::span<double> heights_m,
                     std::span<double> sample_spacings_m) const {
    const std::vector<Dome> all = domes(grid.cap, min_boulder_cells * grid.spacing_m);
    if (all.empty()) return;
    std::vector<double> highest(heights_m.size());
    const auto [finest, coarsest] = std::minmax_element(sample_spacings_m.begin(), sample_spacings_m.end());
    constexpr int edge = 16;
    std::vector<GridBlock> blocks;
    for (int j = 0; j < tile_edge; j += edge)
        for (int i = 0; i < tile_edge; i += edge)
            blocks.emplace_back(grid.positions_m, i, j, edge);
    for (const Dome& dome : all) {
        const Boulder& boulder = dome.boulder;
        const double height = top_m(boulder, grid.spacing_m);
        // Samples that are finer than a boulder have the real ones.
        if (height == 0 || Craters::share(boulder.diameter_m, *coarsest) == 0) continue;
        const bool whole = Craters::share(boulder.diameter_m, *finest) == 1;
        const double radius = boulder.diameter_m / 2;
        for (const GridBlock& block : blocks) {
            if (!block.touches(boulder.position_m, radius)) continue;
            for (int j = block.j0; j < block.j1; ++j)
                for (int i = block.i0; i < block.i1; ++i) {
                    const std::size_t n = GridBlock::index(i, j);
                    const Vec3 way = grid.positions_m[n] - boulder.position_m;
                    if (!(length_squared(way) < radius * radius)) continue;
                    const double share = whole ? 1 : Craters::share(boulder.diameter_m, sample_spacings_m[n]);
                    highest[n] = std::max(highest[n], share * (height * dome.profile(way)));
                }
        }
    }
    for (std::size_t n = 0; n < heights_m.size(); ++n)
        heights_m[n] += highest[n];
}

double Boulders::top_m(const Boulder& boulder, double spacing_m) const {
    if (is_rock(boulder, spacing_m)) return 0;
    return boulder.height_m * smooth_step((boulder.diameter_m / spacing_m - min_boulder_cells) /
                                          (whole_cells - min_boulder_cells));
}

double Boulders::above_ground_m(Vec3 vertex_m, double spacing_m) const {
    double highest = 0;
    for (const Dome& dome : domes({vertex_m, 0}, min_boulder_cells * spacing_m))
        highest = std::max(highest,
                           top_m(dome.boulder, spacing_m) * dome.profile(vertex_m - dome.boulder.position_m));
    return highest;
}

bool Boulders::is_rock(const Boulder& boulder, double spacing_m) const {
    return settings_.rock_cells > 0 && boulder.height_m > half_thickness * boulder.diameter_m &&
           boulder.diameter_m >= settings_.rock_cells * spacing_m;
}

void Boulders::add_rocks(TileKey tile, std::vector<StandingRock>& rocks) const {
    if (!(settings_.rock_cells > 0)) return;
    const SurfaceDomain& domain = field_.domain();
    const double spacing = domain.spacing_m(tile.level), least = settings_.rock_cells * spacing;
    if (least > settings_.largest_diameter_m) return;
    for (const Dome& dome : domes(cap_of(domain, tile), least)) {
        const Boulder& boulder = dome.boulder;
        const bool of_parent = tile.level > 0 && is_rock(boulder, 2 * spacing);
        if (of_parent || !is_rock(boulder, spacing) ||
            SurfaceDomain::tile_at(domain.place_of(boulder.position_m), tile.level) != tile)
            continue;
        const double half = boulder.diameter_m / 2;
        rocks.push_back({boulder.id,
                         boulder.position_m,
                         dome.along * half,
                         dome.across * (half / std::numbers::sqrt2),
                         {half, half / std::numbers::sqrt2, half_thickness * boulder.diameter_m},
                         boulder.height_m,
                         dome.form});
    }
}

HeightRange Boulders::range(const Cap& cap, double /*spacing_m*/, HeightRange below) const {
    HeightRange result = below;
    double highest = 0;
    // Boulders that are small in the cap are not looked at.
    const double least = cap.radius_m / 8;
    for (const FeatureOctave& octave : field_.octaves())
        if (std::ldexp(1.0, octave.exponent) < least)
            highest = std::max(highest, std::ldexp(2 * largest_height, octave.exponent));
    highest = std::min(highest, largest_height * settings_.largest_diameter_m);
    for (const Dome& dome : domes(cap, least))
        highest = std::max(highest, dome.boulder.height_m);
    result.largest += highest;
    return result;
}

std::vector<Boulder> Boulders::near(const Cap& cap, double min_diameter_m) const {
    std::vector<Boulder> boulders;
    for (const Dome& dome : domes(cap, min_diameter_m))
        boulders.push_back(dome.boulder);
    return boulders;
}

} // namespace obscura::terrain
