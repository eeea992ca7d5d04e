// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: datagrams that obscura-instrument takes as telecommands.
#include "instrument/packets/space_packet.hpp"
#include "instrument/packets/telecommands.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>

using namespace obscura;
using test::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    constexpr std::uint16_t first_apid = 256;
    const std::span datagram(data, size);
    const auto command = instrument::read_telecommand(datagram, first_apid);
    if (!command) return 0;
    const auto header = instrument::read_header(datagram);
    require(header && header->command && header->apid == first_apid + instrument::telecommand_apid);
    require(command->sequence < instrument::sequence_modulus);
    if (command->result == instrument::CommandResult::done)
        require(command->function < instrument::telecommand_packets().size() &&
                std::isfinite(command->number));
    return 0;
}
