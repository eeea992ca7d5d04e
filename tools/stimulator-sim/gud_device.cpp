// SPDX-License-Identifier: Apache-2.0
#include "tools/stimulator-sim/gud_device.hpp"

#include <fmt/format.h>
#include <lz4.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <utility>

namespace obscura::tools {

using gud::Request;
using gud::Status;

namespace {

template<std::size_t n>
std::vector<std::uint8_t> bytes_of(const std::array<std::uint8_t, n>& a) {
    return {a.begin(), a.end()};
}

} // namespace

GudDevice::GudDevice(GudDeviceSettings settings) : settings_(std::move(settings)) {
    assert(!settings_.formats.empty());
    reset();
}

void GudDevice::reset() {
    last_status_ = Status::ok;
    state_ = {};
    state_.mode = mode();
    state_.format = settings_.formats.front();
    has_checked_ = committed_ = controller_on_ = display_on_ = false;
    announced_.reset();
    screen_.resize(std::size_t{settings_.width} * settings_.height *
                   static_cast<std::size_t>(gud::bytes_per_pixel(state_.format)));
}

gud::Mode GudDevice::mode() const {
    gud::Mode m;
    m.hdisplay = settings_.width;
    m.hsync_start = static_cast<std::uint16_t>(m.hdisplay + 8);
    m.hsync_end = static_cast<std::uint16_t>(m.hdisplay + 16);
    m.htotal = static_cast<std::uint16_t>(m.hdisplay + 32);
    m.vdisplay = settings_.height;
    m.vsync_start = static_cast<std::uint16_t>(m.vdisplay + 4);
    m.vsync_end = static_cast<std::uint16_t>(m.vdisplay + 8);
    m.vtotal = static_cast<std::uint16_t>(m.vdisplay + 16);
    m.clock_khz = static_cast<std::uint32_t>(std::lround(settings_.refresh_hz * m.htotal * m.vtotal / 1000));
    m.flags = 1u << 10;
    return m;
}

void GudDevice::refuse(Status status, std::string why) {
    last_status_ = status;
    complaint_ = std::move(why);
}

std::optional<std::vector<std::uint8_t>> GudDevice::control_in(std::uint8_t request, std::uint16_t value,
                                                               std::size_t length, std::uint64_t now_ns) {
    std::vector<std::uint8_t> answer;
    switch (static_cast<Request>(request)) {
    case Request::get_status:
        answer = {static_cast<std::uint8_t>(last_status_)};
        last_status_ = Status::ok;
        break;
    case Request::get_descriptor: {
        gud::Descriptor d;
        d.flags = gud::status_on_set | (settings_.full_update ? gud::full_update : 0u);
        d.compression = settings_.lz4 && !settings_.full_update ? gud::compression_lz4 : std::uint8_t{0};
        d.max_buffer_size = settings_.max_buffer_size;
        d.min_width = d.max_width = settings_.width;
        d.min_height = d.max_height = settings_.height;
        answer = bytes_of(gud::encode(d));
        break;
    }
    case Request::get_formats:
        for (const gud::Format f : settings_.formats)
            answer.push_back(static_cast<std::uint8_t>(f));
        break;
    case Request::get_connectors:
        answer = bytes_of(gud::encode(gud::Connector{}));
        break;
    case Request::get_properties:
        break;
    case Request::get_connector_properties:
    case Request::get_connector_edid:
    case Request::get_connector_status:
    case Request::get_connector_modes:
        if (value != 0) {
            refuse(Status::invalid_parameter, fmt::format("asked for connector {}", value));
            return std::nullopt;
        }
        if (static_cast<Request>(request) == Request::get_connector_status) answer = {1};
        if (static_cast<Request>(request) == Request::get_connector_modes)
            answer = bytes_of(gud::encode(mode()));
        break;
    case Request::get_frame_status:
        if (settings_.frame_status) {
            frame_.now_ns = now_ns;
            answer = bytes_of(gud::encode(frame_));
            break;
        }
        [[fallthrough]];
    default:
        refuse(Status::request_not_supported, fmt::format("unknown request 0x{:02x}", request));
        return std::nullopt;
    }
    answer.resize(std::min(answer.size(), length));
    return answer;
}

bool GudDevice::knows_control_out(std::uint8_t request) const {
    switch (static_cast<Request>(request)) {
    case Request::set_connector_force_detect:
    case Request::set_buffer:
    case Request::set_state_check:
    case Request::set_state_commit:
    case Request::set_controller_enable:
    case Request::set_display_enable:
        return true;
    default:
        return false;
    }
}

void GudDevice::control_out(std::uint8_t request, std::uint16_t value, std::span<const std::uint8_t> data) {
    last_status_ = Status::ok;
    switch (static_cast<Request>(request)) {
    case Request::set_connector_force_detect:
        if (value != 0) refuse(Status::invalid_parameter, fmt::format("connector {}", value));
        break;
    case Request::set_buffer: {
        gud::SetBuffer buffer;
        if (auto why = gud::decode(data, settings_.width, settings_.height, state_.format, buffer);
            !why.empty()) {
            ++frame_.errors;
            refuse(data.size() == gud::set_buffer_size ? Status::invalid_parameter : Status::protocol_error,
                   why);
        } else if (!display_on_ || !committed_) {
            refuse(Status::error, "buffer request while the display is off");
        } else if (buffer.compression != 0 && (!settings_.lz4 || settings_.full_update)) {
            refuse(Status::invalid_parameter, "compressed buffer, but compression was not offered");
        } else if (settings_.max_buffer_size != 0 && buffer.length > settings_.max_buffer_size) {
            refuse(Status::invalid_parameter,
                   fmt::format("buffer of {} bytes, allowed: {}", buffer.length, settings_.max_buffer_size));
        } else if (!settings_.full_update) {
            announced_ = buffer; // replaces an announcement whose data did not arrive
        }
        break;
    }
    case Request::set_state_check: {
        std::vector<gud::Property> properties;
        gud::State wanted;
        has_checked_ = false;
        if (auto why = gud::decode(data, wanted, properties); !why.empty()) {
            refuse(Status::protocol_error, why);
        } else if (wanted.mode.hdisplay != settings_.width || wanted.mode.vdisplay != settings_.height) {
            refuse(Status::invalid_parameter,
                   fmt::format("mode {}x{}", wanted.mode.hdisplay, wanted.mode.vdisplay));
        } else if (std::find(settings_.formats.begin(), settings_.formats.end(), wanted.format) ==
                   settings_.formats.end()) {
            refuse(Status::invalid_parameter, fmt::format("format {}", gud::to_string(wanted.format)));
        } else if (wanted.connector != 0) {
            refuse(Status::invalid_parameter, fmt::format("connector {}", wanted.connector));
        } else {
            checked_ = wanted;
            has_checked_ = true;
        }
        break;
    }
    case Request::set_state_commit:
        if (!has_checked_) {
            refuse(Status::error, "commit without a state check");
            break;
        }
        state_ = checked_;
        committed_ = true;
        announced_.reset();
        screen_.assign(std::size_t{settings_.width} * settings_.height *
                           static_cast<std::size_t>(gud::bytes_per_pixel(state_.format)),
                       0);
        break;
    case Request::set_controller_enable:
    case Request::set_display_enable:
        if (data.size() != 1 || data[0] > 1) {
            refuse(Status::protocol_error, "switch that is neither 0 nor 1");
        } else if (static_cast<Request>(request) == Request::set_controller_enable) {
            controller_on_ = data[0] == 1;
        } else {
            display_on_ = data[0] == 1;
        }
        break;
    default:
        refuse(Status::request_not_supported, fmt::format("unknown request 0x{:02x}", request));
        break;
    }
}

std::optional<gud::SetBuffer> GudDevice::begin_bulk() {
    if (!display_on_ || !committed_) return std::nullopt;
    if (!settings_.full_update) return std::exchange(announced_, std::nullopt);
    gud::SetBuffer whole;
    whole.width = settings_.width;
    whole.height = settings_.height;
    whole.length = static_cast<std::uint32_t>(screen_.size());
    return whole;
}

bool GudDevice::finish_bulk(const gud::SetBuffer& buffer, std::span<const std::uint8_t> data,
                            std::uint64_t now_ns) {
    if (data.size() != buffer.transfer_length()) {
        ++frame_.errors;
        refuse(Status::protocol_error,
               fmt::format("{} bytes of data instead of {}", data.size(), buffer.transfer_length()));
        return false;
    }
    std::span<const std::uint8_t> pixels = data;
    if (buffer.compression != 0) {
        scratch_.resize(buffer.length);
        const int size = LZ4_decompress_safe(
            reinterpret_cast<const char*>(data.data()), reinterpret_cast<char*>(scratch_.data()),
            static_cast<int>(data.size()), static_cast<int>(scratch_.size()));
        if (size != static_cast<int>(buffer.length)) {
            ++frame_.errors;
            refuse(Status::error, fmt::format("LZ4 block gives {} bytes instead of {}", size, buffer.length));
            return false;
        }
        pixels = scratch_;
    }
    const auto pixel = static_cast<std::size_t>(gud::bytes_per_pixel(state_.format));
    if (buffer.length != buffer.width * buffer.height * pixel) return false; // the format changed meanwhile
    const std::size_t stride = settings_.width * pixel, row = buffer.width * pixel;
    for (std::size_t y = 0; y < buffer.height; ++y)
        std::memcpy(screen_.data() + (buffer.y + y) * stride + buffer.x * pixel, pixels.data() + y * row,
                    row);
    ++frame_.received;
    ++frame_.shown;
    frame_.last_received_ns = frame_.last_shown_ns = now_ns;
    if (on_update) on_update({buffer, pixels});
    return true;
}

} // namespace obscura::tools
