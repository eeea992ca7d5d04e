// SPDX-License-Identifier: Apache-2.0
// Sensor files and the section [sensor] of a configuration: keys, ranges and rules of a sensor's description.
#pragma once

#include "config/section.hpp"
#include "sensors/description.hpp"

#include <filesystem>
#include <string>

namespace obscura::sensors {

/// [sensor] with [sensor.readout] and [sensor.detector]; a sensor file has the same keys and tables at its
/// root. `sensor` holds the defaults and outlives the section.
[[nodiscard]] config::Section section_of(SensorDescription& sensor);
/// [sensor] with the key `file`, which names a sensor file that is read first.
[[nodiscard]] config::Section referring_section_of(SensorDescription& sensor);

/// Reads a sensor file alone. Throws ConfigError with a line for each mistake.
[[nodiscard]] SensorDescription load_sensor(const std::filesystem::path& file);

/// Reason for which no detector can be built: key, value and what is allowed, in the units of sensor files;
/// empty if one can. For descriptions that a program made.
[[nodiscard]] std::string explain_invalid(const DetectorSettings& settings);
[[nodiscard]] std::string explain_invalid(const SensorDescription& description);

} // namespace obscura::sensors
