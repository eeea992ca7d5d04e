#include "images/writers/frame_writer.hpp"

#include "images/writers/fits.hpp"
#include "images/writers/png.hpp"
#include "images/writers/raw.hpp"

#include <fitsio.h>
#include <fmt/format.h>

#include <array>
#include <stdexcept>

namespace obscura::images {
namespace {

constexpr std::array<std::string_view, 3> names{"png", "fits", "raw"};

} // namespace

FrameFormat frame_format(std::string_view name) {
    for (std::size_t i = 0; i < names.size(); ++i)
        if (names[i] == name) return static_cast<FrameFormat>(i);
    throw std::invalid_argument(fmt::format("\"{}\" is no frame format", name));
}

std::string frame_file_name(std::uint64_t number, FrameFormat format) {
    return fmt::format("frame_{:06}.{}", number, names[static_cast<std::size_t>(format)]);
}

void load_fits_writer() {
    fits_clear_errmsg();
}

void write_picture(const std::filesystem::path& file, FrameFormat format, const Picture& p,
                   const Cards& cards) {
    switch (format) {
    case FrameFormat::png:
        return write_png16(file, p.width, p.height, p.bits, p.pixels, cards);
    case FrameFormat::fits:
        return write_fits16(file, p.width, p.height, p.pixels, cards);
    case FrameFormat::raw:
        return write_raw16(file, p.width, p.height, p.bits, p.pixels, cards);
    }
}

} // namespace obscura::images
