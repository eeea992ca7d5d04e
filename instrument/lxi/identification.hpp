// SPDX-License-Identifier: Apache-2.0
// LXI identification document, and the HTTP answers that hand it out.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace obscura::instrument {

/// What the document tells.
struct LxiIdentity {
    std::string version;         ///< of this program
    std::string host;            ///< name of the machine
    std::string address;         ///< IPv4 address that the client has reached
    std::uint16_t http_port = 0; ///< and its port
    std::uint16_t scpi_port = 0; ///< 0: no SCPI
};

/// XML of the schema InstrumentIdentification/1.0; network settings that this program cannot know are empty.
[[nodiscard]] std::string lxi_identification(const LxiIdentity& identity);

/// HTTP answer to the head of a request: the document at /lxi/identification, a redirection to it at /lxi.
[[nodiscard]] std::string lxi_answer(std::string_view head, const LxiIdentity& identity);

} // namespace obscura::instrument
