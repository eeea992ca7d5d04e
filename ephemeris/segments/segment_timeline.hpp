// SPDX-License-Identifier: Apache-2.0
// Which segment of the loaded kernels holds at a time, by priority.
#pragma once

#include "ephemeris/segments/segment_data.hpp"

#include <cstdint>
#include <vector>

namespace obscura::ephemeris {

/// Intervals that do not overlap, each with the segment that SPICE would choose there.
class SegmentTimeline {
public:
    /// Adds a segment of higher priority than all before it.
    void add(Interval covered, std::int32_t segment);
    /// Segment at a time; -1: none. Real-time safe.
    [[nodiscard]] std::int32_t at(double time_s) const noexcept;
    /// Ends of the intervals of all segments, ascending.
    [[nodiscard]] std::vector<double> edges() const;
    /// Covered intervals in order; those that touch are one.
    [[nodiscard]] std::vector<Interval> coverage() const;

private:
    struct Piece {
        Interval covered;
        std::int32_t segment;
    };
    std::vector<Piece> pieces_; ///< ordered by time
};

/// Sorted intervals, in which those that touch or overlap are one.
[[nodiscard]] std::vector<Interval> merged(std::vector<Interval> intervals);

} // namespace obscura::ephemeris
