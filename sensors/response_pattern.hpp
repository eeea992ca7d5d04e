// SPDX-License-Identifier: Apache-2.0
// Photo-response non-uniformity (PRNU) of one sensor specimen.
#pragma once

#include "sensors/description.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::sensors {

/// Relative response of every pixel to uniform light, mean 1, row-major; empty if uniform. What a flat field
/// shows: an EMVA 1288 evaluation of bright images gives back the configured values.
///
/// The local part is white. The global part has the standard deviation `prnu_global` over the array and
/// consists of, with the configured weights: a bowl, falling with the square of the distance from a point
/// within 5 % of the array's size from its centre (thickness of layers, incidence on the microlenses); a
/// linear gradient in any direction (processing of the wafer); columns with a gain each (column amplifiers);
/// and the fields of a stitched exposure with a gain each, which differ in steps at the seams.
[[nodiscard]] std::vector<float> response_pattern(const SensorDescription& description);

/// Why the weights do not describe a global part; empty: they do, or there is none.
[[nodiscard]] std::string explain_invalid_prnu(const DetectorSettings& settings);

} // namespace obscura::sensors
