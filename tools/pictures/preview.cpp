// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/preview.hpp"

#include "images/writers/png.hpp"
#include "tools/pictures/figure.hpp"

#include <algorithm>
#include <cstddef>

namespace obscura::tools {
namespace {

/// Pixels of a frame that belong to a window; all without windows.
std::vector<bool> covered(const FramePreview& frame) {
    const auto width = static_cast<std::size_t>(frame.width);
    std::vector<bool> out(width * static_cast<std::size_t>(frame.height), frame.windows.empty());
    for (const Region& w : frame.windows)
        for (std::int32_t y = std::max(0, w.y); y < std::min(frame.height, w.y + w.height); ++y)
            for (std::int32_t x = std::max(0, w.x); x < std::min(frame.width, w.x + w.width); ++x)
                out[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = true;
    return out;
}

/// Number of covered pixels of each digital number.
std::vector<std::uint64_t> counts_of(const FramePreview& frame, const std::vector<bool>& counted) {
    std::vector<std::uint64_t> counts(65536);
    for (std::size_t i = 0; i < frame.pixels.size(); ++i)
        if (counted[i]) ++counts[frame.pixels[i]];
    return counts;
}

constexpr Rgb padding_dark{24, 32, 58}, padding_light{44, 58, 100}, outline_colour{255, 140, 0};

} // namespace

void write_preview(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                   const std::vector<float>& image, const host::Stretch& stretch) {
    images::write_png8(file, width, height, host::stretched(image, stretch), {});
}

void write_preview(const std::filesystem::path& file, const FramePreview& frame,
                   const host::Stretch& stretch) {
    const std::vector<bool> in_window = covered(frame);
    const std::vector<std::uint8_t> table =
        host::display_levels(counts_of(frame, in_window), frame.bits, stretch);
    const bool whole = std::all_of(in_window.begin(), in_window.end(), [](bool in) { return in; });
    if (whole && frame.windows.size() < 2) {
        std::vector<std::uint8_t> grey(frame.pixels.size());
        std::transform(frame.pixels.begin(), frame.pixels.end(), grey.begin(),
                       [&](std::uint16_t dn) { return table[dn]; });
        images::write_png8(file, frame.width, frame.height, grey, {});
        return;
    }
    Canvas canvas(frame.width, frame.height, padding_dark);
    const std::int32_t stripe = std::max(4, frame.width / 64);
    for (std::int32_t y = 0; y < frame.height; ++y)
        for (std::int32_t x = 0; x < frame.width; ++x) {
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                                  static_cast<std::size_t>(x);
            const std::uint8_t level = table[frame.pixels[i]];
            if (in_window[i])
                canvas.fill(x, y, 1, 1, {level, level, level});
            else if ((x + y) / stripe % 2 == 0)
                canvas.fill(x, y, 1, 1, padding_light);
        }
    const std::int32_t thickness = std::max(1, std::max(frame.width, frame.height) / 600);
    for (const Region& w : frame.windows)
        canvas.outline(w.x, w.y, w.width, w.height, thickness, outline_colour);
    canvas.write(file);
}

void StretchOptions::declare(host::CommandLine& line, const std::string& of) {
    line.option(
        "--stretch", &text, "KIND",
        of +
            ": auto (5 % black, 0.01 % white, faint stars lifted), linear[:BLACK,WHITE] (default: 0 and the largest possible value), percentile[:LOW,HIGH] (linear between; "
            "default 0.5,99.5), asinh[:SOFTENING] (default 0.01) or log[:RANGE] (default 1000)");
    line.number("--gamma", &gamma, "G", "With --stretch: raise display levels to 1/G; above 1 brightens", 0.1,
                10);
}

} // namespace obscura::tools
