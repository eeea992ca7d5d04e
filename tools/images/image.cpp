#include "tools/images/image.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>

namespace obscura::tools {

Image read_image(const std::filesystem::path& file, const std::string& plane) {
    const auto close = [](std::FILE* f) { std::fclose(f); };
    const std::unique_ptr<std::FILE, decltype(close)> in(std::fopen(file.c_str(), "rbe"), close);
    if (!in) throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(errno)));
    if (!std::filesystem::is_regular_file(file))
        throw InputError(fmt::format("{}: cannot be opened: not a regular file", file.string()));
    std::array<char, 512> bytes{};
    const std::string_view start(bytes.data(), std::fread(bytes.data(), 1, bytes.size(), in.get()));
    if (start.starts_with("SIMPLE  =")) return read_fits_image(file, plane);
    if (start.starts_with("\x89PNG")) return read_png_image(file);
    if (start.starts_with("v/1\x01")) return read_exr_image(file, plane);
    if (start.find("PDS_VERSION_ID") != std::string_view::npos) return read_pds3_image(file, plane);
    throw InputError(
        fmt::format("{}: not an image that is known here, allowed are FITS, PNG, OpenEXR and PDS3 (an "
                    "image with a detached label: give the label)",
                    file.string()));
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
        throw InputError(fmt::format("{}: an image of {} x {} pixels, allowed 1 to {} altogether",
                                     file.string(), width, height, max_image_pixels));
}

} // namespace obscura::tools
