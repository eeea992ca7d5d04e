// SPDX-License-Identifier: Apache-2.0
// Definitions of reference frames by name or id: built-in ones, those of frame kernels, and IAU_ frames.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/kernels/body_names.hpp"
#include "ephemeris/kernels/kernel_pool.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace obscura::ephemeris {

/// Definition of a frame (NAIF, Frames Required Reading).
struct FrameDefinition {
    /// How its orientation is given.
    enum class Class {
        inertial,
        body,     ///< PCK
        attitude, ///< CK
        fixed,    ///< relative to another frame
    };
    std::string name;
    int id = 0;
    Class kind = Class::inertial;
    int class_id = 0;
    Quat to_base{};     ///< inertial and fixed: rotation to `base`
    std::string base{}; ///< fixed: name of the other frame; empty: ICRF
};

/// Definition of a frame by name. Throws InputError if it is unknown, of another class, or contradictory.
[[nodiscard]] FrameDefinition find_frame(const KernelPool& pool, const BodyNames& bodies,
                                         std::string_view name);
/// Name of the frame with an id; empty: unknown.
[[nodiscard]] std::string frame_name(const KernelPool& pool, int id);

} // namespace obscura::ephemeris
