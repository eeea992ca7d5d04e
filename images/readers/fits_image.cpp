// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "images/image.hpp"
#include "images/readers/fits_rows.hpp"

#include <fitsio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <span>

namespace obscura::images {
namespace {

class FitsReader {
public:
    explicit FitsReader(const std::filesystem::path& file) : file_(file) {
        fits_open_diskfile(&fits_, file.c_str(), READONLY, &status_);
        check();
    }
    ~FitsReader() {
        int ignored = 0;
        if (fits_ != nullptr) fits_close_file(fits_, &ignored);
        fits_clear_errmsg();
    }
    FitsReader(const FitsReader&) = delete;
    FitsReader& operator=(const FitsReader&) = delete;

    /// Moves to the first HDU that holds an image and returns its three axis lengths; the primary HDU may be
    /// empty.
    std::array<long, 3> find_image() {
        int dimensions = 0, type = 0;
        std::array<long, 3> size{1, 1, 1};
        move_to_first_image(fits_, status_);
        fits_get_hdu_type(fits_, &type, &status_);
        check();
        if (type == IMAGE_HDU) fits_get_img_dim(fits_, &dimensions, &status_);
        check();
        if (dimensions < 2 || dimensions > 3)
            throw InputError(fmt::format("{}: no image of 2 or 3 dimensions", file_.string()));
        fits_get_img_size(fits_, dimensions, size.data(), &status_);
        check();
        check_image_size(file_, size[0], size[1]);
        // Check the file size before anything is made for each pixel or plane: the header alone is not
        // trusted.
        LONGLONG data_start = 0, data_end = 0, header = 0;
        fits_get_hduaddrll(fits_, &header, &data_start, &data_end, &status_);
        check();
        // A pixel takes a byte at least; the planes lie one after the other. Tiles that are packed take a
        // part of that, at best what gzip makes of zeros.
        constexpr std::uintmax_t max_ratio = 1100;
        const std::uintmax_t ratio = fits_is_compressed_image(fits_, &status_) != 0 ? max_ratio : 1;
        check();
        const auto pixels = static_cast<std::uintmax_t>(size[0]) * static_cast<std::uintmax_t>(size[1]);
        const std::uintmax_t bytes = file_bytes_at(file_);
        const std::uintmax_t data = bytes - std::min(bytes, static_cast<std::uintmax_t>(data_start));
        if (size[2] < 1 || static_cast<std::uintmax_t>(size[2]) > data * ratio / pixels)
            throw InputError(fmt::format("{}: the file ends before its image", file_.string()));
        return size;
    }

    Image read(const std::string& plane) {
        const std::array<long, 3> size = find_image();
        const std::int32_t number = plane_number(file_, plane, size[2]);
        Image image;
        image.width = static_cast<std::int32_t>(size[0]);
        image.height = static_cast<std::int32_t>(size[1]);
        // Full scale applies to unscaled integers only; scaled or real values are physical values.
        int type = 0;
        fits_get_img_equivtype(fits_, &type, &status_);
        check();
        image.full_scale = type == BYTE_IMG ? 255 : type == USHORT_IMG ? 65535 : 1;
        const LONGLONG count = static_cast<LONGLONG>(size[0]) * size[1];
        image.values.resize(static_cast<std::size_t>(count));
        double unknown = std::numeric_limits<double>::quiet_NaN();
        int any = 0;
        fits_read_img(fits_, TDOUBLE, 1 + count * number, count, &unknown, image.values.data(), &any,
                      &status_);
        check();
        if (rows_from_bottom(fits_))
            flip_rows(std::span(image.values), static_cast<std::size_t>(image.width));
        return image;
    }

private:
    void check() {
        if (status_ == 0) return;
        char text[FLEN_ERRMSG] = {};
        fits_get_errstatus(status_, text);
        fits_clear_errmsg();
        throw InputError(fmt::format("{}: not readable as FITS: {}", file_.string(), text));
    }

    const std::filesystem::path& file_;
    fitsfile* fits_ = nullptr;
    int status_ = 0;
};

} // namespace

std::int64_t fits_planes(const std::filesystem::path& file) {
    return FitsReader(file).find_image()[2];
}

Image read_fits_image(const std::filesystem::path& file, const std::string& plane) {
    return FitsReader(file).read(plane);
}

} // namespace obscura::images
