// SPDX-License-Identifier: Apache-2.0
// Trial of the devices, ports and permissions that a configuration needs, without starting the camera.
#pragma once

#include "core/text/enum_names.hpp"
#include "emulator/config/daemon_config.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::tools {

enum class DeviceState : std::uint8_t {
    ok,
    missing, ///< the daemon starts without it, and waits for it or does less
    failed,  ///< the daemon does not start
};
constexpr auto enum_names(DeviceState /*type*/) {
    return std::array{EnumName{DeviceState::ok, "ok"}, EnumName{DeviceState::missing, "missing"},
                      EnumName{DeviceState::failed, "failed"}};
}

/// Result of one trial.
struct DeviceTrial {
    std::string device; ///< key and value that name it
    DeviceState state = DeviceState::ok;
    std::string text; ///< what was found, or what is wrong and what helps
};

/// Opens and closes everything that the cameras of `config` name: network interface, UDP ports, GPIO lines,
/// PPS, PTP and video nodes, displays, folders; and asks for the real-time permissions. Trigger sources run
/// for an instant, output lines become inactive. Whatever a running daemon holds is reported as in use.
[[nodiscard]] std::vector<DeviceTrial> try_devices(const emulator::DaemonConfig& config);

} // namespace obscura::tools
