// SPDX-License-Identifier: Apache-2.0
// Descriptions of the packets for people and for ground systems, made from their tables.
#pragma once

#include <cstdint>
#include <string>

namespace obscura::instrument {

/// docs/reference/packets.md
[[nodiscard]] std::string packet_page(std::uint16_t first_apid);
/// XTCE 1.2 (OMG formal/18-10-04): telemetry containers and commands.
[[nodiscard]] std::string xtce_description(std::uint16_t first_apid);
/// cmd_tlm files of an OpenC3 COSMOS target.
[[nodiscard]] std::string cosmos_telemetry(std::uint16_t first_apid);
[[nodiscard]] std::string cosmos_commands(std::uint16_t first_apid);

} // namespace obscura::instrument
