// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/coverage.hpp"

#include "ephemeris/segments/segment_timeline.hpp"

#include <erfa.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace obscura::ephemeris {

std::vector<Interval> where_known(std::vector<double> edges, const std::function<bool(TdbTime)>& known) {
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    constexpr double beyond_s = 86400, infinite = std::numeric_limits<double>::infinity();
    const auto known_at = [&](double time_s) { return known(TdbTime{} + time_s); };
    if (edges.empty())
        return known_at(0) ? std::vector{Interval{-infinite, infinite}} : std::vector<Interval>{};
    std::vector<Interval> covered;
    if (known_at(edges.front() - beyond_s)) covered.push_back({-infinite, edges.front()});
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const double from = edges[i];
        // An edge between two times that are not known may be an instant that is.
        if ((covered.empty() || covered.back().end_s < from) && known_at(from))
            covered.push_back({from, from});
        const bool last = i + 1 == edges.size();
        if (known_at(last ? from + beyond_s : (from + edges[i + 1]) / 2))
            covered.push_back({from, last ? infinite : edges[i + 1]});
    }
    return merged(std::move(covered));
}

std::string tdb_text(double tdb_s) {
    int year = 0, month = 0, day = 0;
    int clock[4]{};
    constexpr double max_s = 2e11;
    if (!(std::abs(tdb_s) < max_s) ||
        eraD2dtf("TDB", 3, 2451545.0, tdb_s / 86400, &year, &month, &day, clock) < 0)
        return fmt::format("{:.3f} s TDB", tdb_s);
    return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03} TDB", year, month, day, clock[0], clock[1],
                       clock[2], clock[3]);
}

std::string coverage_text(const std::vector<Interval>& covered) {
    if (covered.empty()) return "never";
    constexpr std::size_t most = 5;
    std::string text;
    for (std::size_t i = 0; i < std::min(covered.size(), most); ++i)
        text += fmt::format("{}{} to {}", i == 0 ? "" : ", ", tdb_text(covered[i].begin_s),
                            tdb_text(covered[i].end_s));
    if (covered.size() > most) text += fmt::format(", and {} more", covered.size() - most);
    return text;
}

} // namespace obscura::ephemeris
