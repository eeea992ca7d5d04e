// SPDX-License-Identifier: Apache-2.0
// Segments of trajectories and attitude profiles: samples over time with their interpolation.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/time/epoch.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::ephemeris {

/// Interpolation between the samples of a segment.
struct Interpolation {
    enum class Method : std::uint8_t {
        linear,   ///< attitude: slerp
        lagrange, ///< attitude: of the quaternion's components, then normalised
        hermite,  ///< with velocities; attitude: with rotation rates
    };
    Method method = Method::linear;
    std::uint32_t degree = 1; ///< of the polynomials, 1 to max_degree
};
/// Largest degree of an interpolation, as in SPICE.
inline constexpr std::uint32_t max_degree = 27;

/// Samples of position or attitude over a span of time.
struct PathSegment {
    Interpolation interpolation{};
    /// Span in which the samples may be interpolated, within that of the samples.
    Epoch start, stop;
    std::vector<Epoch> epochs; ///< at least one, strictly increasing
    // Trajectory, in the axes of its reference frame.
    std::vector<Vec3> position_m{}, velocity_m_s{};
    // Attitude profile: orientation of the object's axes in the reference frame, of unit norm; rotation rate
    // of the object in its own axes, empty: not stated.
    std::vector<Quat> orientation{};
    std::vector<Vec3> rate_rad_s{};
    /// Spin of an object whose orientations above are those without the spin: angle about its own z axis
    /// since the first sample, linear between samples; empty: none.
    std::vector<double> spin_rad{};
};

/// What a segment's values are of and relative to, as the file names them.
struct PathFrames {
    std::string object;   ///< spacecraft
    std::string centre;   ///< origin of positions, in capitals; empty: not stated
    std::string frame;    ///< reference frame, in capitals
    std::string of_frame; ///< of an attitude profile: the frame whose orientation it gives
};

/// Segments in the order of time, without overlap, all in the same frames.
struct PathFile {
    PathFrames frames;
    std::vector<PathSegment> segments; ///< at least one
};

/// Whether `frame` has the axes of a scene's inertial frame: ICRF, GCRF, EME2000 or J2000, which differ by
/// less than 0.03 arcsec.
[[nodiscard]] bool is_inertial_frame(std::string_view frame);

} // namespace obscura::ephemeris
