// SPDX-License-Identifier: Apache-2.0
// Messages of the WebSocket /api/v1/live, without the socket: see docs/control.md.
#pragma once

#include "transports/watch/frame_ring_layout.hpp"
#include "web/live/view.hpp"

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::web {

/// A camera of a daemon of this machine: "PID-N".
struct CameraId {
    std::int64_t pid = 0;
    std::uint32_t number = 0;

    auto operator<=>(const CameraId&) const = default;
};
[[nodiscard]] std::string to_text(const CameraId& camera);
[[nodiscard]] std::optional<CameraId> camera_id_of(std::string_view text);

/// What a viewer wants to see.
struct ViewRequest {
    static constexpr double max_request_hz = 60;

    CameraId camera;
    View view;
    double max_hz = 10;
    PictureEncoding encoding = PictureEncoding::u16;
    std::uint32_t max_side = 0; ///< largest number of columns and rows, for which bins grow; 0: any
    bool histogram = true;
};

/// A message of a viewer; each field is set at most once.
struct ViewerMessage {
    std::optional<std::string> token;
    std::optional<ViewRequest> view;
    bool ready = false;
};

/// Largest message of a viewer, bytes.
constexpr std::size_t max_viewer_bytes = 4096;
/// Throws InputError with one line that tells what is allowed.
[[nodiscard]] ViewerMessage viewer_message_of(std::string_view json);

/// In `flags` of a picture: what the budget has lowered, see live_budget.hpp.
enum PictureFlag : std::uint32_t { picture_rate_lowered = 1u << 0, picture_view_lowered = 1u << 1 };

constexpr std::size_t picture_header_bytes = 80;
/// First bytes of a picture; `view` is the one that was made, within the frame, at `made_tai_ns`.
[[nodiscard]] std::array<unsigned char, picture_header_bytes>
picture_header(std::uint32_t camera, const transports::FrameRingHeader& frame, const View& view,
               std::uint32_t flags, std::uint32_t skipped, std::int64_t made_tai_ns);

/// {"histogram": {...}} of a frame.
[[nodiscard]] std::string histogram_text(std::uint64_t frame_id, const Histogram& histogram);
/// {KIND: WHY}
[[nodiscard]] std::string reason_text(std::string_view kind, std::string_view why);

} // namespace obscura::web
