// The tables of keys of every section; the structs they fill hold the defaults.
#pragma once

#include "config/config.hpp"
#include "config/keys.hpp"

namespace obscura::config {

[[nodiscard]] Keys keys_of(DaemonSection& section);
[[nodiscard]] Keys keys_of(RenderSection& section);
[[nodiscard]] Keys keys_of(LineSection& section);
/// Without its further lines.
[[nodiscard]] Keys keys_of(TriggerSection& section);
[[nodiscard]] Keys keys_of(PtpSection& section);
[[nodiscard]] Keys keys_of(DeadlineSection& section);
[[nodiscard]] Keys keys_of(ThreadsSection& section);
[[nodiscard]] Keys keys_of(SimulatorSection& section);
[[nodiscard]] Keys keys_of(OutputsSection& section);
[[nodiscard]] Keys keys_of(CameraSection& section);
[[nodiscard]] Keys keys_of(WindowSection& section);
[[nodiscard]] Keys keys_of(GigeSection& section);
[[nodiscard]] Keys keys_of(FaultSection& section);
[[nodiscard]] Keys keys_of(FileSection& section);
[[nodiscard]] Keys keys_of(V4l2Section& section);
[[nodiscard]] Keys keys_of(StimulatorSection& section);

/// [sensor]: the sensor's own keys and those of its tables [sensor.readout] and [sensor.detector]. A sensor
/// file has the same keys and tables at its root.
[[nodiscard]] Keys keys_of(SensorDescription& sensor);
[[nodiscard]] Keys keys_of(ReadoutSettings& readout);
[[nodiscard]] Keys keys_of(DetectorSettings& detector);

} // namespace obscura::config
