// SPDX-License-Identifier: Apache-2.0
// Segment of an SPK kernel: position and velocity of one body relative to another over an interval.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/kernels/daf.hpp"
#include "ephemeris/kernels/segment_data.hpp"
#include "ephemeris/time/epoch.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace obscura::ephemeris {

/// Geometric state of a body.
struct State {
    Vec3 position_m{};
    Vec3 velocity_m_s{};
};

/// Segment of type 1, 2, 3, 9, 13 or 21 (NAIF, SPK Required Reading). Its data must outlive it. Immutable,
/// thread-safe.
class SpkSegment {
public:
    /// Throws InputError for other types, for sizes that contradict each other and for times that do not
    /// increase.
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
    /// damaged. Real-time safe, but for the first access to a mapped file.
    [[nodiscard]] bool evaluate(TdbTime time, State& state) const noexcept;

private:
    void read_chebyshev();
    void read_differences();
    void read_samples();
    [[nodiscard]] bool chebyshev_state(TdbTime time, State& km) const noexcept;
    [[nodiscard]] bool difference_state(TdbTime time, State& km) const noexcept;
    [[nodiscard]] bool sampled_state(TdbTime time, State& km) const noexcept;

    std::string place_;
    std::span<const double> words_;
    std::int32_t target_ = 0, center_ = 0, frame_ = 0, type_ = 0;
    double begin_s_ = 0, end_s_ = 0;
    ChebyshevRecords records_;      ///< types 2 and 3
    std::span<const double> times_; ///< types 1, 9, 13, 21
    std::size_t window_ = 0;        ///< types 9 and 13: samples of an interpolation
    /// Types 1 and 21: doubles of a difference line, and its orders.
    std::size_t record_words_ = 0, differences_ = 0;
};

} // namespace obscura::ephemeris
