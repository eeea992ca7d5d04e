// Writes one frame in the format of choice; shared by the file transport and the command line.
#pragma once

#include "core/enum_names.hpp"
#include "images/writers/card.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace obscura::images {

/// A picture of digital numbers on its way to a file.
struct Picture {
    std::int32_t width = 0, height = 0;
    int bits = 16;
    std::span<const std::uint16_t> pixels; ///< row-major
};

enum class FrameFormat : std::uint8_t { png, fits, raw };
/// Names in configurations and on command lines; also the extensions of the files.
constexpr auto enum_names(FrameFormat /*type*/) {
    return std::array{EnumName{FrameFormat::png, "png"}, EnumName{FrameFormat::fits, "fits"},
                      EnumName{FrameFormat::raw, "raw"}};
}

/// "frame_000042.png" and so on.
[[nodiscard]] std::string frame_file_name(std::uint64_t number, FrameFormat format);

/// Loads the library that writes FITS files, which may else be loaded with the first of them only
/// (core/late_library.hpp): at set-up, before memory is locked. Throws HardwareError.
void load_fits_writer();

/// Writes `picture` to `file`. Throws OutputError.
void write_picture(const std::filesystem::path& file, FrameFormat format, const Picture& picture,
                   const Cards& cards);

} // namespace obscura::images
