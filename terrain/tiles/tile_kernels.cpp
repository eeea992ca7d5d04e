// SPDX-License-Identifier: Apache-2.0
#include "terrain/tiles/tile_kernels.hpp"

#include "terrain/cube_sphere.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "terrain/tiles/tile_kernels.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace obscura::terrain::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;

void row_points(const SurfaceDomain& domain, std::uint8_t face, const TileRow& u, double v, Vec3* points,
                double* reductions) {
    const D d;
    const CubeFace& cube = cube_faces[face];
    const Vec3 radii = domain.radii_m();
    const V rx = hn::Set(d, radii.x), ry = hn::Set(d, radii.y), rz = hn::Set(d, radii.z);
    const V one = hn::Set(d, 1), unit = hn::Set(d, domain.unit_m());
    TileRow x, y, z, reduction;
    for (std::size_t n = 0; n < tile_row_size; n += hn::Lanes(d)) {
        const V along = hn::LoadU(d, u.data() + n);
        const auto at = [&](int axis) {
            return axis == cube.u_axis ? along : hn::Set(d, axis == cube.axis ? cube.sign : v);
        };
        const V px = at(0), py = at(1), pz = at(2);
        const auto squares = [](V a, V b, V c) {
            return hn::Add(hn::Add(hn::Mul(a, a), hn::Mul(b, b)), hn::Mul(c, c));
        };
        const V scale = hn::Div(one, hn::Sqrt(squares(px, py, pz)));
        const V sx = hn::Mul(hn::Mul(px, scale), rx), sy = hn::Mul(hn::Mul(py, scale), ry),
                sz = hn::Mul(hn::Mul(pz, scale), rz);
        hn::StoreU(sx, d, x.data() + n);
        hn::StoreU(sy, d, y.data() + n);
        hn::StoreU(sz, d, z.data() + n);
        hn::StoreU(hn::Div(unit, hn::Sqrt(squares(sx, sy, sz))), d, reduction.data() + n);
    }
    for (std::size_t n = 0; n < std::size_t{tile_edge}; ++n)
        points[n] = {x[n], y[n], z[n]};
    std::copy_n(reduction.data(), tile_edge, reductions);
}

QuantizedRange quantize_all(const TileHeights& to, double* heights, const double* reductions,
                            std::size_t count) {
    const D d;
    const V step = hn::Set(d, to.step), per_step = hn::Set(d, 1 / to.step); // exact: a power of two
    const V min_bound = hn::Set(d, to.least), largest_bound = hn::Set(d, to.largest);
    const V low = hn::Set(d, to.least - to.step), high = hn::Set(d, to.largest + to.step);
    V least = largest_bound, largest = min_bound;
    std::size_t outside = 0;
    const auto quantized = [&](V h, V reduction) {
        if (reductions != nullptr) h = hn::Mul(h, reduction);
        h = hn::Mul(step, hn::Round(hn::Mul(h, per_step)));
        // A NaN counts as outside.
        outside += hn::Lanes(d) - hn::CountTrue(d, hn::And(hn::Ge(h, low), hn::Le(h, high)));
        h = hn::IfThenElse(hn::Gt(h, min_bound), hn::Min(h, largest_bound), min_bound);
        least = hn::Min(least, h);
        largest = hn::Max(largest, h);
        return h;
    };
    std::size_t n = 0;
    for (; n + hn::Lanes(d) <= count; n += hn::Lanes(d))
        hn::StoreU(quantized(hn::LoadU(d, heights + n),
                             hn::LoadU(d, (reductions != nullptr ? reductions : heights) + n)),
                   d, heights + n);
    for (; n < count; ++n) {
        // All lanes alike: the odd ones count as many times.
        const std::size_t before = outside;
        const V h = quantized(hn::Set(d, heights[n]), hn::Set(d, reductions != nullptr ? reductions[n] : 1));
        outside = before + (outside > before ? 1 : 0);
        heights[n] = hn::GetLane(h);
    }
    return {hn::GetLane(hn::MinOfLanes(d, least)), hn::GetLane(hn::MaxOfLanes(d, largest)), outside};
}

void store_all(const double* heights, double offset, std::size_t count, float* out) {
    const D d;
    const hn::Rebind<float, D> floats;
    const V from = hn::Set(d, offset);
    std::size_t n = 0;
    for (; n + hn::Lanes(d) <= count; n += hn::Lanes(d))
        hn::StoreU(hn::DemoteTo(floats, hn::Sub(hn::LoadU(d, heights + n), from)), floats, out + n);
    for (; n < count; ++n)
        out[n] = static_cast<float>(heights[n] - offset);
}

void row_maxima(const float* first, const float* second, const float* third, float* maxima) {
    const hn::CappedTag<float, 16> f;
    std::array<float, tile_cells + 1> column;
    for (std::size_t i = 0; i < tile_cells; i += hn::Lanes(f))
        hn::StoreU(
            hn::Max(hn::Max(hn::LoadU(f, first + i), hn::LoadU(f, second + i)), hn::LoadU(f, third + i)), f,
            column.data() + i);
    column[tile_cells] = std::max(std::max(first[tile_cells], second[tile_cells]), third[tile_cells]);
    for (std::size_t i = 0; i < tile_cells / 2; ++i)
        maxima[i] = std::max(std::max(column[2 * i], column[2 * i + 1]), column[2 * i + 2]);
}

} // namespace
} // namespace obscura::terrain::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace obscura::terrain {

HWY_EXPORT(row_points);
HWY_EXPORT(quantize_all);
HWY_EXPORT(store_all);
HWY_EXPORT(row_maxima);

void make_row_points(const SurfaceDomain& domain, std::uint8_t face, const TileRow& u, double v, Vec3* points,
                     double* reductions) {
    HWY_DYNAMIC_DISPATCH(row_points)(domain, face, u, v, points, reductions);
}

QuantizedRange quantize(const TileHeights& to, double* heights, const double* reductions, std::size_t count) {
    return HWY_DYNAMIC_DISPATCH(quantize_all)(to, heights, reductions, count);
}

void store_heights(const double* heights, double offset, std::size_t count, float* out) {
    HWY_DYNAMIC_DISPATCH(store_all)(heights, offset, count, out);
}

void make_row_maxima(const float* first, const float* second, const float* third, float* maxima) {
    HWY_DYNAMIC_DISPATCH(row_maxima)(first, second, third, maxima);
}

} // namespace obscura::terrain
#endif
