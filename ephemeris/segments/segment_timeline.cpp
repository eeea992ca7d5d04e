// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/segment_timeline.hpp"

#include <algorithm>

namespace obscura::ephemeris {

void SegmentTimeline::add(Interval covered, std::int32_t segment) {
    if (pieces_.empty() || pieces_.back().covered.end_s <= covered.begin_s) {
        pieces_.push_back({covered, segment});
        return;
    }
    std::vector<Piece> kept;
    for (const Piece& p : pieces_) {
        if (p.covered.end_s <= covered.begin_s || p.covered.begin_s >= covered.end_s) {
            // A single instant within the new interval is covered by it.
            if (p.covered.begin_s < covered.begin_s || p.covered.end_s > covered.end_s) kept.push_back(p);
            continue;
        }
        if (p.covered.begin_s < covered.begin_s)
            kept.push_back({{p.covered.begin_s, covered.begin_s}, p.segment});
        if (p.covered.end_s > covered.end_s) kept.push_back({{covered.end_s, p.covered.end_s}, p.segment});
    }
    const auto after = std::upper_bound(kept.begin(), kept.end(), covered.begin_s,
                                        [](double t, const Piece& p) { return t < p.covered.begin_s; });
    kept.insert(after, {covered, segment});
    pieces_ = std::move(kept);
}

std::int32_t SegmentTimeline::at(double time_s) const noexcept {
    const auto after = std::upper_bound(pieces_.begin(), pieces_.end(), time_s,
                                        [](double t, const Piece& p) { return t < p.covered.begin_s; });
    if (after == pieces_.begin()) return -1;
    const Piece& piece = *(after - 1);
    return time_s <= piece.covered.end_s ? piece.segment : -1;
}

std::vector<double> SegmentTimeline::edges() const {
    std::vector<double> times;
    for (const Piece& p : pieces_)
        times.insert(times.end(), {p.covered.begin_s, p.covered.end_s});
    return times;
}

std::vector<Interval> SegmentTimeline::coverage() const {
    std::vector<Interval> intervals;
    for (const Piece& p : pieces_)
        intervals.push_back(p.covered);
    return merged(std::move(intervals));
}

std::vector<Interval> merged(std::vector<Interval> intervals) {
    std::sort(intervals.begin(), intervals.end(),
              [](const Interval& a, const Interval& b) { return a.begin_s < b.begin_s; });
    std::vector<Interval> result;
    for (const Interval& i : intervals) {
        if (!result.empty() && i.begin_s <= result.back().end_s)
            result.back().end_s = std::max(result.back().end_s, i.end_s);
        else
            result.push_back(i);
    }
    return result;
}

} // namespace obscura::ephemeris
