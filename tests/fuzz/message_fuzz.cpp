// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: messages from other programs that no other target has: lines of the simulator port,
// answers of ptp4l, trigger datagrams.
//
// Input: a byte that chooses the parser (and for PTP the data set), then the message.
#include "emulator/simulator/simulator_protocol.hpp"
#include "sync/inputs/udp_input.hpp"
#include "sync/ptp_management.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string_view>
#include <variant>

using namespace obscura;
using test::require;

namespace {

bool printable(std::string_view text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c != 0x7F; });
}

void simulator_line(std::string_view text) {
    const emulator::SimulatorLine line = emulator::parse_simulator_line(text);
    if (const auto* bad = std::get_if<emulator::BadLine>(&line))
        require(!bad->why.empty() && printable(bad->why));
    if (const auto* step = std::get_if<emulator::StepLine>(&line))
        require(step->time.ns >= 0 && step->time.ns < 1'000'000'000 * ns_per_s);
    if (const auto* pose = std::get_if<emulator::PoseLine>(&line)) {
        require(!pose->name.empty() && pose->time.ns >= 0 && is_finite(pose->pose.position_m));
        require(std::abs(norm(pose->pose.orientation) - 1) < 1e-6);
    }
}

void ptp_answer(std::uint8_t choice, std::span<const std::uint8_t> message) {
    PtpStatus status;
    const PtpStatus before = status;
    const auto set = sync::ptp_data_sets[choice % sync::ptp_data_sets.size()];
    const bool taken = sync::ptp_take_answer(message, set, 0, 1, status);
    require(taken || status == before);
    require(status.state <= PtpState::slave);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const std::span message(data + 1, size - 1);
    switch (data[0] % 3) {
    case 0:
        simulator_line({reinterpret_cast<const char*>(message.data()), message.size()});
        break;
    case 1:
        ptp_answer(data[0] / 3, message);
        break;
    default: {
        sync::UdpTriggerMessage trigger;
        if (!sync::decode(message, trigger)) break;
        const auto again = sync::encode(trigger);
        require(std::equal(again.begin(), again.end(), message.begin(), message.end()));
    }
    }
    return 0;
}
