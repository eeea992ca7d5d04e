// SPDX-License-Identifier: Apache-2.0
#include "sync/ptp_management.hpp"

namespace obscura::sync {
namespace {

constexpr std::size_t header_bytes = 34, management_bytes = 14, tlv_bytes = 6;
constexpr std::uint8_t management_message = 0xD;
constexpr std::uint8_t action_get = 0, action_response = 2;
constexpr std::uint16_t management_tlv = 1;

// IEEE 1588-2008, 15.5.3.
constexpr std::size_t data_bytes(PtpDataSet set) noexcept {
    switch (set) {
    case PtpDataSet::default_set:
        return 20;
    case PtpDataSet::current:
        return 18;
    case PtpDataSet::parent:
        return 32;
    case PtpDataSet::time_properties:
        return 4;
    case PtpDataSet::port:
        return 26;
    }
    return 0;
}

std::uint64_t big_endian(std::span<const std::uint8_t> bytes) {
    std::uint64_t value = 0;
    for (const std::uint8_t byte : bytes)
        value = value << 8 | byte;
    return value;
}

/// TimeInterval: nanoseconds times 65536.
std::int64_t interval_ns(std::span<const std::uint8_t> bytes) {
    return static_cast<std::int64_t>(big_endian(bytes.first(8))) / 65536;
}

constexpr int rank(PtpState state) noexcept {
    switch (state) {
    case PtpState::slave:
        return 9;
    case PtpState::uncalibrated:
        return 8;
    case PtpState::master:
        return 7;
    case PtpState::passive:
        return 6;
    case PtpState::pre_master:
        return 5;
    case PtpState::listening:
        return 4;
    case PtpState::initializing:
        return 3;
    case PtpState::faulty:
        return 2;
    case PtpState::disabled:
        return 1;
    case PtpState::unknown:
        return 0;
    }
    return 0;
}

} // namespace

std::array<std::uint8_t, ptp_get_bytes> ptp_get(PtpDataSet set, std::uint8_t domain, std::uint16_t sequence) {
    std::array<std::uint8_t, ptp_get_bytes> m{};
    m[0] = management_message;
    m[1] = 2; // versionPTP
    m[3] = ptp_get_bytes;
    m[4] = domain;
    m[30] = static_cast<std::uint8_t>(sequence >> 8);
    m[31] = static_cast<std::uint8_t>(sequence);
    m[32] = 4;    // controlField: management
    m[33] = 0x7F; // logMessageInterval
    for (std::size_t i = 34; i < 44; ++i)
        m[i] = 0xFF; // every clock, every port
    m[46] = action_get;
    m[49] = management_tlv;
    m[51] = 2; // length: the identifier alone
    const auto id = static_cast<std::uint16_t>(set);
    m[52] = static_cast<std::uint8_t>(id >> 8);
    m[53] = static_cast<std::uint8_t>(id);
    return m;
}

bool ptp_take_answer(std::span<const std::uint8_t> m, PtpDataSet set, std::uint8_t domain,
                     std::uint16_t sequence, PtpStatus& status) {
    const std::size_t wanted = header_bytes + management_bytes + tlv_bytes + data_bytes(set);
    if (m.size() < wanted) return false;
    const std::uint64_t length = big_endian(m.subspan(2, 2));
    if ((m[0] & 0x0F) != management_message || (m[1] & 0x0F) != 2 || length < wanted || length > m.size() ||
        m[4] != domain || big_endian(m.subspan(30, 2)) != sequence || (m[46] & 0x0F) != action_response)
        return false;
    const auto tlv = m.subspan(header_bytes + management_bytes);
    const std::uint64_t tlv_length = big_endian(tlv.subspan(2, 2));
    if (big_endian(tlv.first(2)) != management_tlv || tlv_length < 2 + data_bytes(set) ||
        4 + tlv_length > tlv.size() || big_endian(tlv.subspan(4, 2)) != static_cast<std::uint16_t>(set))
        return false;
    const auto data = tlv.subspan(tlv_bytes);
    switch (set) {
    case PtpDataSet::default_set:
        status.clock_accuracy = data[6];
        status.clock_id = big_endian(data.subspan(10, 8));
        break;
    case PtpDataSet::current:
        status.offset_ns = interval_ns(data.subspan(2));
        status.path_delay_ns = interval_ns(data.subspan(10));
        break;
    case PtpDataSet::parent:
        status.parent_id = big_endian(data.first(8));
        status.grandmaster_id = big_endian(data.subspan(24, 8));
        break;
    case PtpDataSet::time_properties:
        status.utc_offset_s = static_cast<std::int16_t>(big_endian(data.first(2)));
        status.ptp_timescale = (data[2] & 0x08) != 0;
        break;
    case PtpDataSet::port: {
        if (data[10] < 1 || data[10] > 9) return false;
        const auto state = static_cast<PtpState>(data[10]);
        if (rank(state) > rank(status.state)) status.state = state;
        break;
    }
    }
    return true;
}

} // namespace obscura::sync
