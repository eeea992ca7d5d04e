// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/display_link.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace obscura::transports {

using gud::Request;

void DisplayLink::fail(const std::string& why) const {
    throw HardwareError(fmt::format("stimulator {}: {}", device_.description(), why));
}

gud::Status DisplayLink::status() {
    std::array<std::uint8_t, 1> answer{};
    const UsbResult result = device_.control_in(static_cast<std::uint8_t>(Request::get_status), 0, answer);
    return result.ok() && result.count == 1 ? static_cast<gud::Status>(answer[0]) : gud::Status::error;
}

std::size_t DisplayLink::get(Request request, std::uint16_t value, std::span<std::uint8_t> into,
                             std::string_view what) {
    const UsbResult result = device_.control_in(static_cast<std::uint8_t>(request), value, into);
    if (result.status == UsbStatus::stall)
        fail(fmt::format("{} refused: {}", what, gud::to_string(status())));
    if (!result.ok()) fail(fmt::format("{}: {}", what, to_string(result.status)));
    return std::min(result.count, into.size());
}

UsbStatus DisplayLink::set(Request request, std::uint16_t value, std::span<const std::uint8_t> data,
                           std::string_view what) {
    const UsbResult result = device_.control_out(static_cast<std::uint8_t>(request), value, data);
    const bool ask =
        result.status == UsbStatus::stall || (result.ok() && (descriptor_.flags & gud::status_on_set) != 0);
    if (ask) {
        const gud::Status answer = status();
        if (answer != gud::Status::ok) {
            refusal_ = fmt::format("{}: {}", what, gud::to_string(answer));
            return UsbStatus::stall;
        }
        if (result.status == UsbStatus::stall) refusal_ = fmt::format("{}: stalled", what);
    }
    return result.status;
}

void DisplayLink::require(UsbStatus status, std::string_view what) const {
    if (status == UsbStatus::stall) fail(fmt::format("refused {}", refusal_));
    if (status != UsbStatus::ok) fail(fmt::format("{}: {}", what, to_string(status)));
}

DisplayLink::DisplayLink(UsbDevice& device, const DisplayWish& wish) : device_(device) {
    std::array<std::uint8_t, gud::descriptor_size> descriptor{};
    const std::size_t got = get(Request::get_descriptor, 0, descriptor, "display descriptor");
    if (auto why = gud::decode(std::span(descriptor).first(got), descriptor_); !why.empty()) fail(why);

    choose_format(wish);

    std::array<std::uint8_t, gud::max_properties * gud::property_size> properties{};
    std::vector<gud::Property> unused;
    std::size_t n = get(Request::get_properties, 0, properties, "property list");
    if (auto why = gud::decode_properties(std::span(properties).first(n), unused); !why.empty()) fail(why);

    std::array<std::uint8_t, gud::max_connectors * gud::connector_size> connector_bytes{};
    std::vector<gud::Connector> connectors;
    n = get(Request::get_connectors, 0, connector_bytes, "connector list");
    if (auto why = gud::decode_connectors(std::span(connector_bytes).first(n), connectors); !why.empty())
        fail(why);
    if (wish.connector >= connectors.size())
        fail(fmt::format("has no connector {}, allowed: 0..{}", wish.connector, connectors.size() - 1));
    n = get(Request::get_connector_properties, wish.connector, properties, "connector property list");
    if (auto why = gud::decode_properties(std::span(properties).first(n), unused); !why.empty()) fail(why);

    (void)set(Request::set_connector_force_detect, wish.connector, {}, "connector detection");
    std::array<std::uint8_t, 1> status_byte{};
    gud::ConnectorStatus connector_status{};
    n = get(Request::get_connector_status, wish.connector, status_byte, "connector status");
    if (auto why = gud::decode_connector_status(std::span(status_byte).first(n), connector_status);
        !why.empty())
        fail(why);
    if (connector_status == gud::ConnectorStatus::disconnected)
        fail(fmt::format("nothing is connected to its connector {}", wish.connector));

    choose_mode(wish);

    const std::array<std::uint8_t, 1> on{1};
    gud::State state;
    state.mode = mode_;
    state.format = format_;
    state.connector = wish.connector;
    const auto state_bytes = gud::encode(state);
    require(set(Request::set_state_check, 0, state_bytes,
                fmt::format("mode {}x{} in {}", width(), height(), gud::to_string(format_))),
            "mode setting");
    require(set(Request::set_controller_enable, 0, on, "controller"), "turning the controller on");
    require(set(Request::set_state_commit, 0, {}, "mode change"), "mode change");
    require(set(Request::set_display_enable, 0, on, "display"), "turning the display on");

    has_frame_status_ = true; // assumed until the device refuses it
    has_frame_status_ = frame_status().has_value();
}

void DisplayLink::choose_format(const DisplayWish& wish) {
    std::array<std::uint8_t, gud::max_formats> bytes{};
    std::vector<gud::Format> formats;
    const std::size_t n = get(Request::get_formats, 0, bytes, "format list");
    if (auto why = gud::decode_formats(std::span(bytes).first(n), formats); !why.empty()) fail(why);
    const auto has = [&](gud::Format f) {
        return std::find(formats.begin(), formats.end(), f) != formats.end();
    };
    std::string offered;
    for (const gud::Format f : formats)
        offered += (offered.empty() ? "" : ", ") + gud::to_string(f);
    if (wish.format) {
        if (!has(*wish.format))
            fail(fmt::format("does not take {}, it offers {}", gud::to_string(*wish.format), offered));
        format_ = *wish.format;
        return;
    }
    for (const gud::Format f : {gud::Format::r8, gud::Format::xrgb8888, gud::Format::rgb888}) {
        if (has(f)) {
            format_ = f;
            return;
        }
    }
    fail(fmt::format("offers {}, allowed: R8, XRGB8888, RGB888", offered));
}

void DisplayLink::choose_mode(const DisplayWish& wish) {
    std::vector<std::uint8_t> bytes(gud::max_modes * gud::mode_size);
    std::vector<gud::Mode> modes;
    std::size_t n = get(Request::get_connector_modes, wish.connector, bytes, "mode list");
    if (auto why = gud::decode_modes(std::span(bytes).first(n), modes); !why.empty()) fail(why);
    if (modes.empty()) {
        bytes.resize(gud::max_edid_size);
        n = get(Request::get_connector_edid, wish.connector, bytes, "EDID");
        if (auto why = gud::decode_edid_modes(std::span(bytes).first(n), modes); !why.empty()) fail(why);
    }
    const auto within = [&](const gud::Mode& m) {
        return m.hdisplay >= descriptor_.min_width && m.hdisplay <= descriptor_.max_width &&
               m.vdisplay >= descriptor_.min_height && m.vdisplay <= descriptor_.max_height;
    };
    std::string offered;
    const gud::Mode* best = nullptr;
    double best_miss = 0;
    for (const gud::Mode& m : modes) {
        if (!within(m)) continue;
        offered += fmt::format("{}{}x{}@{:.1f}", offered.empty() ? "" : ", ", m.hdisplay, m.vdisplay,
                               m.refresh_hz());
        if ((wish.width > 0 && m.hdisplay != wish.width) || (wish.height > 0 && m.vdisplay != wish.height))
            continue;
        // Choose the nearest refresh rate; if none is requested, the preferred mode, else the first.
        const double miss =
            wish.refresh_hz > 0 ? std::abs(m.refresh_hz() - wish.refresh_hz) : (m.preferred() ? 0 : 1);
        if (best == nullptr || miss < best_miss) {
            best = &m;
            best_miss = miss;
        }
    }
    if (offered.empty())
        fail(fmt::format("offers no mode within its own limits of {}..{} x {}..{} pixels",
                         descriptor_.min_width, descriptor_.max_width, descriptor_.min_height,
                         descriptor_.max_height));
    if (best == nullptr)
        fail(fmt::format("has no mode of {}x{} pixels, it offers {}", wish.width, wish.height, offered));
    mode_ = *best;
    if (frame_bytes() > gud::max_frame_bytes)
        fail(fmt::format("a frame of {}x{} pixels in {} has {} bytes, allowed: {}", width(), height(),
                         gud::to_string(format_), frame_bytes(), gud::max_frame_bytes));
    const std::size_t least =
        whole_frames_only()
            ? frame_bytes()
            : static_cast<std::size_t>(width()) * static_cast<std::size_t>(gud::bytes_per_pixel(format_));
    if (max_update_bytes() < least)
        fail(fmt::format("takes {} bytes at a time, fewer than {} of {} bytes", max_update_bytes(),
                         whole_frames_only() ? "the whole frame" : "a row", least));
}

std::size_t DisplayLink::max_update_bytes() const {
    return descriptor_.max_buffer_size == 0 ? frame_bytes() : descriptor_.max_buffer_size;
}

UsbStatus DisplayLink::send(std::size_t slot, const DisplayUpdate& update) {
    if (!whole_frames_only() || announce_whole_frame_) {
        gud::SetBuffer buffer;
        buffer.x = static_cast<std::uint32_t>(update.rect.x);
        buffer.y = static_cast<std::uint32_t>(update.rect.y);
        buffer.width = static_cast<std::uint32_t>(update.rect.width);
        buffer.height = static_cast<std::uint32_t>(update.rect.height);
        buffer.length = buffer.width * buffer.height * static_cast<unsigned>(gud::bytes_per_pixel(format_));
        if (update.compressed) {
            buffer.compression = gud::compression_lz4;
            buffer.compressed_length = static_cast<std::uint32_t>(update.bytes.size());
        }
        const auto bytes = gud::encode(buffer);
        const UsbStatus status = set(Request::set_buffer, 0, bytes, "an update");
        if (status != UsbStatus::ok) return status;
        announce_whole_frame_ = false;
    }
    return device_.submit(slot, update.bytes);
}

void DisplayLink::resynchronise() {
    (void)device_.clear_halt();
    announce_whole_frame_ = whole_frames_only();
}

bool DisplayLink::alive() {
    std::array<std::uint8_t, 1> answer{};
    return device_.control_in(static_cast<std::uint8_t>(Request::get_status), 0, answer).ok();
}

std::optional<gud::FrameStatus> DisplayLink::frame_status() {
    if (!has_frame_status_) return std::nullopt;
    std::array<std::uint8_t, gud::frame_status_size> bytes{};
    const UsbResult result =
        device_.control_in(static_cast<std::uint8_t>(Request::get_frame_status), 0, bytes);
    gud::FrameStatus answer;
    if (result.ok() &&
        gud::decode(std::span(bytes).first(std::min(result.count, bytes.size())), answer).empty())
        return answer;
    // A plain GUD device stalls this request: fetch its status, so that the next request starts clean.
    if (result.status == UsbStatus::stall) (void)status();
    has_frame_status_ = false;
    return std::nullopt;
}

void DisplayLink::turn_off() noexcept {
    const std::array<std::uint8_t, 1> off{0};
    (void)device_.control_out(static_cast<std::uint8_t>(Request::set_display_enable), 0, off);
    (void)device_.control_out(static_cast<std::uint8_t>(Request::set_controller_enable), 0, off);
}

} // namespace obscura::transports
