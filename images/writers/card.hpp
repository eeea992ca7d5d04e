// What is known about an image, as named values that every image format writes its own way.
#pragma once

#include "core/frame.hpp"

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace obscura::images {

/// One fact about an image. `key` follows FITS: at most 8 of A-Z, 0-9, - and _.
struct Card {
    std::string key;
    std::variant<bool, std::int64_t, double, std::string> value;
    std::string comment; ///< with the unit in brackets, as FITS has it
};
using Cards = std::vector<Card>;

/// The facts of a frame: ids, times, settings and the poses of the ground truth. The same frame gives the
/// same cards; no wall-clock time is among them.
[[nodiscard]] Cards frame_cards(const Frame& frame);

/// The value as text: strings as they are, numbers in their shortest exact form.
[[nodiscard]] std::string card_text(const Card& card);

} // namespace obscura::images
