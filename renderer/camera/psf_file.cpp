// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/psf_file.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/memory_budget.hpp"
#include "images/readers/fits_rows.hpp"

#include <fitsio.h>
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numeric>
#include <string>

namespace obscura::renderer {
namespace {

constexpr long largest_side = 4096;
constexpr std::int32_t max_images = 4096;

struct CloseFits {
    void operator()(fitsfile* file) const {
        int status = 0;
        fits_close_file(file, &status);
    }
};

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
    throw InputError(fmt::format("{}: {}", file.string(), why));
}

double read_card(fitsfile* fits, const char* name, double fallback) {
    int status = 0;
    double value = fallback;
    fits_read_key(fits, TDOUBLE, name, &value, nullptr, &status);
    return status == 0 ? value : fallback;
}

} // namespace

double PsfImage::sum() const {
    return std::accumulate(values.begin(), values.end(), 0.0);
}

double PsfImage::at(double x, double y) const {
    const double column = x + (width - 1) / 2.0;
    const double row = y + (height - 1) / 2.0;
    const double left = std::floor(column);
    const double top = std::floor(row);
    double sum = 0;
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            const double c = left + i;
            const double r = top + j;
            if (c < 0 || r < 0 || c >= width || r >= height) continue;
            const double share =
                (i == 0 ? 1 - (column - left) : column - left) * (j == 0 ? 1 - (row - top) : row - top);
            sum += share * values[static_cast<std::size_t>(r) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(c)];
        }
    return sum;
}

std::vector<PsfImage> read_psf_file(const std::filesystem::path& file) {
    if (!is_plain_fits(file)) refuse(file, "cannot be read as FITS");
    int status = 0;
    fitsfile* opened = nullptr;
    // No extended file name syntax: the name is a path and nothing else.
    fits_open_diskfile(&opened, file.c_str(), READONLY, &status);
    if (status != 0) refuse(file, "cannot be read as FITS");
    const std::unique_ptr<fitsfile, CloseFits> fits(opened);
    int extensions = 0;
    fits_get_num_hdus(fits.get(), &extensions, &status);
    std::vector<PsfImage> images;
    for (int hdu = 1; hdu <= extensions && status == 0; ++hdu) {
        int kind = 0;
        fits_movabs_hdu(fits.get(), hdu, &kind, &status);
        if (status != 0) break;
        int bits = 0;
        int axes = 0;
        long size[3] = {1, 1, 1};
        if (kind != IMAGE_HDU) continue;
        fits_get_img_param(fits.get(), 3, &bits, &axes, size, &status);
        if (status != 0 || axes == 0) continue;
        if (axes > 3 || axes < 2 || size[0] < 1 || size[1] < 1 || size[0] > largest_side ||
            size[1] > largest_side || size[2] < 1 || size[2] > max_images)
            refuse(
                file,
                fmt::format(
                    "extension {}: {} x {} x {} values: allowed are images, or cubes of them, of 1 to {} a side",
                    hdu - 1, size[0], size[1], size[2], largest_side));
        PsfImage image;
        image.width = static_cast<std::int32_t>(size[0]);
        image.height = static_cast<std::int32_t>(size[1]);
        image.samples_per_pixel = read_card(fits.get(), "OVERSAMP", 1);
        image.samples_per_row = read_card(fits.get(), "OVERSAMY", 0);
        image.field_x = read_card(fits.get(), "FIELDX", 0);
        image.field_y = read_card(fits.get(), "FIELDY", 0);
        const double band = read_card(fits.get(), "BAND", 0);
        if (!(image.samples_per_pixel >= 0.1 && image.samples_per_pixel <= 256))
            refuse(file, fmt::format("extension {}: OVERSAMP {}: allowed 0.1 to 256 samples a pixel", hdu - 1,
                                     image.samples_per_pixel));
        if (image.samples_per_row != 0 && !(image.samples_per_row >= 0.1 && image.samples_per_row <= 256))
            refuse(file, fmt::format("extension {}: OVERSAMY {}: allowed 0.1 to 256 samples a pixel", hdu - 1,
                                     image.samples_per_row));
        if (!std::isfinite(image.field_x) || !std::isfinite(image.field_y) || !(band >= 0 && band <= 16))
            refuse(
                file,
                fmt::format("extension {}: "
                            "FIELDX, FIELDY or BAND: allowed are pixels of the sensor and bands from 1 to 16",
                            hdu - 1));
        const auto count = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
        for (long plane = 0; plane < size[2]; ++plane) {
            if (images.size() >= static_cast<std::size_t>(max_images)) refuse(file, "more than 4096 images");
            // This image, and the copy of it in the list.
            require_memory(2 * count * sizeof(double), file.string());
            image.values.assign(count, 0);
            // A cube without BAND has one plane for each.
            image.band = static_cast<std::int32_t>(size[2] > 1 && band == 0 ? plane + 1 : band);
            long first[3] = {1, 1, plane + 1};
            fits_read_pix(fits.get(), TDOUBLE, first, static_cast<LONGLONG>(count), nullptr,
                          image.values.data(), nullptr, &status);
            if (status != 0) refuse(file, fmt::format("extension {}: ends before its data do", hdu - 1));
            if (images::rows_from_bottom(fits.get()))
                images::flip_rows(std::span(image.values), static_cast<std::size_t>(image.width));
            for (const double v : image.values)
                if (!(v >= 0 && std::isfinite(v)))
                    refuse(file, fmt::format("extension {}: {}: allowed are numbers from 0 up", hdu - 1, v));
            if (!(image.sum() > 0)) refuse(file, fmt::format("extension {}: there is no light", hdu - 1));
            images.push_back(image);
        }
    }
    if (status != 0) refuse(file, "is damaged");
    if (images.empty()) refuse(file, "has no image");
    return images;
}

} // namespace obscura::renderer
