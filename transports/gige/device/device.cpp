// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/device.hpp"

#include "core/realtime/log.hpp"
#include "transports/gige/device/action_queue.hpp"
#include "transports/gige/device/bootstrap_registers.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/device/regions.hpp"
#include "transports/gige/device/stream_channel.hpp"
#include "transports/gige/device/test_control.hpp"
#include "transports/gige/device/user_sets.hpp"
#include "transports/gige/genicam/camera_xml.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <fmt/format.h>

namespace obscura::transports::gige {

Device::Device(const GigeSettings& settings, const NetworkInterface& network, CameraControl& control,
               StreamPort& stream, MessageChannel& messages, const Clock& clock, std::uint64_t seed)
    : context_(settings, network, control, stream, messages, clock, seed) {
    context_.bank.set_lock([this] { return context_.control.acquiring(); });
    reset_regions(context_);
    add_bootstrap_registers(context_);
    add_feature_registers(context_);
    add_xml();
    context_.default_set = saved_features(context_);
    read_state_file(context_);
    publish_faults(context_);
}

void Device::add_xml() {
    const std::span<const std::uint8_t> zip = zipped_camera_xml();
    RegisterBank& bank = context_.bank;
    std::string url = fmt::format("Local:obscura_camera.zip;{:X};{:X}", xml_file_address, zip.size());
    if (const GigeSettings& s = context_.settings; !s.xml.empty()) {
        user_xml_ =
            std::make_unique<UserXml>(s.xml, read_xml_file(s.xml), s.xml_values, bank, feature_table());
        url = user_xml_->url();
    }
    bank.add_string("XMLFirstURL", reg::xml_url_first, 512, Access::read_only, url);
    bank.add_string("XMLSecondURL", reg::xml_url_second, 512, Access::read_only, "");
    if (!user_xml_) bank.add_block("XMLFile", xml_file_address, zip);
}

Status Device::read(std::uint32_t address, std::span<std::uint8_t> out) {
    return user_xml_ ? user_xml_->read(address, out) : context_.bank.read(address, out);
}

Status Device::write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done) {
    return user_xml_ ? user_xml_->write(address, bytes, done) : context_.bank.write(address, bytes, done);
}

Status Device::read_word(std::uint32_t address, std::uint32_t& value) {
    std::uint8_t bytes[4] = {};
    const Status status = read(address, bytes);
    value = load_be32(bytes);
    return status;
}

Status Device::write_word(std::uint32_t address, std::uint32_t value) {
    std::uint8_t bytes[4];
    store_be32(bytes, value);
    std::size_t done = 0;
    return write(address, bytes, done);
}

void Device::keep_state() {
    if (context_.state_changed) write_state_file(context_);
}

std::string Device::xml_report() const {
    return user_xml_ ? user_xml_->report() : std::string();
}

bool Device::announces_slow_commands() const {
    return (context_.bank.peek(reg::gvcp_configuration) & gvcp_configuration::pending_ack) != 0;
}

StatusCodes Device::status_codes() const {
    return gige::status_codes(context_);
}

void Device::arm_faults(const std::vector<FaultRule>& rules) {
    context_.armed_faults.replace(rules);
    publish_faults(context_);
}

void Device::control_taken(const std::string& client) {
    if (!context_.control.acquiring()) return;
    acquisition_stop(context_);
    log_notice("gige: client {} has taken control; the acquisition that ran without it stops", client);
}

void Device::control_lost() {
    acquisition_stop(context_);
    context_.bank.poke(reg::stream_port, 0);
    context_.bank.poke(reg::message_port, 0);
    configure_messages(context_);
    context_.actions = {};
    context_.channel_fresh = true;
    context_.controller_ip = 0;
    clear_control_faults(context_); // no client can do that, as commands are ignored
}

void Device::load_start_settings() {
    // Multi-part payload would exclude binning, which the set may hold.
    context_.bank.poke(reg::stream_configuration, context_.bank.find(reg::stream_configuration)->reset);
    load_default_set(context_);
    if (user_xml_) user_xml_->show_all();
}

bool Device::action(const ActionRequest& request, Time now, Status& status) {
    return take_action(context_, request, now, status);
}

Time Device::next_action() const noexcept {
    return gige::next_action(context_);
}

void Device::run_actions(Time now) {
    gige::run_actions(context_, now);
}

bool Device::may_ask_resend(std::uint32_t ip) const noexcept {
    const std::uint32_t destination = context_.bank.peek(reg::stream_destination);
    return ip != 0 && (ip == context_.controller_ip || ip == destination ||
                       (is_multicast(destination) && context_.network.on_link(ip)));
}

} // namespace obscura::transports::gige
