// The tables of keys of every section; the structs they fill hold the defaults.
#pragma once

#include "config/keys.hpp"
#include "emulator/config/daemon_config.hpp"

namespace obscura::emulator {

[[nodiscard]] config::Keys keys_of(DaemonSection& section);
[[nodiscard]] config::Keys keys_of(RenderSection& section);
[[nodiscard]] config::Keys keys_of(LineSection& section);
/// Without its further lines.
[[nodiscard]] config::Keys keys_of(TriggerSection& section);
[[nodiscard]] config::Keys keys_of(PtpSection& section);
[[nodiscard]] config::Keys keys_of(DeadlineSection& section);
[[nodiscard]] config::Keys keys_of(ThreadsSection& section);
[[nodiscard]] config::Keys keys_of(SimulatorSection& section);
[[nodiscard]] config::Keys keys_of(OutputsSection& section);
[[nodiscard]] config::Keys keys_of(CameraSection& section);
[[nodiscard]] config::Keys keys_of(WindowSection& section);
[[nodiscard]] config::Keys keys_of(GigeSection& section);
[[nodiscard]] config::Keys keys_of(FaultSection& section);
[[nodiscard]] config::Keys keys_of(FileSection& section);
[[nodiscard]] config::Keys keys_of(V4l2Section& section);
[[nodiscard]] config::Keys keys_of(StimulatorSection& section);

} // namespace obscura::emulator
