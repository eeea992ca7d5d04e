// The readout of a frame as a picture: rows of the array against time.
#pragma once

#include "sensors/sensor.hpp"

#include <string>
#include <string_view>

namespace obscura::tools {

/// An SVG document: for each window the time its rows integrate as an area, with the line of resets (dashed)
/// and the line of reads (solid).
[[nodiscard]] std::string readout_picture(std::string_view title, const sensors::ReadoutPlan& plan);

} // namespace obscura::tools
