// SPDX-License-Identifier: Apache-2.0
#include "images/image.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/memory_budget.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstdio>
#include <string_view>

namespace obscura::images {

namespace {

enum class Kind : std::uint8_t { fits, png, tiff, jpeg, exr, pds3 };

Kind kind_of(const std::filesystem::path& file) {
    const InputFile in = open_input(file);
    std::array<char, 512> bytes{};
    const std::string_view start(bytes.data(), std::fread(bytes.data(), 1, bytes.size(), in.get()));
    using namespace std::string_view_literals;
    if (start.starts_with("SIMPLE  =")) return Kind::fits;
    if (start.starts_with("\x89PNG")) return Kind::png;
    if (start.starts_with("II*\0"sv) || start.starts_with("MM\0*"sv) || start.starts_with("II+\0"sv) ||
        start.starts_with("MM\0+"sv))
        return Kind::tiff;
    if (start.starts_with("\xff\xd8\xff")) return Kind::jpeg;
    if (start.starts_with("v/1\x01")) return Kind::exr;
    if (start.find("PDS_VERSION_ID") != std::string_view::npos) return Kind::pds3;
    throw InputError(fmt::format(
        "{}: not an image of a supported format, allowed are FITS, PNG, TIFF, JPEG, OpenEXR and PDS3 (an image with a detached label: give the label)",
        file.string()));
}

} // namespace

Image read_image(const std::filesystem::path& file, const std::string& plane) {
    switch (kind_of(file)) {
    case Kind::fits:
        return read_fits_image(file, plane);
    case Kind::png:
        return read_png_image(file, plane);
    case Kind::tiff:
        return read_tiff_image(file, plane);
    case Kind::jpeg:
        return read_jpeg_image(file, plane);
    case Kind::exr:
        return read_exr_image(file, plane);
    case Kind::pds3:
        break;
    }
    return read_pds3_image(file, plane);
}

std::vector<std::string> colour_planes(const std::filesystem::path& file) {
    const auto numbers = [&file](std::int64_t planes) {
        constexpr std::int64_t max_planes = 65536;
        if (planes > max_planes)
            throw InputError(
                fmt::format("{}: {} planes, allowed 1 to {}", file.string(), planes, max_planes));
        std::vector<std::string> names;
        for (std::int64_t i = 0; i < planes; ++i)
            names.push_back(fmt::format("{}", i));
        return names;
    };
    const auto picture = [](bool colours) {
        return colours ? std::vector<std::string>{"red", "green", "blue"} : std::vector<std::string>{""};
    };
    switch (kind_of(file)) {
    case Kind::fits:
        return numbers(fits_planes(file));
    case Kind::png:
        return picture(png_has_colours(file));
    case Kind::tiff:
        return picture(tiff_has_colours(file));
    case Kind::jpeg:
        return picture(jpeg_has_colours(file));
    case Kind::exr:
        return exr_has_colours(file) ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{""};
    case Kind::pds3:
        break;
    }
    return numbers(pds3_planes(file));
}

bool has_plane(const std::filesystem::path& file, const std::string& channel) {
    return kind_of(file) == Kind::exr && exr_has_channel(file, channel);
}

ColourChoice colour_choice(const std::filesystem::path& file, const std::string& plane) {
    if (plane.empty()) return {{0.2126, 0.7152, 0.0722}};
    if (plane == "red") return {{1, 0, 0}};
    if (plane == "green") return {{0, 1, 0}};
    if (plane == "blue") return {{0, 0, 1}};
    throw InputError(
        fmt::format("{}: no plane \"{}\", allowed red, green, blue", file.string(), plane.substr(0, 60)));
}

std::int32_t plane_number(const std::filesystem::path& file, const std::string& plane, std::int64_t planes) {
    if (plane.empty()) return 0;
    std::int32_t number = -1;
    const auto [end, error] = std::from_chars(plane.data(), plane.data() + plane.size(), number);
    if (error != std::errc{} || end != plane.data() + plane.size() || number < 0 || number >= planes)
        throw InputError(
            fmt::format("{}: no plane \"{}\", allowed 0 to {}", file.string(), plane, planes - 1));
    return number;
}

void check_image_size(const std::filesystem::path& file, std::int64_t width, std::int64_t height) {
    if (width < 1 || height < 1 || width > max_image_pixels || height > max_image_pixels / width)
        throw InputError(fmt::format("{}: an image of {} x {} pixels, allowed 1 to {} in total",
                                     file.string(), width, height, max_image_pixels));
    // The image itself, and as much for what the format's library holds.
    require_memory(static_cast<std::uint64_t>(width * height) * 2 * sizeof(double), file.string());
}

} // namespace obscura::images
