// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/octaves.hpp"

#include "terrain/detail/exact_math.hpp"
#include "terrain/detail/face_region.hpp"
#include "terrain/detail/sample_spacing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace obscura::terrain {
namespace {

/// Most that refining without end makes of vertices within +- 1, in two dimensions: the square of the
/// four-point scheme's Lebesgue constant, 1.2512.
constexpr double refining_gain = 1.5656;

/// Lattice spacings of an octave in which it fades in over samples: from `all` to `none` times their
/// distance, as log2. Noise of lattice spacing d is strongest at wavelengths of about 2 d.
constexpr double all_log2 = -0.25, none_log2 = 1.5;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Shortest octave of a grid, in vertices.
constexpr double min_cells = 2;

Vec3 vertex(const SurfaceDomain& domain, std::uint8_t face, int level, std::int64_t i, std::int64_t j) {
    return domain.point(face, vertex_coordinate(level, i), vertex_coordinate(level, j));
}

std::int64_t half_down(std::int64_t n) {
    return n >> 1;
}
std::int64_t half_up(std::int64_t n) {
    return (n + 1) >> 1;
}

/// The value half way between b and c; the same in either direction.
double midway(double a, double b, double c, double d) {
    return (9 * (b + c) - (a + d)) * 0.0625;
}

} // namespace

Octaves::Octaves(const SurfaceDomain& domain, const SlopeTable& table, std::uint64_t seed, bool over_maps,
                 const std::function<double(double)>& made_m2)
    : domain_(domain), loss_(noise_structure, domain.spacing_m(0)), over_maps_(over_maps) {
    const double extent = domain.spacing_m(0) * (tile_cells / 2.0);
    const int longest = static_cast<int>(std::floor(exact_log2(std::min(2 * table.max_m(), extent)) + 1e-6));
    // Lattice points must have numbers of 31 bits.
    const double least = std::max({0.001, 2 * domain.spacing_m(deepest_level), extent * 0x1p-29});
    const int shortest = static_cast<int>(std::ceil(exact_log2(least)));
    octaves_ = solve_octaves(
        table, shortest, longest, made_m2 ? made_m2 : [](double) { return 0.0; });
    for (const Octave& octave : octaves_) {
        lattices_.push_back(noise_lattice(seed, octave.exponent, std::ldexp(1.0, octave.exponent)));
        int level = 0;
        while (level < deepest_level && 4 * domain.spacing_m(level) > std::ldexp(1.0, octave.exponent))
            ++level;
        levels_.push_back(level);
    }
}

double Octaves::share(int exponent, double log2_spacing) {
    const double x = exponent - log2_spacing;
    return 1 - smooth_step((x - all_log2) / (none_log2 - all_log2));
}

std::size_t Octaves::count_at(double spacing_m) const {
    std::size_t count = 0;
    while (count < octaves_.size() && std::ldexp(1.0, octaves_[count].exponent) >= min_cells * spacing_m)
        ++count;
    return count;
}

Octaves::Region Octaves::Region::coarser() const {
    return {half_down(i0) - 1, half_up(i1) + 1, half_down(j0) - 1, half_up(j1) + 1};
}

std::vector<Vec3> Octaves::positions(std::uint8_t face, int level, const Region& region) const {
    std::vector<Vec3> result;
    result.reserve(region.size());
    for (std::int64_t j = region.j0; j <= region.j1; ++j)
        for (std::int64_t i = region.i0; i <= region.i1; ++i)
            result.push_back(vertex(domain_, face, level, i, j));
    return result;
}

std::vector<double> Octaves::refined(std::span<const double> coarse, const Region& from, const Region& to) {
    // Along i first, then along j.
    const std::size_t columns = to.columns(), width = from.columns();
    std::vector<double> wide(columns * from.rows()), result(to.size());
    for (std::size_t row = 0; row < from.rows(); ++row) {
        const double* const in = coarse.data() + row * width;
        double* const out = wide.data() + row * columns;
        for (std::size_t n = 0; n < columns; ++n) {
            const std::int64_t i = to.i0 + static_cast<std::int64_t>(n);
            const double* const at = in + (half_down(i) - from.i0);
            out[n] = (i & 1) == 0 ? at[0] : midway(at[-1], at[0], at[1], at[2]);
        }
    }
    for (std::size_t n = 0; n < to.rows(); ++n) {
        const std::int64_t j = to.j0 + static_cast<std::int64_t>(n);
        const double* const at = wide.data() + static_cast<std::size_t>(half_down(j) - from.j0) * columns;
        double* const out = result.data() + n * columns;
        if ((j & 1) == 0)
            std::copy_n(at, columns, out);
        else
            for (std::size_t k = 0; k < columns; ++k)
                out[k] = midway(*(at + k - columns), at[k], at[k + columns], at[k + 2 * columns]);
    }
    return result;
}

std::vector<double> Octaves::sum(std::uint8_t face, int level, const Region& region, std::size_t first,
                                 std::size_t last, std::span<const Vec3> positions_m) const {
    std::vector<double> total;
    if (first >= last) return std::vector<double>(region.size());
    const int start = std::min(level, levels_[first]);
    std::vector<Region> regions{region};
    for (int at = level; at > start; --at)
        regions.push_back(regions.back().coarser());
    std::size_t next = first;
    std::vector<float> noise;
    for (int at = start; at <= level; ++at) {
        const Region& here = regions[static_cast<std::size_t>(level - at)];
        if (at == start)
            total.assign(here.size(), 0);
        else
            total = refined(total, regions[static_cast<std::size_t>(level - at) + 1], here);
        if (next >= last || (at < level && levels_[next] > at)) continue;
        const bool known = at == level && !positions_m.empty();
        const std::vector<Vec3> made = known ? std::vector<Vec3>{} : positions(face, at, here);
        const std::span<const Vec3> points = known ? positions_m : made;
        noise.resize(here.size());
        for (; next < last && (at == level || levels_[next] == at); ++next) {
            gradient_noise(lattices_[next], points, noise);
            const double rms = octaves_[next].rms_m;
            for (std::size_t n = 0; n < noise.size(); ++n)
                total[n] += rms * static_cast<double>(noise[n]);
        }
    }
    return total;
}

void Octaves::apply(const VertexGrid& grid, std::span<double> heights_m,
                    std::span<double> sample_spacings_m) const {
    const std::size_t count = count_at(grid.spacing_m);
    if (count == 0) return;
    const std::int64_t i0 = std::int64_t{grid.tile.i} * tile_cells - tile_margin;
    const std::int64_t j0 = std::int64_t{grid.tile.j} * tile_cells - tile_margin;
    const Region region{i0, i0 + tile_edge - 1, j0, j0 + tile_edge - 1};
    const auto sum_to = [&](std::size_t last) {
        return sum(grid.tile.face, grid.tile.level, region, 0, last, grid.positions_m);
    };
    const std::vector<double> all = sum_to(count);
    // With shares w that grow towards short octaves, the sum of w f is the whole sum, less each rise of w
    // times the sum of the octaves before it.
    std::vector<double> detail = all;
    const auto [finest, coarsest] = std::minmax_element(sample_spacings_m.begin(), sample_spacings_m.end());
    const double least = log2_spacing(*finest), largest = log2_spacing(*coarsest);
    std::vector<double> spacings;
    for (std::size_t k = 0; k < count; ++k) {
        const auto rise = [&](double spacing) {
            const double next = k + 1 < count ? share(octaves_[k + 1].exponent, spacing) : 1;
            return next - share(octaves_[k].exponent, spacing);
        };
        // Shares fall with the spacing: no rise anywhere if none at the finest and 1 before it at the
        // coarsest.
        if (share(octaves_[k].exponent, least) == 1) break;
        if (k + 1 < count && share(octaves_[k + 1].exponent, largest) == 0) continue;
        const std::vector<double> before = sum_to(k + 1);
        if (spacings.empty()) spacings = log2_spacings(sample_spacings_m);
        for (std::size_t n = 0; n < detail.size(); ++n)
            detail[n] -= rise(spacings[n]) * before[n];
    }
    for (std::size_t n = 0; n < detail.size(); ++n)
        heights_m[n] += detail[n];
}

void Octaves::add_lost_slopes(std::span<const Vec3> positions_m, double spacing_m,
                              std::span<const double> sample_spacings_m, std::span<double> lost) const {
    const std::size_t count = count_at(spacing_m);
    std::vector<double> own; // squared slopes, of each octave
    for (std::size_t k = 0; k < octaves_.size(); ++k) {
        const double lattice_m = std::ldexp(1.0, octaves_[k].exponent), rms = octaves_[k].rms_m / lattice_m;
        own.push_back(2 * rms * rms * loss_.whole() * (k < count ? loss_.share(spacing_m / lattice_m) : 1.0));
    }
    add_shared_slopes(own, sample_spacings_m.first(positions_m.size()), lost,
                      [&](std::size_t k, double spacing) { return share(octaves_[k].exponent, spacing); });
}

HeightRange Octaves::range(const Cap& cap, double spacing_m, HeightRange below) const {
    // Octaves that are sampled at vertices no closer than those of `level` are looked up there; finer ones
    // are within their bounds.
    int level = 0;
    while (level < deepest_level && domain_.spacing_m(level + 1) >= spacing_m &&
           domain_.spacing_m(level) > cap.radius_m / 4)
        ++level;
    const double largest_spacing = log2_spacing(over_maps_ ? below.sample_spacing_m : infinity);
    std::vector<double> least(octaves_.size()), largest(octaves_.size());
    std::size_t coarse = 0;
    while (coarse < octaves_.size() && levels_[coarse] <= level)
        ++coarse;
    bool any = false;
    for (std::uint8_t face = 0; face < domain_.faces(); ++face) {
        const std::optional<FaceRegion> part = region_of_cap(domain_, face, cap);
        if (!part) continue;
        constexpr std::int64_t stencil = 3;
        const Region region{
            vertex_below(level, part->u0) - stencil, vertex_below(level, part->u1) + 1 + stencil,
            vertex_below(level, part->v0) - stencil, vertex_below(level, part->v1) + 1 + stencil};
        for (std::size_t k = 0; k < coarse; ++k) {
            const std::vector<double> values = sum(face, level, region, k, k + 1, {});
            const auto [low, high] = std::minmax_element(values.begin(), values.end());
            least[k] = any ? std::min(least[k], *low) : *low;
            largest[k] = any ? std::max(largest[k], *high) : *high;
        }
        any = true;
    }
    HeightRange result = below;
    for (std::size_t k = 0; k < octaves_.size(); ++k) {
        const double bound = refining_gain * static_cast<double>(noise_bound) * octaves_[k].rms_m;
        double low = -bound, high = bound;
        if (any && k < coarse) {
            const double middle = (least[k] + largest[k]) / 2;
            const double half = refining_gain * (largest[k] - least[k]) / 2;
            low = std::max(low, middle - half);
            high = std::min(high, middle + half);
        }
        if (over_maps_) { // any share up to that of the coarsest samples
            const double most = share(octaves_[k].exponent, largest_spacing);
            low = most * std::min(low, 0.0);
            high = most * std::max(high, 0.0);
        }
        result.least += low;
        result.largest += high;
    }
    return result;
}

} // namespace obscura::terrain
