// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/gradient_noise.hpp"

#include "core/philox.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "terrain/detail/gradient_noise.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>

// Points of a block: places in their cells and numbers of the cells.
#ifndef OBSCURA_TERRAIN_NOISE_BLOCK
#define OBSCURA_TERRAIN_NOISE_BLOCK
namespace obscura::terrain {
namespace {

constexpr std::size_t block_size = 256;
struct NoiseBlock {
    alignas(64) std::array<std::array<double, block_size>, 3> position;
    alignas(64) std::array<std::array<float, block_size>, 3> place;
    alignas(64) std::array<std::array<std::int32_t, block_size>, 3> cell;
    alignas(64) std::array<float, block_size> noise;
};

/// Root of the mean square of the sum below with gradient components of variance 1/3: sqrt(a1 a0^2) with
/// a0 = 181/231 and a1 = 0.059385, the integrals of w^2 and of (x w)^2, see noise_structure.
constexpr float unit_rms = 0.190944F;

} // namespace
} // namespace obscura::terrain
#endif

HWY_BEFORE_NAMESPACE();
namespace obscura::terrain::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using F = hn::ScalableTag<float>;
using U = hn::RebindToUnsigned<F>;
using I = hn::RebindToSigned<F>;

template<typename V>
HWY_INLINE V fade(V x) {
    const F f;
    const V inner = hn::Add(hn::Mul(hn::Sub(hn::Mul(hn::Set(f, 6), x), hn::Set(f, 15)), x), hn::Set(f, 10));
    return hn::Mul(hn::Mul(hn::Mul(x, x), x), inner);
}

template<typename V>
HWY_INLINE V between(V a, V b, V share) {
    return hn::Add(a, hn::Mul(share, hn::Sub(b, a)));
}

/// -1 to 1 from the upper 23 bits.
template<typename VU>
HWY_INLINE auto signed_unit(VU bits) {
    const F f;
    const U u;
    const auto two_to_four = hn::BitCast(f, hn::Or(hn::ShiftRight<9>(bits), hn::Set(u, 0x40000000U)));
    return hn::Sub(two_to_four, hn::Set(f, 3));
}

/// Gradient of a lattice point times the way from it.
template<typename VU, typename VF>
HWY_INLINE VF slope_from(VU hash, VF x, VF y, VF z) {
    const U u;
    hash = hn::Xor(hash, hn::ShiftRight<15>(hash));
    hash = hn::Mul(hash, hn::Set(u, 0x2C1B3C6DU));
    hash = hn::Xor(hash, hn::ShiftRight<12>(hash));
    hash = hn::Mul(hash, hn::Set(u, 0x297A2D39U));
    hash = hn::Xor(hash, hn::ShiftRight<15>(hash));
    // Three components of 11, 11 and 10 independent bits.
    const VF gx = signed_unit(hash), gy = signed_unit(hn::ShiftLeft<11>(hash)),
             gz = signed_unit(hn::ShiftLeft<22>(hash));
    return hn::Add(hn::Add(hn::Mul(gx, x), hn::Mul(gy, y)), hn::Mul(gz, z));
}

void find_cells(NoiseBlock& block, const NoiseLattice& lattice) {
    const hn::ScalableTag<double> d;
    const hn::Rebind<float, decltype(d)> half_f;
    const hn::Rebind<std::int32_t, decltype(d)> half_i;
    const double offset[3] = {lattice.offset.x, lattice.offset.y, lattice.offset.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double* const row = lattice.per_spacing.m[axis];
        const auto rx = hn::Set(d, row[0]), ry = hn::Set(d, row[1]), rz = hn::Set(d, row[2]),
                   from = hn::Set(d, offset[axis]);
        for (std::size_t n = 0; n < block_size; n += hn::Lanes(d)) {
            const auto x = hn::Load(d, block.position[0].data() + n),
                       y = hn::Load(d, block.position[1].data() + n),
                       z = hn::Load(d, block.position[2].data() + n);
            const auto at = hn::Add(hn::Add(hn::Add(hn::Mul(rx, x), hn::Mul(ry, y)), hn::Mul(rz, z)), from);
            const auto whole = hn::Floor(at);
            hn::Store(hn::DemoteTo(half_f, hn::Sub(at, whole)), half_f, block.place[axis].data() + n);
            hn::Store(hn::DemoteTo(half_i, whole), half_i, block.cell[axis].data() + n);
        }
    }
}

void noise_of_block(NoiseBlock& block, const NoiseLattice& lattice) {
    find_cells(block, lattice);
    const std::uint32_t seed = lattice.seed;
    const F f;
    const U u;
    const I i;
    const auto one = hn::Set(f, 1);
    const auto scale = hn::Set(f, 1 / unit_rms), bound = hn::Set(f, noise_bound);
    const auto low = hn::Set(f, -noise_bound);
    const auto px = hn::Set(u, 0x8DA6B343U), py = hn::Set(u, 0xD8163841U), pz = hn::Set(u, 0xCB1AB31FU);
    for (std::size_t n = 0; n < block_size; n += hn::Lanes(f)) {
        const auto x = hn::Load(f, block.place[0].data() + n), y = hn::Load(f, block.place[1].data() + n),
                   z = hn::Load(f, block.place[2].data() + n);
        const auto x1 = hn::Sub(x, one), y1 = hn::Sub(y, one), z1 = hn::Sub(z, one);
        const auto cell = [&](int axis) HWY_ATTR {
            return hn::BitCast(u, hn::Load(i, block.cell[static_cast<std::size_t>(axis)].data() + n));
        };
        const auto hx = hn::Mul(cell(0), px), hx1 = hn::Add(hx, px);
        const auto hy = hn::Mul(cell(1), py), hy1 = hn::Add(hy, py);
        const auto hz = hn::Add(hn::Mul(cell(2), pz), hn::Set(u, seed)), hz1 = hn::Add(hz, pz);
        const auto h00 = hn::Xor(hy, hz), h10 = hn::Xor(hy1, hz), h01 = hn::Xor(hy, hz1),
                   h11 = hn::Xor(hy1, hz1);
        const auto wx = fade(x), wy = fade(y), wz = fade(z);
        const auto v00 =
            between(slope_from(hn::Xor(hx, h00), x, y, z), slope_from(hn::Xor(hx1, h00), x1, y, z), wx);
        const auto v10 =
            between(slope_from(hn::Xor(hx, h10), x, y1, z), slope_from(hn::Xor(hx1, h10), x1, y1, z), wx);
        const auto v01 =
            between(slope_from(hn::Xor(hx, h01), x, y, z1), slope_from(hn::Xor(hx1, h01), x1, y, z1), wx);
        const auto v11 =
            between(slope_from(hn::Xor(hx, h11), x, y1, z1), slope_from(hn::Xor(hx1, h11), x1, y1, z1), wx);
        const auto sum = hn::Mul(between(between(v00, v10, wy), between(v01, v11, wy), wz), scale);
        hn::Store(hn::Max(hn::Min(sum, bound), low), f, block.noise.data() + n);
    }
}

} // namespace
} // namespace obscura::terrain::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace obscura::terrain {
namespace {

HWY_EXPORT(noise_of_block);

/// Weight of a lattice point at distance x in one dimension.
double weight(double x) {
    const double t = 1 - std::abs(x);
    return t <= 0 ? 0 : t * t * t * ((6 * t - 15) * t + 10);
}

/// Integrals of w(x) w(x + t) and of x w(x) (x + t) w(x + t).
struct Overlap {
    double weights = 0, ways = 0;
};
Overlap overlap(double t) {
    Overlap sum;
    if (t >= 2) return sum;
    constexpr int steps = 64;
    const double low = -1, high = 1 - t, step = (high - low) / steps;
    for (int n = 0; n < steps; ++n) { // the midpoint rule: both ends are flat
        const double x = low + (n + 0.5) * step, product = weight(x) * weight(x + t);
        sum.weights += product;
        sum.ways += product * x * (x + t);
    }
    return {sum.weights * step, sum.ways * step};
}

/// Not normalised; gradient components of variance 1.
double covariance(Vec3 d) {
    const Overlap x = overlap(std::abs(d.x)), y = overlap(std::abs(d.y)), z = overlap(std::abs(d.z));
    return x.ways * y.weights * z.weights + x.weights * y.ways * z.weights + x.weights * y.weights * z.ways;
}

} // namespace

NoiseLattice noise_lattice(std::uint64_t seed, int octave, double spacing_m) {
    // A unit quaternion, uniform by rejection.
    std::array<double, 4> q{};
    std::array<std::uint32_t, 4> words{};
    for (std::uint32_t attempt = 0;; ++attempt) {
        words = philox4x32({static_cast<std::uint32_t>(octave), attempt, 0x6E6F6973, 0}, philox_key(seed));
        double norm = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            q[k] = 2 * uniform_double(words[k]) - 1;
            norm += q[k] * q[k];
        }
        if (norm > 1 || norm < 0.01) continue;
        for (double& part : q)
            part /= std::sqrt(norm);
        break;
    }
    const auto [w, x, y, z] = q;
    NoiseLattice lattice;
    lattice.per_spacing = {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                            {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                            {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
    for (auto& row : lattice.per_spacing.m)
        for (double& part : row)
            part /= spacing_m;
    words = philox4x32({static_cast<std::uint32_t>(octave), 0, 0x6F666673, 0}, philox_key(seed));
    lattice.offset = {256 * uniform_double(words[0]), 256 * uniform_double(words[1]),
                      256 * uniform_double(words[2])};
    lattice.seed = words[3];
    return lattice;
}

void gradient_noise(const NoiseLattice& lattice, std::span<const Vec3> positions_m, std::span<float> out) {
    NoiseBlock block{};
    for (std::size_t first = 0; first < positions_m.size(); first += block_size) {
        const std::size_t count = std::min(block_size, positions_m.size() - first);
        for (std::size_t n = 0; n < count; ++n) {
            const Vec3 p = positions_m[first + n];
            block.position[0][n] = p.x;
            block.position[1][n] = p.y;
            block.position[2][n] = p.z;
        }
        HWY_DYNAMIC_DISPATCH(noise_of_block)(block, lattice);
        std::copy_n(block.noise.data(), count, out.data() + first);
    }
}

double noise_structure(double distance) {
    constexpr double least = 0x1p-5; // below it the noise is linear, and differences here lose their digits
    if (distance < least) return noise_structure(least) * (distance / least) * (distance / least);
    // Directions of a spherical Fibonacci set would need sines; a cube's grid with its solid angles does.
    constexpr int grid = 6;
    double sum = 0, weights = 0;
    for (int a = 0; a < grid; ++a)
        for (int b = 0; b < grid; ++b) {
            const Vec3 p{1, (a + 0.5) / grid, (b + 0.5) / grid};
            const double norm = std::sqrt(length_squared(p)), solid = 1 / (norm * norm * norm);
            sum += solid * covariance(p * (distance / norm));
            weights += solid;
        }
    return 2 * (1 - sum / weights / covariance({}));
}

} // namespace obscura::terrain
#endif
