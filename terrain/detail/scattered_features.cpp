// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/scattered_features.hpp"

#include "core/philox.hpp"
#include "terrain/cube_sphere.hpp"
#include "terrain/detail/exact_math.hpp"
#include "terrain/detail/face_region.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace obscura::terrain {
namespace {

/// Numbers of cells and of features have to fit into an identity of 64 bits.
constexpr int deepest_cells = 24;
constexpr std::uint32_t most_of_a_cell = 127;

/// Count of mean `mean` whose cumulative probability first exceeds `u`.
std::uint32_t poisson(double mean, double u) {
    double probability = exact_exp(-mean), sum = probability;
    std::uint32_t count = 0;
    while (u >= sum && count < most_of_a_cell) {
        ++count;
        probability *= mean / count;
        sum += probability;
    }
    return count;
}

} // namespace

FeatureField::FeatureField(const SurfaceDomain& domain, std::uint64_t seed, std::uint32_t stream,
                           std::vector<FeatureOctave> octaves)
    : domain_(domain), seed_(seed), stream_(stream), octaves_(std::move(octaves)) {
    const double edge_m = domain.spacing_m(0) * tile_cells;
    if (domain.is_plane()) {
        most_area_m2_ = domain.half_edge_m() * domain.half_edge_m();
    } else {
        const Vec3 r = domain.radii_m();
        most_area_m2_ = std::max({r.x * r.y, r.y * r.z, r.z * r.x});
    }
    for (const FeatureOctave& octave : octaves_) {
        int level = 0;
        // Not more than a few dozen in a cell, whatever the law.
        while (level < deepest_cells && (std::ldexp(edge_m, -level - 1) >= std::ldexp(8.0, octave.exponent) ||
                                         octave.per_m2 * std::ldexp(4 * most_area_m2_, -2 * level) > 40))
            ++level;
        levels_.push_back(level);
    }
}

double FeatureField::area_m2(std::uint8_t face, double u, double v) const {
    if (domain_.is_plane()) return most_area_m2_;
    const CubeFace& side = cube_faces[face];
    const Vec3 c = cube_point(side, u, v), r = domain_.radii_m();
    const double inverse = 1 / std::sqrt(length_squared(c));
    const Vec3 d = c * inverse;
    const auto slope = [&](int axis) { // of the point of the surface along an axis of the face's plane
        const double along = component(d, axis);
        const Vec3 e{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
        const Vec3 turn = (e - along * d) * inverse;
        return Vec3{turn.x * r.x, turn.y * r.y, turn.z * r.z};
    };
    return std::sqrt(length_squared(cross(slope(side.u_axis), slope(side.v_axis))));
}

void FeatureField::near(const Cap& cap, std::size_t first, std::size_t last, std::vector<Feature>& features,
                        double reach_share) const {
    for (std::size_t octave = first; octave < std::min(last, octaves_.size()); ++octave) {
        const FeatureOctave& law = octaves_[octave];
        if (!(law.per_m2 > 0)) continue;
        const double reach_m = cap.radius_m + reach_share * law.reach_m;
        const int level = levels_[octave];
        const double cells = std::ldexp(1.0, level), width = 2 / cells;
        for (std::uint8_t face = 0; face < domain_.faces(); ++face) {
            const std::optional<FaceRegion> part = region_of_cap(domain_, face, {cap.centre_m, reach_m});
            if (!part) continue;
            const auto cell_of = [&](double x) {
                return static_cast<std::uint32_t>(std::clamp(std::floor((x + 1) / width), 0.0, cells - 1));
            };
            const std::uint32_t i0 = cell_of(part->u0), i1 = cell_of(part->u1);
            const std::uint32_t j0 = cell_of(part->v0), j1 = cell_of(part->v1);
            for (std::uint32_t j = j0; j <= j1; ++j)
                for (std::uint32_t i = i0; i <= i1; ++i) {
                    const double u0 = -1 + i * width, v0 = -1 + j * width;
                    // Gnomonic area falls away from the middle of the face.
                    double most = most_area_m2_;
                    if (!domain_.is_plane()) {
                        const double u = std::clamp(0.0, u0, u0 + width), v = std::clamp(0.0, v0, v0 + width);
                        const double c2 = 1 + u * u + v * v;
                        most /= c2 * std::sqrt(c2);
                    }
                    const auto words = [&](std::uint32_t number) {
                        return philox4x32(
                            {number << 8 | static_cast<std::uint32_t>(octave), face << 24 | stream_, i, j},
                            philox_key(seed_));
                    };
                    const std::uint32_t count =
                        poisson(law.per_m2 * most * width * width, uniform_double(words(0)[0]));
                    for (std::uint32_t n = 1; n <= count; ++n) {
                        const auto place = words(2 * n);
                        const double u = u0 + width * uniform_double(place[0]);
                        const double v = v0 + width * uniform_double(place[1]);
                        if (uniform_double(place[2]) * most > area_m2(face, u, v)) continue;
                        const Vec3 at = domain_.point(face, u, v);
                        if (length_squared(at - cap.centre_m) > reach_m * reach_m) continue;
                        const std::uint64_t id = std::uint64_t{octave} << 58 | std::uint64_t{face} << 55 |
                                                 std::uint64_t{i} << 31 | std::uint64_t{j} << 7 | n;
                        features.push_back({id, static_cast<std::uint32_t>(octave), at, words(2 * n + 1)});
                    }
                }
        }
    }
}

} // namespace obscura::terrain
