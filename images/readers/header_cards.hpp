// SPDX-License-Identifier: Apache-2.0
// Header cards of pictures as text: FITS, OpenEXR, PNG, and the sidecar of raw frames.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::images {

/// Card of a header, see images/writers/card.hpp. Text has no quotes, flags are "true" or "false".
struct HeaderCard {
    std::string key, value;
    std::string comment; ///< empty where the format has none
};

/// Cards of `file` in its own order; of a FITS file those of its first header. Throws InputError.
[[nodiscard]] std::vector<HeaderCard> read_header_cards(const std::filesystem::path& file);

} // namespace obscura::images
