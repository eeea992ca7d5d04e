// SPDX-License-Identifier: Apache-2.0
// EMVA 1288 characterisation of a sensor file by simulated series, beside its true values.
#pragma once

#include "sensors/sensor.hpp"
#include "tools/characterise/characterise_report.hpp"

namespace obscura::tools {

/// Measures the sensor in a simulated laboratory under light of `wavelength_m`, at which it must have a
/// quantum efficiency. Throws ConfigError if its figures cannot be measured.
[[nodiscard]] Characterisation characterise_preset(const SensorDescription& description, double wavelength_m);

} // namespace obscura::tools
