// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/frame_files.hpp"

#include <fmt/format.h>

namespace obscura::tools {

void FrameFiles::declare(host::CommandLine& line, const std::string& context) {
    line.option("--format", &format_, "FORMAT",
                "File format of the frames: 16-bit PNG, FITS, or raw samples without a header")
        .choices = {"png", "fits", "raw"};
    line.flag(
        "--preview", preview_,
        context +
            "save each frame as preview_NNNNNN.png, an 8-bit picture with stretched contrast, not for measurement; "
            "several windows are outlined in orange, padding is striped in blue. This is the default");
    line.flag("--no-preview", no_preview_, "Do not save previews");
    stretch_options_.declare(line, "Contrast of the previews");
    line.flag(
        "--msb", msb_,
        "With --format png: align the numbers to the upper end of the 16 bits, so that viewers show them; "
        "the text chunk MSBSHIFT states by how many bits they were shifted (default: numbers as they are, nearly black in most viewers)");
}

void FrameFiles::prepare(std::string_view verb) {
    if (preview_ && no_preview_)
        throw host::UsageError(
            fmt::format("obscura {}: --preview and --no-preview exclude each other", verb));
    if (msb_ && format_ != "png")
        throw host::UsageError(
            fmt::format("obscura {}: --msb with --format {}: allowed is png", verb, format_));
    stretch_ = stretch_options_.parsed(verb);
}

std::string FrameFiles::name(std::uint64_t number) const {
    return images::frame_file_name(number, enum_named<images::FrameFormat>(format_).value());
}

void FrameFiles::save(const std::filesystem::path& folder, std::uint64_t number,
                      const images::Picture& picture, images::Cards cards,
                      const std::vector<Region>& windows) const {
    const images::FrameFormat format = enum_named<images::FrameFormat>(format_).value();
    const std::filesystem::path file = folder / name(number);
    if (msb_ && picture.bits < 16) {
        const int shift = 16 - picture.bits;
        std::vector<std::uint16_t> aligned(picture.pixels.begin(), picture.pixels.end());
        for (std::uint16_t& dn : aligned)
            dn = static_cast<std::uint16_t>(dn << shift);
        cards.push_back({"MSBSHIFT", std::int64_t{shift}, "[bit] numbers are shifted left by"});
        images::write_picture(file, format, {picture.width, picture.height, picture.bits, aligned}, cards);
    } else {
        images::write_picture(file, format, picture, cards);
    }
    if (!no_preview_)
        write_preview(folder / fmt::format("preview_{:06}.png", number),
                      {picture.width, picture.height, picture.bits, picture.pixels, windows}, stretch_);
}

} // namespace obscura::tools
