// SPDX-License-Identifier: Apache-2.0
// Checks of a sensor's model at load: finite, rising, and no charge from nothing.
#pragma once

#include "models/kinds/sensor_program.hpp"

#include <optional>
#include <string>
#include <vector>

namespace obscura::models {

/// Full wells up to which a model is tested.
inline constexpr double checked_wells = 4;

/// Range of signals in which a model is tested.
struct SensorConditions {
    double full_well_e = 50'000;
    double gain_dn_per_e = 0.08;
    double black_dn = 64;
    double noise_e = 8; ///< rms of the noise that convert() sees at black
    int width = 1024, height = 1024;
};

/// A function at one pixel.
struct SensorValue {
    double input = 0, result = 0;
    int x = 0, y = 0;
};

/// What one function does between darkness and four full wells (convert(): from six times the noise below
/// black), in 9 pixels of the array, without draws and with draws of 4 sigma.
struct SensorStageReport {
    SensorStage stage;
    std::optional<SensorValue> not_finite{}; ///< first
    std::optional<SensorValue> negative{};   ///< of light() and collect(): the least
    std::optional<SensorValue> gain{};       ///< collect() without draws: most charge beyond what comes in
    /// Largest fall, without draws: `result` is the value after it, `before` that before it.
    std::optional<SensorValue> fall{};
    double before = 0;
};
/// A row for each function that the model has.
[[nodiscard]] std::vector<SensorStageReport> report_on(const SensorProgram& sensor,
                                                       const SensorConditions& conditions);

/// Place in the text of the function that a refusal, else a warning, speaks of first.
[[nodiscard]] Place place_of(const SensorProgram& sensor, const std::vector<SensorStageReport>& report);
/// Why the model cannot be used; empty: it can.
[[nodiscard]] std::string refusal_by(const std::vector<SensorStageReport>& report);
/// What a user should know, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> warnings_by(const std::vector<SensorStageReport>& report);

} // namespace obscura::models
