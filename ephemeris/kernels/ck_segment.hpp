// SPDX-License-Identifier: Apache-2.0
// Segment of a CK kernel: attitude of one instrument over an interval of its spacecraft's clock.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/kernels/daf.hpp"
#include "ephemeris/segments/ck_data.hpp"
#include "ephemeris/segments/evaluation.hpp"
#include "ephemeris/segments/segment_data.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace obscura::ephemeris {

/// Segment of type 1 to 6.
class CkSegment {
public:
    /// Throws InputError for other types and damaged segments.
    explicit CkSegment(const Daf::Array& array);
    [[nodiscard]] std::int32_t instrument() const { return instrument_; }
    [[nodiscard]] std::int32_t base() const { return base_; }
    [[nodiscard]] const std::string& place() const { return place_; }
    /// Intervals without a gap, in ticks.
    [[nodiscard]] const std::vector<Interval>& coverage() const { return covered_; }
    /// Rotation from the instrument's frame to the base frame; up to half a tick beside an interval, as a
    /// time is known to that, that of its end. no_coverage: `ticks` is in a gap. Real-time safe.
    [[nodiscard]] Evaluation orientation(double ticks, Quat& to_base) const noexcept;

private:
    std::string place_;
    std::int32_t instrument_ = 0, base_ = 0;
    double begin_ = 0, end_ = 0;
    std::shared_ptr<const CkData> data_;
    std::vector<Interval> covered_; ///< in order
};

} // namespace obscura::ephemeris
