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
constexpr std::uint32_t max_cell_share = 127;

/// Count of mean `mean` whose cumulative probability first exceeds `u`.
std::uint32_t poisson(double mean, double u) {
    double probability = exact_exp(-mean), sum = probability;
    std::uint32_t count = 0;
    while (u >= sum && count < max_cell_share) {
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
        max_area_m2_ = domain.half_edge_m() * domain.half_edge_m();
    } else {
        const Vec3 r = domain.radii_m();
        max_area_m2_ = std::max({r.x * r.y, r.y * r.z, r.z * r.x});
    }
    for (const FeatureOctave& octave : octaves_) {
        int level = 0;
        // Not more than a few dozen in a cell, whatever the law.
        while (level < deepest_cells && (std::ldexp(edge_m, -level - 1) >= std::ldexp(8.0, octave.exponent) ||
                                         octave.per_m2 * std::ldexp(4 * max_area_m2_, -2 * level) > 40))
            ++level;
        levels_.push_back(level);
    }
}

double FeatureField::area_m2(std::uint8_t face, double u, double v) const {
    if (domain_.is_plane()) return max_area_m2_;
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

FeatureField::Cell::Cell(const FeatureField& field, std::size_t octave, TileKey cell)
    : field_(field),
      octave_(octave),
      cell_(cell),
      width_(std::ldexp(2.0, -cell.level)),
      u0_(-1 + cell.i * width_),
      v0_(-1 + cell.j * width_),
      most_(field.max_area_m2_) {
    // Gnomonic area falls away from the middle of the face.
    if (!field.domain_.is_plane()) {
        const double u = std::clamp(0.0, u0_, u0_ + width_), v = std::clamp(0.0, v0_, v0_ + width_);
        const double c2 = 1 + u * u + v * v;
        most_ /= c2 * std::sqrt(c2);
    }
    count_ = poisson(field.octaves_[octave].per_m2 * most_ * width_ * width_, uniform_double(words(0)[0]));
}

bool FeatureField::Cell::next() {
    while (number_ < count_) {
        ++number_;
        if (place()) return true;
    }
    return false;
}

void FeatureField::Cell::go_to(std::uint32_t number) {
    number_ = number;
    static_cast<void>(place());
}

bool FeatureField::Cell::place() {
    const auto place = words(2 * number_);
    const double u = u0_ + width_ * uniform_double(place[0]);
    const double v = v0_ + width_ * uniform_double(place[1]);
    if (uniform_double(place[2]) * most_ > field_.area_m2(cell_.face, u, v)) return false;
    position_m_ = field_.domain_.point(cell_.face, u, v);
    return true;
}

Feature FeatureField::Cell::feature() const {
    const std::uint64_t id = std::uint64_t{octave_} << 58 | std::uint64_t{cell_.face} << 55 |
                             std::uint64_t{cell_.i} << 31 | std::uint64_t{cell_.j} << 7 | number_;
    return {id, static_cast<std::uint32_t>(octave_), position_m_, words(2 * number_ + 1)};
}

std::array<std::uint32_t, 4> FeatureField::Cell::words(std::uint32_t number) const {
    return philox4x32({number << 8 | static_cast<std::uint32_t>(octave_), cell_.face << 24 | field_.stream_,
                       cell_.i, cell_.j},
                      philox_key(field_.seed_));
}

Feature FeatureField::feature(std::uint64_t id) const {
    const auto octave = static_cast<std::size_t>(id >> 58);
    Cell cell(*this, octave,
              {static_cast<std::uint8_t>(id >> 55 & 7), static_cast<std::uint8_t>(levels_[octave]),
               static_cast<std::uint32_t>(id >> 31 & 0xffffff),
               static_cast<std::uint32_t>(id >> 7 & 0xffffff)});
    cell.go_to(static_cast<std::uint32_t>(id & 127));
    return cell.feature();
}

FeatureField::Cells FeatureField::cells_near(std::size_t octave, std::uint8_t face, const Cap& cap,
                                             double reach_share) const {
    const FeatureOctave& law = octaves_[octave];
    if (!(law.per_m2 > 0)) return {};
    const double reach_m = cap.radius_m + reach_share * law.reach_m;
    const double cells = std::ldexp(1.0, levels_[octave]), width = 2 / cells;
    const std::optional<FaceRegion> part = region_of_cap(domain_, face, {cap.centre_m, reach_m});
    if (!part) return {};
    const auto cell_of = [&](double x) {
        return static_cast<std::uint32_t>(std::clamp(std::floor((x + 1) / width), 0.0, cells - 1));
    };
    return {cell_of(part->u0), cell_of(part->u1) + 1, cell_of(part->v0), cell_of(part->v1) + 1};
}

void FeatureField::near(const Cap& cap, std::size_t first, std::size_t last, std::vector<Feature>& features,
                        double reach_share) const {
    for (std::size_t octave = first; octave < std::min(last, octaves_.size()); ++octave) {
        const double reach_m = cap.radius_m + reach_share * octaves_[octave].reach_m;
        const auto level = static_cast<std::uint8_t>(levels_[octave]);
        for (std::uint8_t face = 0; face < domain_.faces(); ++face) {
            const Cells cells = cells_near(octave, face, cap, reach_share);
            for (std::uint32_t j = cells.j0; j < cells.j1; ++j)
                for (std::uint32_t i = cells.i0; i < cells.i1; ++i) {
                    Cell cell(*this, octave, {face, level, i, j});
                    while (cell.next())
                        if (length_squared(cell.position_m() - cap.centre_m) <= reach_m * reach_m)
                            features.push_back(cell.feature());
                }
        }
    }
}

} // namespace obscura::terrain
