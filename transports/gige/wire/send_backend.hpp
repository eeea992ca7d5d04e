// SPDX-License-Identifier: Apache-2.0
// Ways for packets to reach the kernel, and their names in the configuration.
#pragma once

#include "core/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura::transports::gige {

/// One system call for a batch, one for each packet, or super-packets that the kernel or the network card
/// cuts (UDP segmentation offload). `automatic` stands for gso except on interfaces where receivers that
/// capture packets would see them uncut (loopback, veth, bridge, tap), and there for sendmmsg.
enum class SendBackend : std::uint8_t { sendmmsg, sendto, gso, automatic };
/// Names in the configuration.
constexpr auto enum_names(SendBackend /*type*/) {
    return std::array{EnumName{SendBackend::sendmmsg, "sendmmsg"}, EnumName{SendBackend::sendto, "sendto"},
                      EnumName{SendBackend::gso, "gso"}, EnumName{SendBackend::automatic, "auto"}};
}

} // namespace obscura::transports::gige
