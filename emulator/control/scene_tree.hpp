// SPDX-License-Identifier: Apache-2.0
// Description of the scene that a camera shows: bodies, lamps, and where their poses come from.
#pragma once

#include "emulator/config/daemon_config.hpp"
#include "emulator/simulator/simulator_server.hpp"
#include "service/call.hpp"

#include <nlohmann/json.hpp>

#include <functional>
#include <optional>

namespace obscura::emulator {

/// What the answer is made of.
struct ShownScene {
    const DaemonConfig& config; ///< of the camera
    const scene::Scene& scene;
    const PoseRings& rings;                     ///< empty without a simulator
    std::optional<SimulatorCounters> simulator; ///< none: no simulator can send poses
};

/// The answer to "scene.describe".
[[nodiscard]] nlohmann::json scene_tree(const ShownScene& shown);

/// The call "scene.describe"; `describe` answers for a camera of that number, or throws Failure.
[[nodiscard]] service::Call scene_tree_call(std::function<nlohmann::json(std::size_t camera)> describe);

} // namespace obscura::emulator
