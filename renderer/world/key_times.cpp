// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/key_times.hpp"

#include "renderer/world/exposure.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Largest number of intervals in an exposure, about.
constexpr std::int64_t max_intervals = 16;
/// Motion, relative to the spacing, of which nothing is seen.
constexpr double still = 1.0 / 64;

/// Integral of a triangle of half width and height 1 from -infinity to `x`.
double triangle_integral(double x) {
    if (x <= -1) return 0;
    if (x >= 1) return 1;
    return x < 0 ? (1 + x) * (1 + x) / 2 : 1 - (1 - x) * (1 - x) / 2;
}

} // namespace

KeyTimes::KeyTimes(const scene::Scene& scene, const std::vector<BuiltBody>& bodies, const Projection& lens,
                   double reach_px, double spacing_px)
    : scene_(scene),
      bodies_(bodies),
      lens_(lens),
      reach_px_(reach_px),
      spacing_px_(spacing_px),
      live_(scene.camera.motion.live != nullptr ||
            std::any_of(bodies.begin(), bodies.end(),
                        [](const BuiltBody& b) { return b.motion.live != nullptr; })) {}

double KeyTimes::motion(int bits, std::int64_t index) {
    Measured& m = measured_[static_cast<std::size_t>(bits)];
    if (m.known && m.index == index) return m.motion_px;
    m = {true, index, 0};
    // In parts, each measured at both ends and in the middle: a whole turn of a body is seen.
    constexpr std::int64_t parts = 4;
    const std::int64_t from = index << bits;
    const std::int64_t step = (std::int64_t{1} << bits) / parts;
    for (std::int64_t i = 0; i < parts; ++i)
        m.motion_px += motion_px(scene_, bodies_, lens_, reach_px_,
                                 {Time{from + i * step}, Time{from + (i + 1) * step}});
    return m.motion_px;
}

void KeyTimes::find(const RowTime& row, std::vector<KeyTime>& keys) {
    keys.clear();
    const std::int64_t mid = row.mid().ns;
    const std::int64_t exposure = std::max<std::int64_t>(0, row.exposure_ns());
    if (live_) {
        keys.push_back({Time{mid >> live_bits << live_bits}, 1});
        return;
    }
    int bits = max_bits;
    while (bits > min_bits && motion(bits, mid >> bits) > spacing_px_ &&
           (std::int64_t{1} << bits) > exposure / max_intervals)
        --bits;
    while ((std::int64_t{1} << bits) < exposure / max_intervals)
        ++bits;
    const std::int64_t length = std::int64_t{1} << bits;
    if (exposure <= length && motion(bits, mid >> bits) <= still * spacing_px_) {
        keys.push_back({Time{(mid >> bits << bits) + length / 2}, 1});
        return;
    }
    const std::int64_t reset = exposure > 0 ? row.reset.ns : mid;
    const std::int64_t read = reset + exposure;
    for (std::int64_t k = reset >> bits; k <= (read >> bits) + 1; ++k) {
        const auto at = [&](std::int64_t ns) {
            return static_cast<double>(ns - k * length) / static_cast<double>(length);
        };
        const double weight = exposure > 0 ? (triangle_integral(at(read)) - triangle_integral(at(reset))) *
                                                 static_cast<double>(length) / static_cast<double>(exposure)
                                           : std::max(0.0, 1 - std::abs(at(mid)));
        if (weight > 0) keys.push_back({Time{k * length}, weight});
    }
}

} // namespace obscura::renderer
