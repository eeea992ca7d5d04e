// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/craters.hpp"

#include "core/philox.hpp"
#include "terrain/detail/exact_math.hpp"
#include "terrain/detail/grid_block.hpp"
#include "terrain/detail/sample_spacing.hpp"
#include "terrain/detail/stamp_kernel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace obscura::terrain {
namespace {

/// `place`: of 0 to before steps.
double between_steps(const CraterProfile& profile, double place) {
    const auto step = static_cast<std::size_t>(place);
    return profile[step] + (place - static_cast<double>(step)) * (profile[step + 1] - profile[step]);
}

constexpr double steps_per_square = CraterProfiles::steps / CraterProfiles::reach_squared;

constexpr std::uint32_t crater_stream = 1;

/// Vertices across a crater below which it is left out, and from which it is whole.
constexpr double min_crater_cells = 3, whole_cells = 6;

/// Squared distance, in radii, up to which a crater removes what was there, and from which nothing.
constexpr double removed_squared = 0.9, kept_squared = 1.7;

/// Share of a crater that a grid of that spacing has.
double whole(double diameter_m, double spacing_m) {
    return smooth_step((diameter_m / spacing_m - min_crater_cells) / (whole_cells - min_crater_cells));
}

/// Share that is removed at a squared distance, in radii.
double removed(double square) {
    return smooth_step((kept_squared - square) / (kept_squared - removed_squared));
}

/// Octave sums over single profiles: rims of several craters may lie on each other.
constexpr double deepest_sum = 1.3, highest_sum = 2.5;

/// Share of craters that is added over samples, by the logarithms of diameter and distance of samples.
double share_between(double log2_diameter, double log2_spacing) {
    return 1 - smooth_step((log2_diameter - log2_spacing - 1) / 1.5);
}

double largest_allowed(const SurfaceDomain& domain) {
    if (domain.is_plane()) return domain.half_edge_m() / 3;
    const Vec3 r = domain.radii_m();
    return std::min({r.x, r.y, r.z}) / 3;
}

std::vector<FeatureOctave> crater_octaves(const CraterLaw& law, double min_m, double largest_m) {
    std::vector<FeatureOctave> octaves;
    if (!(min_m < largest_m)) return octaves;
    const int first = static_cast<int>(std::floor(exact_log2(min_m)));
    const int last = static_cast<int>(std::ceil(exact_log2(largest_m))) - 1;
    for (int exponent = first; exponent <= last; ++exponent) {
        const double low = std::ldexp(1.0, exponent), high = 2 * low;
        octaves.push_back({exponent, law.per_m2(low) - law.per_m2(high), CraterProfiles::reach * low});
    }
    return octaves;
}

} // namespace

Craters::Craters(const SurfaceDomain& domain, const Settings& settings, std::uint64_t seed, bool over_maps)
    : over_maps_(over_maps),
      min_diameter_m_(settings.min_diameter_m),
      largest_diameter_m_(
          std::min({settings.largest_diameter_m, largest_allowed(domain), CraterLaw::largest_diameter_m})),
      law_(settings.age_ga),
      field_(domain, seed, crater_stream, crater_octaves(law_, min_diameter_m_, largest_diameter_m_)) {
    for (const FeatureOctave& octave : field_.octaves()) {
        const double low = std::ldexp(1.0, octave.exponent), high = 2 * low;
        OctaveLaw law{
            low, {}, law_.oldest(low), law_.oldest(high), crater_diffusivity(low), crater_diffusivity(high)};
        for (std::size_t n = 0; n <= OctaveLaw::nodes; ++n) {
            const double count = law_.per_m2(low * exact_exp2(static_cast<double>(n) / OctaveLaw::nodes));
            // Beyond the law's largest diameter there is practically none.
            law.log2_counts[n] = count > 0 ? exact_log2(count / law_.per_m2(low)) : -60;
        }
        laws_.push_back(law);
        // Small ones are worn most.
        profiles_.emplace_back(low * std::numbers::sqrt2, wear(laws_.size() - 1, low, law_.oldest(low)));
        const std::size_t number = laws_.size() - 1;
        const auto structure = [&](double distance) {
            return octave_deviation_m2(number, distance * low) / (low * low);
        };
        losses_.emplace_back(structure, domain.spacing_m(0));
    }
}

bool Craters::older(const Stamp& a, const Stamp& b) {
    return a.chronology != b.chronology ? a.chronology > b.chronology : a.feature.id < b.feature.id;
}

double Craters::wear(std::size_t octave, double diameter_m, double chronology) const {
    const OctaveLaw& law = laws_[octave];
    const double part = diameter_m / law.low_m - 1, radius = diameter_m / 2;
    const double diffusivity = law.diffusivity_low + part * (law.diffusivity_high - law.diffusivity_low);
    return diffusivity * 1000 * law_.age_of(chronology) / (radius * radius);
}

double Craters::wear(const Stamp& stamp) const {
    return wear(stamp.feature.octave, stamp.diameter_m, stamp.chronology);
}

Craters::Stamp Craters::stamp_of(const Feature& feature) const {
    // Between the nodes N(>D) is taken for a power of D, within the octave ages for linear in D.
    const OctaveLaw& law = laws_[feature.octave];
    const double few = law.log2_counts.back();
    // log2 of N(>D) / N(>low), even in N.
    const double count = exact_log2(1 - uniform_double(feature.random[0]) * (1 - exact_exp2(few)));
    std::size_t n = 1;
    while (n + 1 < law.log2_counts.size() && count < law.log2_counts[n])
        ++n;
    const double above = law.log2_counts[n - 1], under = law.log2_counts[n];
    const double place = static_cast<double>(n - 1) + std::min((above - count) / (above - under), 1.0);
    Stamp stamp;
    stamp.feature = feature;
    stamp.diameter_m = law.low_m * exact_exp2(place / OctaveLaw::nodes);
    const double part = stamp.diameter_m / law.low_m - 1;
    stamp.chronology =
        (law.oldest_low + part * (law.oldest_high - law.oldest_low)) * uniform_double(feature.random[1]);
    return stamp;
}

double Craters::share(double diameter_m, double sample_spacing_m) {
    return share_between(exact_log2(diameter_m), log2_spacing(sample_spacing_m));
}

double Craters::octave_share(std::size_t octave, double log2_spacing) const {
    return share_between(field_.octaves()[octave].exponent + 0.5, log2_spacing);
}

HeightRange Craters::clamp_of(std::size_t octave) const {
    const double diameter = std::ldexp(2.0, field_.octaves()[octave].exponent);
    return {deepest_sum * profiles_[octave].least() * diameter,
            highest_sum * profiles_[octave].largest() * diameter};
}

/// What the search for stamps reads, side by side.
struct Craters::Placed {
    Vec3 position_m;
    double reach_m;
    const Stamp* stamp;
};

/// Sums of the octaves of a grid, block by block.
class Craters::Octaves {
public:
    Octaves(const Craters& craters, const VertexGrid& grid, std::span<const double> sample_spacings_m,
            std::size_t first, std::size_t last)
        : craters_(craters), positions_m_(grid.positions_m), first_(first), sums_(last - first) {
        const double finest =
            log2_spacing(*std::min_element(sample_spacings_m.begin(), sample_spacings_m.end()));
        bool any = false;
        for (std::size_t octave = first; octave < last; ++octave) {
            shared_.push_back(craters.octave_share(octave, finest) != 1);
            any = any || shared_.back();
        }
        if (any) spacings_ = log2_spacings(sample_spacings_m);
    }

    /// Adds to `heights_m` what the stamps make in a block.
    void add_block(int i, int j, const std::vector<Placed>& stamps, std::span<double> heights_m) {
        const GridBlock block(positions_m_, i, j, static_cast<int>(stamp_block_edge));
        std::fill(used_.begin(), used_.end(), false);
        used_.resize(sums_.size(), false);
        bool any = false;
        for (const Placed& one : stamps) {
            if (!block.touches(one.position_m, one.reach_m)) continue;
            if (!any) load(block);
            any = true;
            add(*one.stamp);
        }
        if (!any) return;
        // The same order at every vertex, whichever octaves the grid has.
        total_.fill(0);
        for (std::size_t k = sums_.size(); k-- > 0;) {
            if (!used_[k]) continue;
            HeightRange clamp = craters_.clamp_of(first_ + k);
            if (shared_[k]) { // clamped before it is shared out
                for (std::size_t n = 0; n < stamp_block_size; ++n)
                    sums_[k][n] = share(k, n) * std::clamp(sums_[k][n], clamp.least, clamp.largest);
                clamp = {std::min(clamp.least, 0.0), std::max(clamp.largest, 0.0)};
            }
            add_clamped(total_, sums_[k].values, clamp.least, clamp.largest);
        }
        for (std::size_t n = 0; n < stamp_block_size; ++n)
            if (inside_[n]) heights_m[index_[n]] += total_[n];
    }

private:
    void load(const GridBlock& block) {
        for (std::size_t n = 0; n < stamp_block_size; ++n) {
            const int column = block.i0 + static_cast<int>(n % stamp_block_edge);
            const int row = block.j0 + static_cast<int>(n / stamp_block_edge);
            inside_[n] = column < block.i1 && row < block.j1;
            index_[n] = GridBlock::index(std::min(column, block.i1 - 1), std::min(row, block.j1 - 1));
            const Vec3 p = positions_m_[index_[n]];
            points_.x[n] = p.x;
            points_.y[n] = p.y;
            points_.z[n] = p.z;
        }
    }
    [[nodiscard]] double share(std::size_t k, std::size_t n) const {
        return craters_.octave_share(first_ + k, spacings_[index_[n]]);
    }
    void add(const Stamp& stamp) {
        const std::size_t k = stamp.feature.octave - first_;
        if (!used_[k]) sums_[k].values.fill(0);
        used_[k] = true;
        const double radius = stamp.diameter_m / 2;
        const ProfileStamp profile{stamp.feature.position_m,        stamp.profile.data(),
                                   CraterProfiles::steps,           steps_per_square / (radius * radius),
                                   stamp.whole * stamp.diameter_m,  removed_squared * steps_per_square,
                                   kept_squared * steps_per_square, stamp.whole};
        if (!add_profile(points_, profile, sums_[k].values, left_)) return;
        if (shared_[k])
            for (std::size_t n = 0; n < stamp_block_size; ++n)
                left_[n] = 1 - share(k, n) * (1 - left_[n]);
        for (std::size_t smaller = 0; smaller < k; ++smaller)
            if (used_[smaller]) scale_block(sums_[smaller].values, left_);
    }

    struct Sum {
        alignas(64) BlockValues values;
        [[nodiscard]] double& operator[](std::size_t n) { return values[n]; }
    };
    const Craters& craters_;
    std::span<const Vec3> positions_m_;
    std::vector<double> spacings_; ///< of samples, as log2; where an octave is shared out
    std::size_t first_;
    std::vector<Sum> sums_; ///< of each octave
    std::vector<bool> shared_, used_;
    BlockPoints points_{};
    alignas(64) BlockValues left_{}, total_{};
    std::array<std::size_t, stamp_block_size> index_{};
    std::array<bool, stamp_block_size> inside_{};
};

void Craters::apply(const VertexGrid& grid, std::span<double> heights_m,
                    std::span<double> sample_spacings_m) const {
    const std::vector<FeatureOctave>& octaves = field_.octaves();
    std::size_t first = 0;
    while (first < octaves.size() &&
           std::ldexp(2.0, octaves[first].exponent) <= min_crater_cells * grid.spacing_m)
        ++first;
    if (first == octaves.size()) return;
    const double coarsest =
        log2_spacing(*std::max_element(sample_spacings_m.begin(), sample_spacings_m.end()));
    std::vector<Feature> features;
    std::size_t last = octaves.size();
    while (last > first && octave_share(last - 1, coarsest) == 0)
        --last;
    field_.near(grid.cap, first, last, features);
    if (features.empty()) return;
    std::vector<Stamp> stamps;
    stamps.reserve(features.size());
    for (const Feature& feature : features) {
        Stamp stamp = stamp_of(feature);
        if (stamp.diameter_m <= min_crater_cells * grid.spacing_m || stamp.diameter_m < min_diameter_m_ ||
            stamp.diameter_m > largest_diameter_m_)
            continue;
        stamp.whole = whole(stamp.diameter_m, grid.spacing_m);
        const std::size_t extent = profiles_[feature.octave].at(wear(stamp), stamp.profile.data());
        stamp.reach_m = stamp.diameter_m / 2 *
                        std::sqrt(std::max(kept_squared, static_cast<double>(extent) / steps_per_square));
        stamps.push_back(stamp);
    }
    std::vector<Placed> placed;
    placed.reserve(stamps.size());
    for (const Stamp& stamp : stamps)
        placed.push_back({stamp.feature.position_m, stamp.reach_m, &stamp});
    std::sort(placed.begin(), placed.end(),
              [](const Placed& a, const Placed& b) { return older(*a.stamp, *b.stamp); });

    Octaves sums(*this, grid, sample_spacings_m, first, last);
    constexpr int wide_edge = 4 * static_cast<int>(stamp_block_edge);
    std::vector<Placed> around;
    for (int j = 0; j < tile_edge; j += wide_edge)
        for (int i = 0; i < tile_edge; i += wide_edge) {
            const GridBlock wide(grid.positions_m, i, j, wide_edge);
            around.clear();
            for (const Placed& one : placed)
                if (wide.touches(one.position_m, one.reach_m)) around.push_back(one);
            if (around.empty()) continue;
            for (int row = j; row < wide.j1; row += static_cast<int>(stamp_block_edge))
                for (int column = i; column < wide.i1; column += static_cast<int>(stamp_block_edge))
                    sums.add_block(column, row, around, heights_m);
        }
}

HeightRange Craters::range(const Cap& cap, double spacing_m, HeightRange below) const {
    // As apply() has it, with ranges over the cap. Octaves that are small there are within their clamps.
    const std::size_t count = field_.octaves().size();
    std::size_t first = 0;
    while (first < count && std::ldexp(1.0, field_.octaves()[first].exponent) < cap.radius_m / 8)
        ++first;
    std::vector<Feature> features;
    field_.near(cap, first, count, features);
    std::vector<Stamp> stamps;
    for (const Feature& feature : features)
        stamps.push_back(stamp_of(feature));
    std::sort(stamps.begin(), stamps.end(), older);
    std::vector<HeightRange> sums(count);
    const double largest_spacing = log2_spacing(below.sample_spacing_m);
    const auto max_share = [&](std::size_t octave) {
        return over_maps_ ? octave_share(octave, largest_spacing) : 1.0;
    };
    CraterProfile profile{};
    for (const Stamp& stamp : stamps) {
        if (stamp.diameter_m < min_diameter_m_ || stamp.diameter_m > largest_diameter_m_) continue;
        const std::size_t octave = stamp.feature.octave;
        const double radius = stamp.diameter_m / 2;
        const double distance = length(stamp.feature.position_m - cap.centre_m);
        const double near_edge = std::max(0.0, distance - cap.radius_m) / radius;
        const double far_edge = (distance + cap.radius_m) / radius;
        constexpr double last = CraterProfiles::steps;
        const double from = std::min(near_edge * near_edge * steps_per_square, last);
        const double to = std::min(far_edge * far_edge * steps_per_square + 1, last);
        profiles_[octave].at(wear(stamp), profile.data());
        const auto [low, high] = std::minmax_element(profile.begin() + static_cast<std::ptrdiff_t>(from),
                                                     profile.begin() + static_cast<std::ptrdiff_t>(to) + 1);
        const double min_whole = whole(stamp.diameter_m, spacing_m);
        sums[octave].least += stamp.diameter_m * std::min(*low, min_whole * *low);
        sums[octave].largest += stamp.diameter_m * std::max(*high, min_whole * *high);
        const double max_removed = max_share(octave) * removed(near_edge * near_edge);
        const double min_removed = over_maps_ ? 0 : min_whole * removed(far_edge * far_edge);
        for (std::size_t smaller = first; smaller < octave; ++smaller) {
            HeightRange& sum = sums[smaller];
            sum.least *= sum.least < 0 ? 1 - min_removed : 1 - max_removed;
            sum.largest *= sum.largest > 0 ? 1 - min_removed : 1 - max_removed;
        }
    }
    HeightRange result = below;
    for (std::size_t octave = 0; octave < count; ++octave) {
        const HeightRange clamp = clamp_of(octave);
        double least = clamp.least, largest = clamp.largest;
        if (octave >= first) {
            least = std::clamp(sums[octave].least, clamp.least, clamp.largest);
            largest = std::clamp(sums[octave].largest, clamp.least, clamp.largest);
        }
        const double most = max_share(octave);
        result.least += over_maps_ ? most * std::min(least, 0.0) : least;
        result.largest += over_maps_ ? most * std::max(largest, 0.0) : largest;
    }
    // What the two ways of adding up may differ by.
    const double slack = 1e-9 * (result.largest - result.least);
    result.least -= slack;
    result.largest += slack;
    return result;
}

std::vector<Crater> Craters::near(const Cap& cap, double min_diameter_m, double radii) const {
    const std::vector<FeatureOctave>& octaves = field_.octaves();
    std::size_t first = 0;
    while (first < octaves.size() && std::ldexp(2.0, octaves[first].exponent) <= min_diameter_m)
        ++first;
    std::vector<Feature> features;
    field_.near(cap, first, octaves.size(), features, radii / CraterProfiles::reach);
    std::vector<Crater> craters;
    for (const Feature& feature : features) {
        const Stamp stamp = stamp_of(feature);
        if (stamp.diameter_m < min_diameter_m || stamp.diameter_m < min_diameter_m_ ||
            stamp.diameter_m > largest_diameter_m_)
            continue;
        const double reach = cap.radius_m + radii * stamp.diameter_m / 2;
        if (length_squared(feature.position_m - cap.centre_m) > reach * reach) continue;
        craters.push_back({feature.id, feature.position_m, stamp.diameter_m, law_.age_of(stamp.chronology)});
    }
    return craters;
}

void Craters::find_features(FeatureSearch& search) const {
    const auto wants = [&](TileKey square, std::size_t octave, int /*finer*/) {
        return search.wants(square, std::ldexp(2.0, field_.octaves()[octave].exponent));
    };
    field_.visit(0, field_.octaves().size(), wants, [&](const Feature& feature) {
        const Stamp stamp = stamp_of(feature);
        if (!exists(stamp) || !search.wants(feature.position_m, stamp.diameter_m)) return;
        search.add({FeatureKind::crater, feature.id, feature.position_m, stamp.diameter_m});
    });
}

double Craters::share_left(const SurfaceFeature& feature, double sample_spacing_m) const {
    const Stamp own = stamp_of(field_.feature(feature.id));
    const std::size_t octave = own.feature.octave;
    CraterProfile now{}, fresh{};
    profiles_[octave].at(wear(own), now.data());
    profiles_[octave].at(0, fresh.data());
    const double spacing = log2_spacing(sample_spacing_m);
    double left = octave_share(octave, spacing) * now[0] / fresh[0];
    const double reach_share = std::sqrt(kept_squared) / CraterProfiles::reach;
    field_.visit_near({own.feature.position_m, 0}, octave + 1, field_.octaves().size(), reach_share,
                      [&](const Feature& other) {
                          const Stamp later = stamp_of(other);
                          if (!exists(later) || !older(own, later)) return;
                          const double radius = later.diameter_m / 2;
                          const double square =
                              length_squared(own.feature.position_m - other.position_m) / (radius * radius);
                          left *= 1 - octave_share(other.octave, spacing) * removed(square);
                      });
    return left;
}

void Craters::add_young(const Cap& cap, double min_diameter_m, double age_ga, double radii,
                        std::pmr::vector<Crater>& craters) const {
    const std::vector<FeatureOctave>& octaves = field_.octaves();
    std::size_t first = 0;
    while (first < octaves.size() && std::ldexp(2.0, octaves[first].exponent) <= min_diameter_m)
        ++first;
    field_.visit_near(cap, first, octaves.size(), radii / CraterProfiles::reach, [&](const Feature& feature) {
        const Stamp stamp = stamp_of(feature);
        const double reach = cap.radius_m + radii * stamp.diameter_m / 2;
        const double age = law_.age_of(stamp.chronology);
        if (!exists(stamp) || stamp.diameter_m < min_diameter_m || age >= age_ga ||
            length_squared(feature.position_m - cap.centre_m) > reach * reach)
            return;
        craters.push_back({feature.id, feature.position_m, stamp.diameter_m, age});
    });
}

double Craters::middle_diameter_m(std::size_t octave) const {
    return std::ldexp(std::numbers::sqrt2, field_.octaves()[octave].exponent);
}

double Craters::octave_deviation_m2(std::size_t octave, double baseline_m) const {
    // Campbell's theorem: craters are independent, so each adds its own integral over the plane.
    constexpr double step = 0.2;
    const double diameter = middle_diameter_m(octave);
    if (diameter < min_diameter_m_ || diameter > largest_diameter_m_) return 0;
    const double radius = diameter / 2, shift = std::min(baseline_m / radius, 2 * CraterProfiles::reach);
    CraterProfile profile{};
    const auto height = [&](double x, double y) {
        const double place = (x * x + y * y) * steps_per_square;
        return place < CraterProfiles::steps ? between_steps(profile, place) : 0.0;
    };
    double sum = 0;
    for (const double age : {1.0 / 6, 0.5, 5.0 / 6}) {
        profiles_[octave].at(wear(octave, diameter, age * law_.oldest(diameter)), profile.data());
        for (double y = step / 2; y < CraterProfiles::reach; y += step)
            for (double x = -CraterProfiles::reach - shift; x < CraterProfiles::reach; x += step) {
                const double difference = height(x + shift, y) - height(x, y);
                sum += 2 * difference * difference / 3; // both signs of y
            }
    }
    return field_.octaves()[octave].per_m2 * sum * step * step * radius * radius * diameter * diameter;
}

double Craters::deviation_m2(double baseline_m) const {
    double total = 0;
    for (std::size_t octave = 0; octave < field_.octaves().size(); ++octave)
        total += octave_deviation_m2(octave, baseline_m);
    return total;
}

void Craters::add_lost_slopes(std::span<const Vec3> positions_m, double spacing_m,
                              std::span<const double> sample_spacings_m, std::span<double> lost) const {
    std::vector<double> own; // squared slopes, of each octave
    for (std::size_t octave = 0; octave < losses_.size(); ++octave) {
        constexpr int parts = 4;
        double kept = 0;
        for (int part = 0; part < parts; ++part) {
            const double diameter = laws_[octave].low_m * exact_exp2((part + 0.5) / parts);
            const double share = whole(diameter, spacing_m);
            kept += share * share / parts;
        }
        kept *= 1 - losses_[octave].share(spacing_m / laws_[octave].low_m);
        own.push_back(2 * losses_[octave].whole() * (1 - kept));
    }
    add_shared_slopes(own, sample_spacings_m.first(positions_m.size()), lost,
                      [&](std::size_t octave, double spacing) { return octave_share(octave, spacing); });
}

} // namespace obscura::terrain
