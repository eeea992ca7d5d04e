// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/control/control_port.hpp"

#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace obscura::transports::gige {

ControlPort::ControlPort(Device& device, const GigeSettings& settings, const NetworkInterface& network,
                         ControlListener* listener)
    : device_(device),
      network_(network),
      policy_(network, parse_address_ranges(settings.allow), settings.off_link),
      read_only_(settings.read_only),
      listener_(listener),
      heartbeat_reset_ms_(static_cast<std::uint32_t>(settings.heartbeat_timeout_ms)),
      bank_(device.registers()) {
    const Feature& heartbeat = feature("GevHeartbeatTimeout");
    bank_.add({.name = heartbeat.name,
               .address = reg::heartbeat_timeout,
               .access = Access::read_write,
               .reset = heartbeat_reset_ms_,
               .minimum = smallest_word(heartbeat),
               .maximum = static_cast<std::uint32_t>(settings.heartbeat_timeout_max_ms)});
    bank_.add({.name = "ControlSwitchoverKey",
               .address = reg::switchover_key,
               .access = Access::write_only,
               .maximum = 0xFFFF,
               .write = [this](std::uint32_t value) {
                   bank_.poke(reg::switchover_key, value);
                   return Status::success;
               }});
    bank_.add({.name = "GevCCP",
               .address = reg::control_privilege,
               .access = Access::read_write,
               .read = [this] { return privilege_; },
               .write = [this](std::uint32_t value) { return write_privilege(value); }});
    bank_.add({.name = "GevPrimaryApplicationSocket", .address = reg::primary_port, .read = [this] {
                   return std::uint32_t{controller_.port};
               }});
    bank_.add({.name = "GevPrimaryApplicationIPAddress", .address = reg::primary_ip, .read = [this] {
                   return controller_.ip;
               }});
}

std::span<const std::uint8_t> ControlPort::handle(std::span<const std::uint8_t> datagram, Peer from,
                                                  bool broadcast, Time now) {
    counters_.datagrams.fetch_add(1, std::memory_order_relaxed);
    if (!policy_.admits(from.ip)) {
        counters_.ignored.fetch_add(1, std::memory_order_relaxed);
        return {};
    }
    ++commands_;
    const FaultInjector& faults = device_.control_faults();
    if (const FaultRule* rule = faults.strikes(Fault::mute_control, commands_); rule != nullptr) {
        FaultInjector::count(*rule);
        counters_.muted.fetch_add(1, std::memory_order_relaxed);
        return {};
    }
    const Request request = parse_gvcp(datagram, broadcast);
    if (request.kind == Request::Kind::ignore) {
        counters_.ignored.fetch_add(1, std::memory_order_relaxed);
        return {};
    }
    if (request.kind == Request::Kind::reject) {
        counters_.rejected.fetch_add(1, std::memory_order_relaxed);
        return acknowledge(request, request.status);
    }
    const bool answered = request.wants_ack() && request.command != Command::packet_resend;
    if (is_controller(from)) {
        if (const FaultRule* rule = faults.strikes(Fault::heartbeat_loss, commands_); rule != nullptr)
            FaultInjector::count(*rule);
        else
            hear(now);
        if (answered && datagram.size() == last_request_bytes_ &&
            std::equal(datagram.begin(), datagram.end(), last_request_.begin())) {
            counters_.retries.fetch_add(1, std::memory_order_relaxed);
            return within_allowance({last_reply_.data(), last_reply_bytes_}, datagram.size(), from, now);
        }
    }
    const std::span<const std::uint8_t> reply = run(request, from, broadcast, now);
    device_.keep_state();
    if (is_controller(from) && answered && datagram.size() <= last_request_.size() && !reply.empty()) {
        std::copy(datagram.begin(), datagram.end(), last_request_.begin());
        std::copy(reply.begin(), reply.end(), last_reply_.begin());
        last_request_bytes_ = datagram.size();
        last_reply_bytes_ = reply.size();
    }
    if (!request.wants_ack()) return {};
    const std::span<const std::uint8_t> sent = within_allowance(reply, datagram.size(), from, now);
    if (sent.empty()) return {};
    if (const std::uint32_t delay_ms = device_.take_pending_ack_ms(); delay_ms > 0)
        return postpone(sent, from, now, delay_ms);
    return sent;
}

std::span<const std::uint8_t> ControlPort::within_allowance(std::span<const std::uint8_t> reply,
                                                            std::size_t request_bytes, Peer from, Time now) {
    // Limit answers longer than their request: only they amplify. Any source can be forged, the controller's
    // too.
    if (reply.size() <= request_bytes || policy_.spend(from.ip, reply.size(), now)) return reply;
    counters_.throttled.fetch_add(1, std::memory_order_relaxed);
    return {};
}

std::span<const std::uint8_t> ControlPort::postpone(std::span<const std::uint8_t> reply, Peer from, Time now,
                                                    std::uint32_t delay_ms) {
    std::copy(reply.begin(), reply.end(), pending_reply_.begin());
    pending_reply_bytes_ = reply.size();
    pending_peer_ = from;
    pending_due_ = now + std::int64_t{delay_ms} * ns_per_ms;
    if (!device_.announces_slow_commands()) return {};
    // Announce 1.5 times the delay and 100 ms more, so that the client does not give up early.
    const std::uint16_t id = load_be16(reply.data() + 6);
    store_be16(reply_.data(), static_cast<std::uint16_t>(Status::success));
    store_be16(reply_.data() + 2, static_cast<std::uint16_t>(Command::pending_ack) + 1);
    store_be16(reply_.data() + 4, 4);
    store_be16(reply_.data() + 6, id);
    store_be16(payload(), 0);
    store_be16(payload() + 2, static_cast<std::uint16_t>(delay_ms + delay_ms / 2 + 100));
    return {reply_.data(), gvcp_header_bytes + 4};
}

std::span<const std::uint8_t> ControlPort::take_due_reply(Time now, Peer& to) {
    if (pending_reply_bytes_ == 0 || now < pending_due_) return {};
    to = pending_peer_;
    return {pending_reply_.data(), std::exchange(pending_reply_bytes_, 0U)};
}

std::span<const std::uint8_t> ControlPort::acknowledge(const Request& request, Status status,
                                                       std::size_t bytes) {
    store_be16(reply_.data(), static_cast<std::uint16_t>(device_.status_codes().shown(status)));
    store_be16(reply_.data() + 2,
               static_cast<std::uint16_t>(static_cast<std::uint16_t>(request.command) + 1));
    store_be16(reply_.data() + 4, static_cast<std::uint16_t>(bytes));
    store_be16(reply_.data() + 6, request.id);
    return {reply_.data(), gvcp_header_bytes + bytes};
}

Status ControlPort::read_registers(const Request& request, std::size_t& bytes) {
    for (bytes = 0; bytes < request.payload.size(); bytes += 4) {
        std::uint32_t value = 0;
        const Status status = device_.read_word(load_be32(request.payload.data() + bytes), value);
        if (status != Status::success) return status;
        store_be32(payload() + bytes, value);
    }
    return Status::success;
}

Status ControlPort::write_registers(const Request& request, std::size_t& entries) {
    for (entries = 0; entries < request.count; ++entries) {
        const std::uint8_t* entry = request.payload.data() + 8 * entries;
        const Status status = device_.write_word(load_be32(entry), load_be32(entry + 4));
        if (status != Status::success) return status;
    }
    return Status::success;
}

std::span<const std::uint8_t> ControlPort::run(const Request& request, Peer from, bool broadcast, Time now) {
    asking_ = from;
    asked_ = now;
    const auto deny = [&] {
        counters_.denied.fetch_add(1, std::memory_order_relaxed);
        return acknowledge(request, Status::access_denied);
    };
    const bool locked_out = (privilege_ & privilege::exclusive) != 0 && !is_controller(from);
    // Every source may request control; all other writes require it.
    const auto may_write = [&](std::uint32_t address) {
        return is_controller(from) || address == reg::control_privilege;
    };

    switch (request.command) {
    case Command::discovery:
        bank_.read(0, {payload(), reg::discovery_bytes});
        return acknowledge(request, Status::success, reg::discovery_bytes);
    case Command::read_register: {
        if (locked_out) return deny();
        std::size_t bytes = 0;
        const Status status = read_registers(request, bytes);
        return acknowledge(request, status, bytes);
    }
    case Command::read_memory: {
        if (locked_out) return deny();
        store_be32(payload(), request.address);
        const Status status = device_.read(request.address, {payload() + 4, request.count});
        return acknowledge(request, status, status == Status::success ? 4U + request.count : 0U);
    }
    case Command::write_register: {
        for (std::size_t i = 0; i < request.count; ++i)
            if (!may_write(load_be32(request.payload.data() + 8 * i))) return deny();
        std::size_t entries = 0;
        const Status status = write_registers(request, entries);
        store_be32(payload(), static_cast<std::uint32_t>(entries));
        return acknowledge(request, status, 4);
    }
    case Command::write_memory: {
        if (!may_write(request.address)) return deny();
        if (!is_controller(from) && request.payload.size() > 8) return deny();
        std::size_t done = 0;
        const Status status = device_.write(request.address, request.payload.subspan(4), done);
        store_be32(payload(), static_cast<std::uint32_t>(done));
        return acknowledge(request, status, 4);
    }
    case Command::packet_resend:
        if (request.resend.channel == 0 && device_.may_ask_resend(from.ip)) {
            ResendRequest wanted = request.resend;
            wanted.trusted = is_controller(from) || from.port == bank_.peek(reg::stream_port);
            device_.resend(wanted);
        } else {
            counters_.resends_denied.fetch_add(1, std::memory_order_relaxed);
        }
        return {};
    case Command::action:
        if (Status status{}; device_.action(request.action, now, status)) return acknowledge(request, status);
        return {};
    case Command::force_ip:
        if (request.force_ip.mac != network_.mac) return {}; // meant for another device
        return acknowledge(request, force_ip(request.force_ip));
    default:
        return broadcast ? std::span<const std::uint8_t>{} : acknowledge(request, Status::not_implemented);
    }
}

Status ControlPort::force_ip(const ForceIpRequest& wanted) const {
    // The address of a controlled device stays.
    if (controlled()) return Status::access_denied;
    // The host owns its address: FORCEIP can only confirm it or request the usual configuration (address 0),
    // which leaves it unchanged.
    const bool stays = wanted.ip == 0 || (wanted.ip == network_.address && wanted.mask == network_.mask);
    return stays ? Status::success : Status::invalid_parameter;
}

Status ControlPort::write_privilege(std::uint32_t value) {
    const std::uint32_t bits = value & 0xFFFF;
    constexpr std::uint32_t known = privilege::control | privilege::exclusive | privilege::switchover_enable;
    if ((bits & ~known) != 0) return Status::invalid_parameter;
    if (read_only_) return Status::access_denied;
    if (controlled() && !is_controller(asking_)) {
        // Switchover: the controller has permitted takeover by an application that presents the key.
        const bool open = (privilege_ & privilege::switchover_enable) != 0 && bits != 0 &&
                          value >> 16 == bank_.peek(reg::switchover_key);
        if (!open) return Status::access_denied;
        device_.post(Event::application_switch, asked_);
        last_request_bytes_ = 0;
    }
    if (bits == 0) {
        if (controlled()) release("has left");
        return Status::success;
    }
    // A time-out is its controller's alone: the next one starts with the configured time-out.
    if (!is_controller(asking_)) bank_.poke(reg::heartbeat_timeout, heartbeat_reset_ms_);
    const bool was_free = !controlled();
    set_controller(asking_);
    privilege_ = bits;
    hear(asked_);
    device_.set_controller(asking_.ip);
    if (was_free) {
        counters_.control_taken.fetch_add(1, std::memory_order_relaxed);
        if (listener_ != nullptr)
            listener_->control_taken(client());
        else
            device_.control_taken(client());
    }
    return Status::success;
}

Time ControlPort::deadline() const noexcept {
    Time due = device_.next_action();
    if (pending_reply_bytes_ != 0) due = std::min(due, pending_due_);
    if (controlled()) due = std::min(due, heartbeat_deadline());
    return due;
}

void ControlPort::hear(Time now) noexcept {
    last_heard_ = now;
    counters_.heard_ns.store(now.ns, std::memory_order_relaxed);
}

Time ControlPort::heartbeat_deadline() const noexcept {
    return last_heard_ + std::int64_t{bank_.peek(reg::heartbeat_timeout)} * ns_per_ms;
}

void ControlPort::on_timer(Time now) {
    device_.run_actions(now);
    if (!controlled() || now < heartbeat_deadline()) return;
    counters_.control_lost.fetch_add(1, std::memory_order_relaxed);
    release(fmt::format("has been silent for {} ms", bank_.peek(reg::heartbeat_timeout)));
}

std::string ControlPort::client() const {
    return fmt::format("{}:{}", dotted(controller_.ip), controller_.port);
}

void ControlPort::set_controller(Peer peer) noexcept {
    controller_ = peer;
    shown_controller_ = std::uint64_t{peer.ip} << 16 | peer.port;
}

std::string ControlPort::controller() const {
    const std::uint64_t shown = shown_controller_;
    if (shown == 0) return {};
    return fmt::format("{}:{}", dotted(static_cast<std::uint32_t>(shown >> 16)), shown & 0xFFFF);
}

void ControlPort::release(std::string_view why) {
    const std::string sentence = controlled() ? fmt::format("client {} {}", client(), why) : std::string();
    set_controller({});
    privilege_ = 0;
    last_request_bytes_ = 0;
    bank_.poke(reg::heartbeat_timeout, heartbeat_reset_ms_);
    device_.control_lost();
    if (listener_ == nullptr || sentence.empty()) return;
    device_.load_start_settings();
    listener_->control_ended(sentence);
}

} // namespace obscura::transports::gige
