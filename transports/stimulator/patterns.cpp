// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/patterns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace obscura::transports {

PatternSequence::PatternSequence(std::int32_t width, std::int32_t height, int levels, int ramp_steps,
                                 std::int32_t dot_step)
    : width_(width),
      height_(height),
      levels_(levels),
      dot_step_(dot_step),
      dot_radius_(std::max(2, dot_step / 6)),
      column_bits_(std::bit_width(static_cast<std::uint32_t>(width - 1))),
      row_bits_(std::bit_width(static_cast<std::uint32_t>(height - 1))) {
    assert(width >= 2 && height >= 2 && levels >= 2 && ramp_steps >= 2 && dot_step >= 4);
    patterns_.push_back({"black", Pattern::Kind::flat, 0, false, 0});
    patterns_.push_back({"white", Pattern::Kind::flat, 0, false, levels - 1});
    const auto code = [&](const char* what, Pattern::Kind kind, int bits) {
        for (int bit = 0; bit < bits; ++bit) {
            patterns_.push_back({fmt::format("{}_{:02}", what, bit), kind, bit, false, 0});
            patterns_.push_back({fmt::format("{}_{:02}_inverse", what, bit), kind, bit, true, 0});
        }
    };
    code("column", Pattern::Kind::column_bit, column_bits_);
    code("row", Pattern::Kind::row_bit, row_bits_);
    patterns_.push_back({"dots", Pattern::Kind::dots, 0, false, levels - 1});
    int last = -1;
    for (int i = 0; i < ramp_steps; ++i) {
        const int level = static_cast<int>(std::lround((levels - 1.0) * i / (ramp_steps - 1)));
        if (level == last) continue;
        last = level;
        patterns_.push_back({fmt::format("ramp_{:05}", level), Pattern::Kind::flat, 0, false, level});
    }
}

PixelPoint PatternSequence::dot(int column, int row) const {
    return {static_cast<double>(dot_step_ / 2 + column * dot_step_),
            static_cast<double>(dot_step_ / 2 + row * dot_step_)};
}

std::vector<std::uint16_t> PatternSequence::draw(const Pattern& pattern) const {
    const auto w = static_cast<std::size_t>(width_), h = static_cast<std::size_t>(height_);
    const auto top = static_cast<std::uint16_t>(levels_ - 1);
    std::vector<std::uint16_t> picture(w * h, 0);
    switch (pattern.kind) {
    case Pattern::Kind::flat:
        std::fill(picture.begin(), picture.end(), static_cast<std::uint16_t>(pattern.level));
        break;
    case Pattern::Kind::column_bit:
    case Pattern::Kind::row_bit: {
        const bool columns = pattern.kind == Pattern::Kind::column_bit;
        const int shift = (columns ? column_bits_ : row_bits_) - 1 - pattern.bit;
        for (std::size_t y = 0; y < h; ++y) {
            for (std::size_t x = 0; x < w; ++x) {
                const bool on = (to_gray(static_cast<std::uint32_t>(columns ? x : y)) >> shift & 1u) != 0;
                picture[y * w + x] = on != pattern.inverse ? top : std::uint16_t{0};
            }
        }
        break;
    }
    case Pattern::Kind::dots:
        for (int row = 0; row < dot_rows(); ++row) {
            for (int column = 0; column < dot_columns(); ++column) {
                const PixelPoint c = dot(column, row);
                const auto cx = static_cast<std::int32_t>(c.x), cy = static_cast<std::int32_t>(c.y);
                for (std::int32_t dy = -dot_radius_; dy <= dot_radius_; ++dy) {
                    for (std::int32_t dx = -dot_radius_; dx <= dot_radius_; ++dx) {
                        if (dx * dx + dy * dy > dot_radius_ * dot_radius_) continue;
                        const std::int32_t x = cx + dx, y = cy + dy;
                        if (x >= 0 && y >= 0 && x < width_ && y < height_)
                            picture[static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x)] = top;
                    }
                }
            }
        }
        break;
    }
    return picture;
}

} // namespace obscura::transports
