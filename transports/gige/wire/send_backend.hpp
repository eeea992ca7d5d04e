// SPDX-License-Identifier: Apache-2.0
// System calls that pass packets to the kernel (sendmmsg, sendto, UDP segmentation offload), and their names.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura::transports::gige {

/// One system call for a batch, one for each packet, or super-packets that the kernel or the network card
/// segments (UDP segmentation offload). `automatic` means gso, but sendmmsg on interfaces where receivers
/// that capture packets would see them unsegmented (loopback, veth, bridge, tap).
enum class SendBackend : std::uint8_t { sendmmsg, sendto, gso, automatic };
/// Names in the configuration.
constexpr auto enum_names(SendBackend /*type*/) {
    return std::array{EnumName{SendBackend::sendmmsg, "sendmmsg"}, EnumName{SendBackend::sendto, "sendto"},
                      EnumName{SendBackend::gso, "gso"}, EnumName{SendBackend::automatic, "auto"}};
}

} // namespace obscura::transports::gige
