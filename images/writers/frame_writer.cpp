// SPDX-License-Identifier: Apache-2.0
#include "images/writers/frame_writer.hpp"

#include "images/writers/fits.hpp"
#include "images/writers/png.hpp"
#include "images/writers/raw.hpp"

#include <fitsio.h>
#include <fmt/format.h>

namespace obscura::images {

std::string frame_file_name(std::uint64_t number, FrameFormat format) {
    return fmt::format("frame_{:06}.{}", number, name_of(format));
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
