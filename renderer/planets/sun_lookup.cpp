// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/sun_lookup.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace obscura::renderer {
namespace {

/// Four texels in each of two levels.
constexpr int lookup_taps = 8;

/// Places of texels in SunTile::texels, and their weights.
struct alignas(64) Taps {
    std::int32_t texel[lookup_taps][packet_size];
    double weight[lookup_taps][packet_size];
};

/// 2^-k.
double inverse_power(std::int64_t k) {
    return std::bit_cast<double>((std::int64_t{1023} - k) << 52);
}

OBSCURA_VECTOR_CLONES
void find_taps(const SunLookups& at, Taps& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double width = std::min(std::max(at.width.v[i], 2.0), 256.0);
        const std::int64_t exponent = (std::bit_cast<std::int64_t>(width) >> 52) - 1023;
        const std::int64_t fine = std::min<std::int64_t>(exponent, SunTile::last_level - 1);
        const double coarse_share = width * inverse_power(fine) - 1;
        for (int k = 0; k < 2; ++k) {
            const std::int64_t level = fine + k, edge = std::int64_t{1} << (SunTile::last_level - level);
            // (4^n - 1) / 3 texels are in the n coarser levels.
            const std::int64_t offset =
                0x55555555 & ((std::int64_t{1} << (2 * (SunTile::last_level - level))) - 1);
            const double scale = inverse_power(level), last = static_cast<double>(edge - 1);
            const double tx = std::min(std::max(at.x.v[i] * scale - 0.5, 0.0), last);
            const double ty = std::min(std::max(at.y.v[i] * scale - 0.5, 0.0), last);
            const std::int64_t second = std::max<std::int64_t>(edge - 2, 0);
            const std::int64_t column = std::min(static_cast<std::int64_t>(tx), second);
            const std::int64_t row = std::min(static_cast<std::int64_t>(ty), second);
            const std::int64_t right = edge > 1 ? 1 : 0, down = edge > 1 ? edge : 0;
            const double s = tx - static_cast<double>(column), r = ty - static_cast<double>(row);
            const double share = k == 0 ? 1 - coarse_share : coarse_share;
            const std::int64_t first = offset + row * edge + column;
            const int t = 4 * k;
            out.texel[t][i] = static_cast<std::int32_t>(first);
            out.texel[t + 1][i] = static_cast<std::int32_t>(first + right);
            out.texel[t + 2][i] = static_cast<std::int32_t>(first + down);
            out.texel[t + 3][i] = static_cast<std::int32_t>(first + down + right);
            out.weight[t][i] = share * (1 - r) * (1 - s);
            out.weight[t + 1][i] = share * (1 - r) * s;
            out.weight[t + 2][i] = share * r * (1 - s);
            out.weight[t + 3][i] = share * r * s;
        }
    }
}

OBSCURA_VECTOR_CLONES
void sum_taps(const Taps& at, const std::uint32_t (&texels)[lookup_taps][packet_size], Vec3s& mean) {
    const auto part = [](std::uint32_t texel, int shift) {
        return static_cast<double>(static_cast<std::int32_t>(texel << shift) >> 22);
    };
    for (int i = 0; i < packet_size; ++i) {
        double x = 0, y = 0, z = 0;
        for (int t = 0; t < lookup_taps; ++t) {
            const std::uint32_t texel = texels[t][i];
            const double weight = at.weight[t][i];
            x += weight * part(texel, 22);
            y += weight * part(texel, 12);
            z += weight * part(texel, 2);
        }
        mean.x.v[i] = x * (1.0 / 511);
        mean.y.v[i] = y * (1.0 / 511);
        mean.z.v[i] = z * (1.0 / 511);
    }
}

} // namespace

void sun_means(const SunLookups& at, Vec3s& mean) {
    Taps places;
    find_taps(at, places);
    alignas(64) std::uint32_t texels[lookup_taps][packet_size];
    for (int i = 0; i < packet_size; ++i) {
        const SunTile* const tile = at.tile[static_cast<std::size_t>(i)];
        for (int t = 0; t < lookup_taps; ++t)
            texels[t][i] = tile != nullptr ? tile->texels[static_cast<std::size_t>(places.texel[t][i])] : 0;
    }
    sum_taps(places, texels, mean);
}

} // namespace obscura::renderer
