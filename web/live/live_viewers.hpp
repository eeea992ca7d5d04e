// SPDX-License-Identifier: Apache-2.0
// Cameras that are looked at, their viewers, and the pictures that are due.
#pragma once

#include "web/live/live_pictures.hpp"

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace obscura::web {

/// Daemons copy frames for this long after they have been asked to.
inline constexpr std::chrono::seconds frames_watched{2};
/// Half a picture more than the rate allows: frames at just that rate, at times that scatter, all pass.
inline constexpr double pictures_at_once = 1.5;

/// A camera with viewers.
struct LivePictures::Camera {
    std::unique_ptr<const transports::FrameRingReader> ring; ///< null: not yet
    FileDescriptor news;
    std::uint64_t oldest = 0;               ///< frames up to this serial number came before the first viewer
    std::optional<Clock::time_point> asked; ///< when the daemon was last asked for its frames
    int missed = 0;
    std::int64_t tai_offset_ns = 0;      ///< TAI minus CLOCK_MONOTONIC, of the daemon
    std::uint32_t width = 0, height = 0; ///< of the last frame; 0: none that can be shown

    // The thread's: of the newest frame.
    MadePictures made;
    std::string histogram;
    std::uint64_t histogram_of = 0;
    Clock::time_point histogram_at{};
};

struct LivePictures::Viewer {
    Deliver deliver;
    std::optional<ViewRequest> request{};
    bool ready = true;
    bool changed = false; ///< the view, since the last picture
    std::uint64_t last_serial = 0, last_number = 0;
    Clock::time_point sent_at{};
    Pace pace{pictures_at_once};
    View view{}; ///< that it gets
    bool jpeg = false;
    double jpeg_share = Wish{}.jpeg_share;
    double hz = 0;
    std::uint64_t histogram_of = 0;
    Clock::time_point histogram_at{};
};

/// A picture that is to be made, or the histogram alone of one that came too soon after another.
struct LivePictures::Due {
    bool picture = true;
    ViewerId viewer = 0;
    std::shared_ptr<Camera> camera;
    CameraId id;
    View view;
    bool jpeg = false;
    std::uint32_t flags = 0;
    std::uint64_t last_number = 0;
    bool histogram = false;
    std::uint64_t histogram_of = 0;
    Deliver deliver{};
    Clock::time_point sent_at{};
};

} // namespace obscura::web
