// SPDX-License-Identifier: Apache-2.0
#include "renderer/reprojection/resample.hpp"

#include "renderer/packets/packet.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

constexpr int taps = 6;
constexpr std::int32_t before = 2; ///< of the taps, left of the point's own pixel

/// 16 neighbouring pixels of a row.
struct alignas(64) Floats {
    float v[packet_size];
};

/// Displacements of 16 pixels: whole pixels and fractions, 0 .. 1.
struct Displacement {
    std::int32_t left[packet_size], up[packet_size];
    Floats x, y;
};

/// Weights of the points -2 .. 3 at `f`, 0 .. 1: the Lagrange polynomials.
inline void lagrange(float f, float& w0, float& w1, float& w2, float& w3, float& w4, float& w5) {
    const float a = f + 2;
    const float b = f + 1;
    const float c = f - 1;
    const float d = f - 2;
    const float e = f - 3;
    const float cd = c * d;
    const float ab = a * b;
    w0 = b * f * cd * e * (-1.0F / 120);
    w1 = a * f * cd * e * (1.0F / 24);
    w2 = ab * cd * e * (-1.0F / 12);
    w3 = ab * f * d * e * (1.0F / 12);
    w4 = ab * f * c * e * (-1.0F / 24);
    w5 = ab * f * cd * (1.0F / 120);
}

/// Whether all 16 have the same whole pixels.
OBSCURA_VECTOR_CLONES
bool split(const float* dx, const float* dy, Displacement& d) {
    std::int32_t different = 0;
    for (int i = 0; i < packet_size; ++i) {
        auto left = static_cast<std::int32_t>(dx[i]);
        auto up = static_cast<std::int32_t>(dy[i]);
        left -= static_cast<float>(left) > dx[i] ? 1 : 0;
        up -= static_cast<float>(up) > dy[i] ? 1 : 0;
        d.left[i] = left;
        d.up[i] = up;
        d.x.v[i] = dx[i] - static_cast<float>(left);
        d.y.v[i] = dy[i] - static_cast<float>(up);
    }
    for (int i = 0; i < packet_size; ++i)
        different |= (d.left[i] ^ d.left[0]) | (d.up[i] ^ d.up[0]);
    return different == 0;
}

/// `rows`: the six rows about the pixels, from the leftmost point of the first pixel.
OBSCURA_VECTOR_CLONES
void interpolate(const float* const* rows, const Displacement& d, const float* gain, double* out) {
    Floats x[taps];
    Floats y[taps];
    for (int i = 0; i < packet_size; ++i) {
        lagrange(d.x.v[i], x[0].v[i], x[1].v[i], x[2].v[i], x[3].v[i], x[4].v[i], x[5].v[i]);
        lagrange(d.y.v[i], y[0].v[i], y[1].v[i], y[2].v[i], y[3].v[i], y[4].v[i], y[5].v[i]);
    }
    Floats sum{};
    for (int j = 0; j < taps; ++j) {
        const float* const p = rows[j];
        for (int i = 0; i < packet_size; ++i)
            sum.v[i] += y[j].v[i] * (x[0].v[i] * p[i] + x[1].v[i] * p[i + 1] + x[2].v[i] * p[i + 2] +
                                     x[3].v[i] * p[i + 3] + x[4].v[i] * p[i + 4] + x[5].v[i] * p[i + 5]);
    }
    for (int i = 0; i < packet_size; ++i)
        out[i] = static_cast<double>(gain[i]) * static_cast<double>(sum.v[i] > 0 ? sum.v[i] : 0);
}

/// As interpolate(), for one pixel whose points may lie beyond the border.
float interpolate_one(const ResamplePlane& plane, std::int32_t x, std::int32_t y, float fx, float fy) {
    float wx[taps];
    float wy[taps];
    lagrange(fx, wx[0], wx[1], wx[2], wx[3], wx[4], wx[5]);
    lagrange(fy, wy[0], wy[1], wy[2], wy[3], wy[4], wy[5]);
    float sum = 0;
    for (int j = 0; j < taps; ++j) {
        const float* const from =
            plane.values +
            static_cast<std::ptrdiff_t>(std::clamp(y + j - before, 0, plane.height - 1)) * plane.width;
        const auto at = [&](int k) { return wx[k] * from[std::clamp(x + k - before, 0, plane.width - 1)]; };
        sum += wy[j] * (at(0) + at(1) + at(2) + at(3) + at(4) + at(5));
    }
    return sum > 0 ? sum : 0;
}

} // namespace

void resample_row(const ResamplePlane& plane, std::int32_t x, std::int32_t y, std::span<const float> dx,
                  std::span<const float> dy, std::span<const float> gain, double* out) {
    Displacement d;
    for (std::size_t at = 0; at < dx.size(); at += packet_size) {
        const std::int32_t left = x + static_cast<std::int32_t>(at);
        const std::size_t some = std::min<std::size_t>(packet_size, dx.size() - at);
        bool same = false;
        if (some == packet_size) {
            same = split(&dx[at], &dy[at], d);
        } else {
            Floats last_x{};
            Floats last_y{};
            std::copy_n(&dx[at], some, last_x.v);
            std::copy_n(&dy[at], some, last_y.v);
            static_cast<void>(split(last_x.v, last_y.v, d));
        }
        const std::int32_t first = left + d.left[0] - before;
        if (same && first >= 0 && first + packet_size + taps - 1 <= plane.width) {
            const float* rows[taps];
            for (int j = 0; j < taps; ++j)
                rows[j] =
                    plane.values +
                    static_cast<std::ptrdiff_t>(std::clamp(y + d.up[0] + j - before, 0, plane.height - 1)) *
                        plane.width +
                    first;
            interpolate(rows, d, &gain[at], out + at);
            continue;
        }
        for (std::size_t i = 0; i < some; ++i)
            out[at + i] =
                static_cast<double>(gain[at + i]) *
                static_cast<double>(interpolate_one(plane, left + static_cast<std::int32_t>(i) + d.left[i],
                                                    y + d.up[i], d.x.v[i], d.y.v[i]));
    }
}

} // namespace obscura::renderer
