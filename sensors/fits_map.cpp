// SPDX-License-Identifier: Apache-2.0
#include "sensors/fits_map.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "images/readers/fits_rows.hpp"

#include <fitsio.h>
#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <memory>
#include <system_error>

namespace obscura::sensors {
namespace {

struct Close {
    void operator()(fitsfile* file) const noexcept {
        int status = 0;
        fits_close_file(file, &status);
    }
};
using FitsHandle = std::unique_ptr<fitsfile, Close>;

std::string explain(int status) {
    std::array<char, FLEN_STATUS> text{};
    fits_get_errstatus(status, text.data());
    return text.data();
}

} // namespace

std::vector<float> read_fits_map(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                                 double least) {
    const auto fail = [&](std::string_view why) -> InputError {
        return InputError(fmt::format("{}: {}; allowed: a FITS image of {} x {} numbers, at least {}",
                                      file.string(), why, width, height, least));
    };
    if (!is_plain_fits(file)) throw fail(explain(FILE_NOT_OPENED));
    int status = 0;
    fitsfile* raw = nullptr;
    // Use the disk-file call: fits_open_image would parse brackets in the name as a filter expression.
    if (fits_open_diskfile(&raw, file.c_str(), READONLY, &status) != 0) throw fail(explain(status));
    const FitsHandle handle(raw);
    images::move_to_first_image(raw, status);
    int axes = 0;
    std::array<long, 2> size{};
    int type = 0;
    if (fits_get_img_param(raw, 2, &type, &axes, size.data(), &status) != 0) throw fail(explain(status));
    if (axes != 2 || size[0] != width || size[1] != height)
        throw fail(fmt::format("{} axes, {} x {}", axes, size[0], size[1]));
    std::vector<float> map(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    if (fits_read_img(raw, TFLOAT, 1, static_cast<LONGLONG>(map.size()), nullptr, map.data(), nullptr,
                      &status) != 0)
        throw fail(explain(status));
    if (images::rows_from_bottom(raw)) images::flip_rows(std::span(map), static_cast<std::size_t>(width));
    for (std::size_t i = 0; i < map.size(); ++i)
        if (!std::isfinite(map[i]) || static_cast<double>(map[i]) < least)
            throw fail(fmt::format("pixel ({}, {}) is {}", i % static_cast<std::size_t>(width),
                                   i / static_cast<std::size_t>(width), map[i]));
    return map;
}

void write_fits_map(const std::filesystem::path& file, std::span<const float> map, std::int32_t width,
                    std::int32_t height, const std::string& unit, const std::string& comment) {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
    int status = 0;
    fitsfile* raw = nullptr;
    if (fits_create_diskfile(&raw, file.c_str(), &status) != 0)
        throw OutputError(fmt::format("{}: cannot be created: {}", file.string(), explain(status)), errno);
    FitsHandle handle(raw);
    std::array<long, 2> size{width, height};
    fits_create_img(raw, FLOAT_IMG, 2, size.data(), &status);
    std::string unit_text = unit;
    if (!unit.empty()) fits_update_key(raw, TSTRING, "BUNIT", unit_text.data(), nullptr, &status);
    fits_write_comment(raw, comment.c_str(), &status);
    fits_write_img(raw, TFLOAT, 1, static_cast<LONGLONG>(map.size()), const_cast<float*>(map.data()),
                   &status);
    fitsfile* open = handle.release();
    fits_close_file(open, &status);
    if (status != 0)
        throw OutputError(fmt::format("{}: cannot be written: {}", file.string(), explain(status)));
}

} // namespace obscura::sensors
