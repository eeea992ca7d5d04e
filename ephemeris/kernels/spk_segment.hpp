// SPDX-License-Identifier: Apache-2.0
// Segment of an SPK kernel: position and velocity of one body relative to another over an interval.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/kernels/daf.hpp"
#include "ephemeris/segments/spk_data.hpp"
#include "ephemeris/time/epoch.hpp"

#include <cstdint>
#include <memory>
#include <string>

namespace obscura::ephemeris {

/// Geometric state of a body.
struct State {
    Vec3 position_m{};
    Vec3 velocity_m_s{};
};

/// Segment of any type of make_spk_data(). The file's data must outlive it. Immutable, thread-safe; copies
/// share the data.
class SpkSegment {
public:
    /// Throws InputError for a body relative to itself, and as make_spk_data().
    explicit SpkSegment(const Daf::Array& array);

    [[nodiscard]] std::int32_t target() const { return target_; }
    [[nodiscard]] std::int32_t center() const { return center_; }
    /// Reference frame of the states: NAIF id, 1 is J2000.
    [[nodiscard]] std::int32_t frame() const { return frame_; }
    [[nodiscard]] std::int32_t type() const { return type_; }
    /// Covered interval, TDB s since J2000: of the descriptor, where the data reach.
    [[nodiscard]] double begin_s() const { return begin_s_; }
    [[nodiscard]] double end_s() const { return end_s_; }
    /// "FILE: segment 3 (NAME)".
    [[nodiscard]] const std::string& place() const { return place_; }

    /// Sets `state` in the frame of the segment, at a time in the covered interval. False: the data are
    /// damaged. Real-time safe.
    [[nodiscard]] bool evaluate(TdbTime time, State& state) const noexcept;

private:
    std::string place_;
    std::int32_t target_ = 0, center_ = 0, frame_ = 0, type_ = 0;
    double begin_s_ = 0, end_s_ = 0;
    std::shared_ptr<const SpkData> data_;
};

} // namespace obscura::ephemeris
