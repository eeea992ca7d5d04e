// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/sampled_packets.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::ephemeris {
namespace {

std::span<const double> component_of(const SampledPackets& packets, SampleWindow window,
                                     std::size_t component, std::array<double, max_samples>& out) {
    for (std::size_t i = 0; i < window.count; ++i)
        out[i] = packets.packet(window.first + i)[component];
    return std::span(out).first(window.count);
}

} // namespace

std::size_t SampledPackets::samples_up_to(double t, bool strictly) const noexcept {
    if (!times.empty()) {
        const auto end = strictly ? std::lower_bound(times.begin(), times.end(), t)
                                  : std::upper_bound(times.begin(), times.end(), t);
        return static_cast<std::size_t>(end - times.begin());
    }
    const double last = static_cast<double>(count);
    auto n = static_cast<std::size_t>(std::clamp(std::floor((t - first) / step) + 1, 0.0, last));
    // The division may be off by a rounding.
    while (n < count && (strictly ? time(n) < t : time(n) <= t))
        ++n;
    while (n > 0 && (strictly ? time(n - 1) >= t : time(n - 1) > t))
        --n;
    return n;
}

SampleWindow shifted_window(const SampledPackets& packets, double t) noexcept {
    const std::size_t after = packets.samples_up_to(t);
    const std::size_t low = after == 0 ? 0 : after - 1;
    std::size_t middle = low;
    if (packets.window % 2 == 1 && after < packets.count && packets.time(after) - t < t - packets.time(low))
        middle = after;
    const std::size_t before = (packets.window - 1) / 2;
    return {std::min(middle < before ? 0 : middle - before, packets.count - packets.window), packets.window};
}

SampleWindow shrunk_window(const SampledPackets& packets, std::size_t low, std::size_t begin,
                           std::size_t end) noexcept {
    const std::size_t half = std::max<std::size_t>(packets.window / 2, 1);
    const std::size_t left = std::min(half, low - begin + 1);
    const std::size_t right = std::min(half, end - (low + 1));
    return {low + 1 - left, left + right};
}

ValueAndRate lagrange_of(const SampledPackets& packets, SampleWindow window, std::span<const double> nodes,
                         std::size_t component) noexcept {
    std::array<double, max_samples> values;
    return lagrange(nodes, component_of(packets, window, component, values));
}

ValueAndRate hermite_of(const SampledPackets& packets, SampleWindow window, std::span<const double> nodes,
                        std::size_t component, std::size_t rate) noexcept {
    std::array<double, max_samples> values, rates;
    return hermite(nodes, component_of(packets, window, component, values),
                   component_of(packets, window, rate, rates));
}

} // namespace obscura::ephemeris
