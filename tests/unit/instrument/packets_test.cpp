// SPDX-License-Identifier: Apache-2.0
// Space packets: headers, time code, numbers, telecommands, and which frames are reported.
#include "core/time.hpp"
#include "instrument/packets/frame_reports.hpp"
#include "instrument/packets/space_packet.hpp"
#include "instrument/packets/telecommands.hpp"
#include "instrument/packets/telemetry.hpp"
#include "tests/support/catch.hpp"

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace packets_test {

using namespace obscura;
using namespace obscura::instrument;

namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint16_t first_apid = 256;

Bytes command_packet(const Bytes& data, std::uint16_t sequence = 7) {
    return make_packet({true, true, first_apid + telecommand_apid, sequence}, data);
}

TimingAnswer frames(std::uint64_t first, std::uint64_t last) {
    TimingAnswer answer{{"frame_id", "edge_ns", "first_ns"}, {}, last, {}};
    for (std::uint64_t i = first; i <= last; ++i)
        answer.rows.push_back(
            {static_cast<std::int64_t>(i), static_cast<std::int64_t>(100 * i), std::nullopt});
    return answer;
}

} // namespace

TEST_CASE("time codes count from 1958", "[instrument]") {
    CHECK(time_code(0).seconds == 378'691'200); // 12 years, three of them leap years
    CHECK(time_code(0).fraction == 0);
    CHECK(time_code(1'500'000'000).seconds == 378'691'201);
    CHECK(time_code(1'500'000'000).fraction == 1U << 23);
    CHECK(time_code(999'999'999).fraction == (1U << 24) - 1);
    CHECK(time_code(-1).seconds == 378'691'199);
    CHECK(time_code(-378'691'200 * ns_per_s).seconds == 0);
}

TEST_CASE("a primary header is that of CCSDS 133.0-B", "[instrument]") {
    const Bytes packet = make_packet({true, true, 0x103, 0x1234}, Bytes{9, 8, 7});
    CHECK(packet == Bytes{0x19, 0x03, 0xD2, 0x34, 0, 2, 9, 8, 7});
    CHECK(read_header(packet) == PacketHeader{true, true, 0x103, 0x1234});
    for (std::size_t size = 0; size < packet.size(); ++size)
        CHECK_FALSE(read_header(std::span(packet).first(size)));
    Bytes other = packet;
    other[0] |= 0x20; // version 2
    CHECK_FALSE(read_header(other));
    other = packet;
    other[2] &= 0x7F; // a segment
    CHECK_FALSE(read_header(other));
    other = packet;
    other.push_back(0);
    CHECK_FALSE(read_header(other));
}

TEST_CASE("fields clamp what they cannot hold", "[instrument]") {
    CHECK(encode(FieldType::u8, std::uint64_t{300}) == 255);
    CHECK(encode(FieldType::u24, std::uint64_t{1} << 30) == 0xFFFFFF);
    CHECK(encode(FieldType::u32, std::int64_t{-1}) == 0);
    CHECK(encode(FieldType::u64, std::nan("")) == 0);
    CHECK(encode(FieldType::u64, 1e300) == UINT64_MAX);
    CHECK(encode(FieldType::i64, std::int64_t{-2}) == UINT64_MAX - 1);
    CHECK(encode(FieldType::f32, 1.5) == std::bit_cast<std::uint32_t>(1.5F));
    CHECK(decode(FieldType::f64, encode(FieldType::f64, -2.5)) == -2.5);
    CHECK(decode(FieldType::i64, encode(FieldType::i64, std::int64_t{-7})) == -7);
}

TEST_CASE("telecommands are read by their table", "[instrument]") {
    Bytes exposure{4, 1};
    ByteWriter number;
    number.number(std::bit_cast<std::uint64_t>(2500.0), 8);
    exposure.insert(exposure.end(), number.bytes().begin(), number.bytes().end());
    const auto set = read_telecommand(command_packet(exposure, 16383), first_apid);
    REQUIRE(set);
    CHECK((set->result == CommandResult::done && set->camera == 1 && set->sequence == 16383));
    CHECK((set->feature == "ExposureTime" && set->number == 2500 && set->word.empty()));
    const auto source = read_telecommand(command_packet({8, 0, 2}), first_apid);
    CHECK((source && source->feature == "TriggerSource" && source->word == "Line1"));
    const auto result = [](const Bytes& data) {
        return read_telecommand(command_packet(data), first_apid)->result;
    };
    CHECK(result({3, 0}) == CommandResult::done);
    CHECK(result({3}) == CommandResult::malformed);
    CHECK(result({3, 0, 0}) == CommandResult::malformed);
    CHECK(result({8, 0, 5}) == CommandResult::malformed);
    CHECK(result({4, 0, 0x7F, 0xF0, 0, 0, 0, 0, 0, 0}) == CommandResult::malformed); // infinity
    CHECK(result({9, 0}) == CommandResult::unknown);
    CHECK(read_telecommand(make_packet({true, false, first_apid + telecommand_apid, 0}, Bytes{3, 0}),
                           first_apid)
              ->result == CommandResult::malformed);
    CHECK_FALSE(read_telecommand(make_packet({false, true, first_apid + telecommand_apid, 0}, Bytes{3, 0}),
                                 first_apid));
    CHECK_FALSE(read_telecommand(make_packet({true, true, first_apid, 0}, Bytes{3, 0}), first_apid));
    for (const PacketInfo& packet : telecommand_packets())
        CHECK(&packet - telecommand_packets().data() == packet.number);
}

TEST_CASE("mutated telecommands are read or refused", "[instrument]") {
    std::mt19937 dice(9); // NOLINT(cert-msc32-c,cert-msc51-cpp): the same packets each time
    for (int run = 0; run < 5000; ++run) {
        Bytes packet = command_packet({static_cast<std::uint8_t>(dice() % 10), 0, 0, 0, 0, 0, 0, 0, 0, 0});
        for (unsigned i = dice() % 4; i > 0; --i)
            packet[dice() % packet.size()] = static_cast<std::uint8_t>(dice());
        packet.resize(packet.size() - dice() % 2 * (dice() % packet.size()));
        if (const auto command = read_telecommand(packet, first_apid);
            command && command->result == CommandResult::done)
            REQUIRE((command->function < telecommand_packets().size() && std::isfinite(command->number)));
    }
}

TEST_CASE("each frame is reported once, and those without a report are counted", "[instrument]") {
    FrameReports reports;
    CHECK(reports.after() == FrameReports::none);
    CHECK(reports.take(0, {{}, {}, 10, {}}, 0).empty()); // frames of the past
    CHECK(reports.after() == 10);
    CHECK(reports.take(0, {{}, {}, 10, {}}, 0).empty());
    const auto three = reports.take(2, frames(11, 13), 5);
    REQUIRE(three.size() == 3);
    CHECK((three[0].frame.frame_id == 11 && three[0].edge_tai_ns() == 1105 && three[0].lost_before == 0 &&
           three[0].camera == 2));
    CHECK(three[0].frame.first == 0);
    const auto after_a_gap = reports.take(0, frames(20, 21), 0);
    REQUIRE(after_a_gap.size() == 2);
    CHECK((after_a_gap[0].lost_before == 6 && after_a_gap[1].lost_before == 0));
    CHECK(reports.take(0, {{}, {}, 3, {}}, 0).empty()); // an answer of a daemon that counts anew
    CHECK(reports.after() == 21);
    reports.begin_anew();
    CHECK(reports.take(0, frames(1, 3), 0).size() == 3);
}

TEST_CASE("a frame report has the saturated pixels, or says that they were not counted", "[instrument]") {
    const auto last_word = [](const FrameReport& report) {
        const Bytes packet = TelemetryWriter(first_apid).write(report, 0);
        return number_at(packet, packet.size() - 4, 4);
    };
    TimingAnswer answer{{"frame_id", "saturated"}, {{1, std::nullopt}, {2, 0}, {3, 77}}, 3, {}};
    FrameReports reports;
    reports.begin_anew();
    const auto three = reports.take(0, answer, 0);
    REQUIRE(three.size() == 3);
    CHECK(last_word(three[0]) == 0xFFFFFFFF);
    CHECK(last_word(three[1]) == 0);
    CHECK(last_word(three[2]) == 77);
    answer.columns.pop_back(); // of a daemon that does not count
    reports.begin_anew();
    CHECK(last_word(reports.take(0, answer, 0)[2]) == 0xFFFFFFFF);
}

TEST_CASE("telemetry counts packets of each kind", "[instrument]") {
    TelemetryWriter writer(first_apid);
    for (unsigned i = 0; i < sequence_modulus + 2; ++i) {
        const Bytes packet = writer.write(CommandReport{}, 0);
        REQUIRE(read_header(packet)->sequence == i % sequence_modulus);
    }
    const Bytes frame = writer.write(FrameReport{}, 0);
    CHECK(read_header(frame) == PacketHeader{false, true, first_apid + 1, 0});
    CHECK(writer.write(Housekeeping{}, 0).size() <= max_packet_bytes);
}

} // namespace packets_test
