// SPDX-License-Identifier: Apache-2.0
// Budget of live pictures: how fast and how fine each viewer sees, so that all together take no more bytes.
#pragma once

#include "web/live/view.hpp"

#include <chrono>
#include <cstddef>
#include <span>
#include <vector>

namespace obscura::web {

/// What the viewers of a server may take together: on the same core more of it makes rows of a camera leave
/// late.
constexpr double live_bytes_per_s = 12e6;
/// Largest picture; more of an image is binned.
constexpr std::size_t max_picture_bytes = std::size_t{4} << 20;

/// What a viewer asks for: a view within its image, and pictures a second.
struct Wish {
    View view;
    double hz = 0;
    PictureEncoding encoding = PictureEncoding::u16;
    double jpeg_share = 0.25; ///< bytes of a JPEG over those of the digital numbers, as far as they are known
};
/// What it gets.
struct Share {
    View view; ///< with larger bins, perhaps
    double hz = 0;
    bool jpeg = false;
};

/// Gives all viewers what they ask for if that is not too much; else those that take most get fewer pictures,
/// down to `min_hz`, below that JPEGs if they take any encoding, and below that larger bins.
[[nodiscard]] std::vector<Share> shared_out(std::span<const Wish> wishes, double bytes_per_s);
constexpr double min_hz = 2;

/// Limits events, or bytes, to a rate, with some tolerance for their times.
class Pace {
public:
    using Clock = std::chrono::steady_clock;
    /// `most`: what may come at once after a pause.
    explicit Pace(double most) : most_(most), have_(most) {}

    void set_rate(double per_s, Clock::time_point now);
    /// When at least `amount`, which is at most what may come at once, can be taken.
    [[nodiscard]] Clock::time_point time_of(double amount, Clock::time_point now) const;
    void take(double amount, Clock::time_point now);

private:
    [[nodiscard]] double at(Clock::time_point now) const;

    double most_, have_, per_s_ = 0;
    Clock::time_point since_{};
};

} // namespace obscura::web
