// Sensor descriptions: the [sensor] section of a daemon's configuration and sensor files of their own.
#pragma once

#include "config/keys.hpp"
#include "core/sensor_description.hpp"

namespace obscura::config {

/// Reads the sensor keys of `table` into `sensor`: its own, [readout] and [detector]. With `may_refer`, a key
/// `file` names a sensor file that is read first; the other keys then override it. Values may be annotated
/// with their provenance. Throws ConfigError.
void read_sensor(const Value& table, const Where& where, SensorDescription& sensor, bool may_refer);

} // namespace obscura::config
