// Sensor descriptions: the [sensor] section of a daemon's configuration and sensor files of their own.
#pragma once

#include "config/keys.hpp"
#include "sensors/description.hpp"

#include <filesystem>

namespace obscura::sensors {

/// Reads the sensor keys of `table` into `sensor`: its own, [readout] and [detector]. With `may_refer`, a key
/// `file` names a sensor file that is read first; the other keys then override it. Values may be annotated
/// with their provenance. Throws ConfigError.
void read_sensor(const config::Value& table, const config::Where& where, SensorDescription& sensor,
                 bool may_refer);

/// Reads a sensor file alone: the keys of [sensor] at its root, with the tables [readout] and [detector].
/// Throws ConfigError.
[[nodiscard]] SensorDescription load_sensor(const std::filesystem::path& file);

/// The sensor's own keys, and those of its tables [sensor.readout] and [sensor.detector].
[[nodiscard]] config::Keys keys_of(SensorDescription& sensor);
[[nodiscard]] config::Keys keys_of(ReadoutSettings& readout);
[[nodiscard]] config::Keys keys_of(DetectorSettings& detector);

} // namespace obscura::sensors
