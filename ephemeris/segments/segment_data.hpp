// SPDX-License-Identifier: Apache-2.0
// Counts and tables at the end of a kernel's segment, checked against its size.
#pragma once

#include "ephemeris/time/epoch.hpp"

#include <cstddef>
#include <span>
#include <string>

namespace obscura::ephemeris {

/// Covered interval, TDB s since J2000; of attitudes encoded ticks.
struct Interval {
    double begin_s = 0, end_s = 0;

    constexpr bool operator==(const Interval&) const = default;
};

/// Fixed-length Chebyshev records of SPK types 2 and 3 and binary PCK type 2.
struct ChebyshevRecords {
    std::span<const double> words;
    std::size_t count = 0, record_words = 0;
    double first_s = 0, interval_s = 0; ///< start of the first record, length of each

    /// Record that covers `time`, or the nearest, and the time in units of its radius from its middle. Empty:
    /// the record is damaged. Real-time safe.
    [[nodiscard]] std::span<const double> at(TdbTime time, double& x) const noexcept;
};
/// Reads the four values at the end of a segment; each record has `components` series. Throws InputError.
[[nodiscard]] ChebyshevRecords chebyshev_records(const std::string& place, std::span<const double> words,
                                                 std::size_t components);

/// Whole number from 1 to `most` in a segment; throws InputError naming `what`.
[[nodiscard]] std::size_t count_in(const std::string& place, double value, std::size_t most,
                                   const char* what);
/// Throws InputError unless times are finite and increase (`strictly`: are all different).
void require_increasing(const std::string& place, std::span<const double> times, bool strictly,
                        const char* what);
/// Intersects a covered interval with that of the data. Throws InputError if nothing is left.
void limit_coverage(const std::string& place, double& begin_s, double& end_s, double data_begin_s,
                    double data_end_s);
/// Entries of a directory of every hundredth of `n` times.
[[nodiscard]] constexpr std::size_t directory_size(std::size_t n) {
    return (n - 1) / 100;
}

} // namespace obscura::ephemeris
