// SPDX-License-Identifier: Apache-2.0
// Calls about the daemon itself: reload, log level, taking control away from a client, self-test.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "emulator/control/scene_requests.hpp"

#include <functional>
#include <string>

namespace obscura::emulator {

/// Takes control of a camera away from the client that has it, and returns that client's address; empty:
/// there was none. Throws Failure.
using ReleaseControl = std::function<std::string(std::size_t camera)>;

/// The calls "reload", "log_level", "release" and "self_test". The references outlive the calls.
[[nodiscard]] service::Calls daemon_calls(const CameraCalls::Cameras& cameras, SceneRequests& requests,
                                          ReleaseControl release);

} // namespace obscura::emulator
