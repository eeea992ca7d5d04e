// SPDX-License-Identifier: Apache-2.0
// Readout diagram of a frame as SVG: sensor rows against time.
#pragma once

#include "sensors/sensor.hpp"

#include <string>
#include <string_view>

namespace obscura::tools {

/// SVG document that shows the integration time of each window's rows as an area between the line of resets
/// (dashed) and the line of reads (solid).
[[nodiscard]] std::string readout_picture(std::string_view title, const sensors::ReadoutPlan& plan);

} // namespace obscura::tools
