// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/wire/gvcp_parser.hpp"

#include "transports/gige/wire/bytes.hpp"

namespace obscura::transports::gige {
namespace {

constexpr std::size_t max_read_registers = gvcp_max_payload / 4;  // 135
constexpr std::size_t max_write_registers = gvcp_max_payload / 8; // 67

Status parse_read_registers(Request& r) noexcept {
    const std::size_t n = r.payload.size();
    if (n == 0 || n % 4 != 0 || n / 4 > max_read_registers) return Status::invalid_parameter;
    r.count = static_cast<std::uint16_t>(n / 4);
    return Status::success;
}

Status parse_write_registers(Request& r) noexcept {
    const std::size_t n = r.payload.size();
    if (n == 0 || n % 8 != 0 || n / 8 > max_write_registers) return Status::invalid_parameter;
    r.count = static_cast<std::uint16_t>(n / 8);
    return Status::success;
}

Status parse_read_memory(Request& r) noexcept {
    if (r.payload.size() != 8) return Status::invalid_parameter;
    r.address = load_be32(r.payload.data());
    r.count = load_be16(r.payload.data() + 6);
    if (r.address % 4 != 0) return Status::bad_alignment;
    if (r.count == 0 || r.count % 4 != 0 || r.count > gvcp_max_memory) return Status::invalid_parameter;
    return Status::success;
}

Status parse_write_memory(Request& r) noexcept {
    const std::size_t n = r.payload.size();
    if (n < 4) return Status::invalid_parameter;
    r.address = load_be32(r.payload.data());
    if (r.address % 4 != 0) return Status::bad_alignment;
    const std::size_t data = n - 4;
    if (data == 0 || data % 4 != 0 || data > gvcp_max_memory) return Status::invalid_parameter;
    return Status::success;
}

Status parse_resend(Request& r) noexcept {
    const std::uint8_t* p = r.payload.data();
    ResendRequest& q = r.resend;
    q.extended = (r.flags & gvcp_flag::extended_ids) != 0;
    if (r.payload.size() != (q.extended ? 20U : 12U)) return Status::invalid_parameter;
    q.channel = load_be16(p);
    // Standard ids have 24 bits; all ones there means the same as all ones in 32 bits.
    const std::uint32_t mask = q.extended ? 0xFFFFFFFFU : 0x00FFFFFFU;
    q.first = load_be32(p + 4) & mask;
    q.last = load_be32(p + 8) & mask;
    if (q.last == mask) q.last = 0xFFFFFFFFU;
    q.block_id = q.extended ? load_be64(p + 12) : load_be16(p + 2);
    if (q.block_id == 0 || q.first > q.last) return Status::invalid_parameter;
    return Status::success;
}

Status parse_action(Request& r) noexcept {
    const std::uint8_t* p = r.payload.data();
    r.action.scheduled = (r.flags & gvcp_flag::scheduled) != 0;
    if (r.payload.size() != (r.action.scheduled ? 20U : 12U)) return Status::invalid_parameter;
    r.action.device_key = load_be32(p);
    r.action.group_key = load_be32(p + 4);
    r.action.group_mask = load_be32(p + 8);
    if (r.action.scheduled) r.action.instant_ns = load_be64(p + 12);
    return Status::success;
}

Status parse_force_ip(Request& r) noexcept {
    if (r.payload.size() != 56) return Status::invalid_parameter;
    const std::uint8_t* p = r.payload.data();
    r.force_ip.mac = std::uint64_t{load_be16(p + 2)} << 32 | load_be32(p + 4);
    r.force_ip.ip = load_be32(p + 20);
    r.force_ip.mask = load_be32(p + 36);
    r.force_ip.gateway = load_be32(p + 52);
    return Status::success;
}

Status parse_payload(Request& r) noexcept {
    switch (r.command) {
    case Command::discovery:
        return r.payload.empty() ? Status::success : Status::invalid_parameter;
    case Command::force_ip:
        return parse_force_ip(r);
    case Command::packet_resend:
        return parse_resend(r);
    case Command::read_register:
        return parse_read_registers(r);
    case Command::write_register:
        return parse_write_registers(r);
    case Command::read_memory:
        return parse_read_memory(r);
    case Command::write_memory:
        return parse_write_memory(r);
    case Command::action:
        return parse_action(r);
    default:
        return Status::not_implemented;
    }
}

} // namespace

Request parse_gvcp(std::span<const std::uint8_t> datagram, bool broadcast) noexcept {
    Request r;
    if (datagram.size() < gvcp_header_bytes || datagram[0] != gvcp_key) return r;
    r.flags = datagram[1];
    r.command = static_cast<Command>(load_be16(datagram.data() + 2));
    r.id = load_be16(datagram.data() + 6);
    // Acknowledges have odd codes: if they were answered, two devices could answer each other for ever.
    if (r.id == 0 || (static_cast<std::uint16_t>(r.command) & 1) != 0) return r;
    const bool broadcastable =
        r.command == Command::discovery || r.command == Command::force_ip || r.command == Command::action;
    if (broadcast && !broadcastable) return r;

    if (load_be16(datagram.data() + 4) != datagram.size() - gvcp_header_bytes) {
        r.status = Status::invalid_header;
    } else {
        r.payload = datagram.subspan(gvcp_header_bytes);
        r.status = parse_payload(r);
    }
    if (r.status == Status::success) {
        r.kind = Request::Kind::run;
    } else if (r.wants_ack() && !broadcast) {
        r.kind = Request::Kind::reject;
    }
    return r;
}

} // namespace obscura::transports::gige
