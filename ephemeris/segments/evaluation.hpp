// SPDX-License-Identifier: Apache-2.0
// Outcome of evaluating a kernel at a time, for threads that must not throw.
#pragma once

#include <cstdint>

namespace obscura::ephemeris {

/// Why a state or a rotation is or is not known.
enum class Evaluation : std::uint8_t {
    ok,
    no_data,     ///< no kernel has data of the body or frame
    no_coverage, ///< none of them at this time
    no_common,   ///< the two bodies have no common centre
    unusable,    ///< the segment that holds at this time cannot be used
    damaged,     ///< the values in the kernel are no numbers
};

} // namespace obscura::ephemeris
