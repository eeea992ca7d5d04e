// SPDX-License-Identifier: Apache-2.0
// Evaluation of trajectories and attitude profiles: interpolation within segments, limited extrapolation
// after them.
#pragma once

#include "ephemeris/trajectories/path_segment.hpp"

#include <vector>

namespace obscura::ephemeris {

/// Trajectory or attitude profile as a function of time. Within a segment it is interpolated; from the end of
/// a segment on, or back from the first one's beginning, it goes on with the rates there for
/// `max_extrapolation_s` and then holds: stated rates where the file has them, else those between the last
/// two samples. Thread-safe, real-time safe after construction.
class SampledPath {
public:
    /// Times are seconds of TAI since `zero`.
    SampledPath(PathFile file, Epoch zero, double max_extrapolation_s);

    /// Position on a trajectory, at any finite time.
    [[nodiscard]] Vec3 position_m(double time_s) const noexcept;
    /// Derivative of position_m() by time, m/s: 0 where it holds.
    [[nodiscard]] Vec3 velocity_m_s(double time_s) const noexcept;
    /// Orientation of an attitude profile, of unit norm, at any finite time.
    [[nodiscard]] Quat orientation(double time_s) const noexcept;
    /// Time since the end of the last segment that has begun, or up to the beginning of the first; 0 within
    /// one.
    [[nodiscard]] double age_s(double time_s) const noexcept;

    [[nodiscard]] const PathFrames& frames() const noexcept { return frames_; }
    /// Times of the samples that may be interpolated, ascending.
    [[nodiscard]] std::vector<double> times_s() const;

private:
    /// Instant within a segment, and the time by which the one that was asked for is later.
    struct Place {
        const PathSegment* segment = nullptr;
        Epoch at;
        double fraction_s = 0; ///< to add to `at`
        double beyond_s = 0;   ///< negative: earlier
    };
    [[nodiscard]] Place find(double time_s) const noexcept;

    PathFrames frames_;
    std::vector<PathSegment> segments_;
    Epoch zero_;
    double max_extrapolation_s_;
};

} // namespace obscura::ephemeris
