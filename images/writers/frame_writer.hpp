// SPDX-License-Identifier: Apache-2.0
// Frame writer with selectable file format, for the file transport and the command line.
#pragma once

#include "core/text/enum_names.hpp"
#include "images/writers/card.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace obscura::images {

/// Digital numbers of an image to be written.
struct Picture {
    std::int32_t width = 0, height = 0;
    int bits = 16;
    std::span<const std::uint16_t> pixels; ///< row-major
};

enum class FrameFormat : std::uint8_t { png, fits, raw };
/// Names in configurations and on command lines; also the file name extensions.
constexpr auto enum_names(FrameFormat /*type*/) {
    return std::array{EnumName{FrameFormat::png, "png"}, EnumName{FrameFormat::fits, "fits"},
                      EnumName{FrameFormat::raw, "raw"}};
}

/// File name of frame `number`, such as "frame_000042.png".
[[nodiscard]] std::string frame_file_name(std::uint64_t number, FrameFormat format);

/// Loads the library that writes FITS files, which the first write would load otherwise
/// (core/io/late_library.hpp). Call it at set-up, before memory is locked. Throws HardwareError.
void load_fits_writer();

/// Writes `picture` to `file`. Throws OutputError.
void write_picture(const std::filesystem::path& file, FrameFormat format, const Picture& picture,
                   const Cards& cards);

} // namespace obscura::images
