// SPDX-License-Identifier: Apache-2.0
// Device side of the GUD protocol for a display in memory, shared by the reference device and the tests.
#pragma once

#include "transports/stimulator/gud.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

namespace gud = transports::gud;

struct GudDeviceSettings {
    std::uint16_t width = 640, height = 480;
    double refresh_hz = 60;
    std::vector<gud::Format> formats{gud::Format::r8};
    bool full_update = false;
    bool lz4 = true;
    bool frame_status = true; ///< answer Obscura's frame status extension
    std::uint32_t max_buffer_size = 0;
};

/// One update received.
struct GudUpdate {
    gud::SetBuffer buffer;
    std::span<const std::uint8_t> pixels; ///< decompressed
};

/// State machine of a GUD display. The owner passes USB requests and data to it; it never blocks and does no
/// I/O. Requests are refused by a stall where USB lets a device do so, else by the status, as a FunctionFS
/// device must. Reentrant.
class GudDevice {
public:
    explicit GudDevice(GudDeviceSettings settings);

    /// Returns the answer to a request for at most `length` bytes; nullopt: stall.
    [[nodiscard]] std::optional<std::vector<std::uint8_t>>
    control_in(std::uint8_t request, std::uint16_t value, std::size_t length, std::uint64_t now_ns);
    /// True if a host-to-device request of this number exists; another may be stalled before its data.
    [[nodiscard]] bool knows_control_out(std::uint8_t request) const;
    void control_out(std::uint8_t request, std::uint16_t value, std::span<const std::uint8_t> data);

    /// Takes the announcement of the next bulk transfer; nullopt if none is announced (or the display is
    /// off). An announcement that arrives before finish_bulk() is for the transfer after.
    [[nodiscard]] std::optional<gud::SetBuffer> begin_bulk();
    /// Processes the bytes of that transfer. Returns false if they are invalid.
    bool finish_bulk(const gud::SetBuffer& buffer, std::span<const std::uint8_t> data, std::uint64_t now_ns);
    /// Reports that the transfer was aborted.
    void bulk_failed() { ++frame_.errors; }
    /// Returns to the state after power-up, as on a disconnect, except for the picture.
    void reset();

    [[nodiscard]] const GudDeviceSettings& settings() const { return settings_; }
    [[nodiscard]] gud::Format format() const { return state_.format; }
    [[nodiscard]] bool display_on() const { return display_on_; }
    /// Bytes of the screen, row by row in format().
    [[nodiscard]] std::span<const std::uint8_t> screen() const { return screen_; }
    [[nodiscard]] const gud::FrameStatus& status() const { return frame_; }
    /// One line about the last refusal, for logs.
    [[nodiscard]] const std::string& complaint() const { return complaint_; }
    /// Called with every update received.
    std::function<void(const GudUpdate&)> on_update;

private:
    [[nodiscard]] gud::Mode mode() const;
    void refuse(gud::Status status, std::string why);

    GudDeviceSettings settings_;
    gud::Status last_status_ = gud::Status::ok;
    gud::State state_, checked_;
    bool has_checked_ = false, committed_ = false, controller_on_ = false, display_on_ = false;
    std::optional<gud::SetBuffer> announced_;
    std::vector<std::uint8_t> screen_, scratch_;
    gud::FrameStatus frame_;
    std::string complaint_;
};

} // namespace obscura::tools
