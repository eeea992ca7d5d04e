// SPDX-License-Identifier: Apache-2.0
// Packets of numbers at times, and the window of them that an interpolation takes.
#pragma once

#include "ephemeris/segments/interpolation.hpp"

#include <cstddef>
#include <span>

namespace obscura::ephemeris {

/// Samples of SPK types 8, 9, 12, 13, 18, 19 and CK types 3, 5, 6. Times are seconds TDB since J2000 or
/// encoded ticks. The data must outlive it.
struct SampledPackets {
    std::span<const double> values;
    std::size_t packet_words = 0, count = 0;
    std::size_t window = 0;        ///< samples of one interpolation, at most max_samples
    std::span<const double> times; ///< increasing; empty: first + index * step
    double first = 0, step = 0;

    [[nodiscard]] double time(std::size_t index) const noexcept {
        return times.empty() ? first + static_cast<double>(index) * step : times[index];
    }
    [[nodiscard]] std::span<const double> packet(std::size_t index) const noexcept {
        return values.subspan(index * packet_words, packet_words);
    }
    /// Number of samples at or before `t` (`strictly`: before it).
    [[nodiscard]] std::size_t samples_up_to(double t, bool strictly = false) const noexcept;
};

/// Samples `first` to `first` + `count` - 1.
struct SampleWindow {
    std::size_t first = 0, count = 0;
};

/// Window around `t` that keeps its size at the ends, as in SPK types 8, 9, 12 and 13: odd windows are
/// centred on the nearest sample, even ones on the interval. Real-time safe.
[[nodiscard]] SampleWindow shifted_window(const SampledPackets& packets, double t) noexcept;
/// Window of half of `packets.window` samples on each side of the interval that begins at sample `low`,
/// fewer at the ends of the samples `begin` to `end` - 1, as in SPK types 18 and 19 and CK types 5 and 6.
[[nodiscard]] SampleWindow shrunk_window(const SampledPackets& packets, std::size_t low, std::size_t begin,
                                         std::size_t end) noexcept;

/// Component `component` of the packets of a window by Lagrange interpolation at `at`, whose times since each
/// node are `nodes` (equal in number).
[[nodiscard]] ValueAndRate lagrange_of(const SampledPackets& packets, SampleWindow window,
                                       std::span<const double> nodes, std::size_t component) noexcept;
/// The same by Hermite interpolation; `rate` is the component that holds its derivative.
[[nodiscard]] ValueAndRate hermite_of(const SampledPackets& packets, SampleWindow window,
                                      std::span<const double> nodes, std::size_t component,
                                      std::size_t rate) noexcept;

} // namespace obscura::ephemeris
