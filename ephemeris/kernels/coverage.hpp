// SPDX-License-Identifier: Apache-2.0
// Intervals over which kernels know something, as a list and as text.
#pragma once

#include "ephemeris/segments/segment_data.hpp"
#include "ephemeris/time/epoch.hpp"

#include <functional>
#include <string>
#include <vector>

namespace obscura::ephemeris {

/// Intervals between `edges`, TDB s since J2000, in the middle of which `known` is true, before and after all
/// edges too; and the edges at which alone it is, as intervals of length 0.
[[nodiscard]] std::vector<Interval> where_known(std::vector<double> edges,
                                                const std::function<bool(TdbTime)>& known);
/// TDB as "2026-03-01T12:00:00.000 TDB".
[[nodiscard]] std::string tdb_text(double tdb_s);
/// Covered intervals as one line, at most some of them.
[[nodiscard]] std::string coverage_text(const std::vector<Interval>& covered);

} // namespace obscura::ephemeris
