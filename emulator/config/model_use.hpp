// SPDX-License-Identifier: Apache-2.0
// How the scenes of a daemon use models, by its configuration.
#pragma once

#include "core/realtime/realtime.hpp"
#include "emulator/config/daemon_config.hpp"
#include "models/values/model_use.hpp"

namespace obscura::emulator {

/// Models are read, and programs made and measured, at nice level 10 off the cores that the configuration
/// gives to rendering and to threads with a priority.
[[nodiscard]] models::ModelUse model_use(const DaemonConfig& config);

/// First call of a thread that reads models: name, nice level 10, and cores; none: any.
void enter_model_thread(const CoreSet& cores) noexcept;

} // namespace obscura::emulator
