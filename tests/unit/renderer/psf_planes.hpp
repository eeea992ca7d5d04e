// SPDX-License-Identifier: Apache-2.0
// FITS tables of point spread functions for tests.
#pragma once

#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fitsio.h>

#include <string>
#include <vector>

namespace obscura::test {

/// An image of a PSF for a FITS table, square unless its width or height is set.
struct Plane {
    int side = 0;
    std::vector<double> values;
    double oversampling = 1, x = 0, y = 0;
    int band = 0;
    int width = 0, height = 0;
};

/// Writes a table of them; returns its path.
inline std::string write_fits(const TempFolder& folder, const std::string& name, std::vector<Plane> planes) {
    const std::string file = (folder.path() / name).string();
    fitsfile* fits = nullptr;
    int status = 0;
    fits_create_diskfile(&fits, file.c_str(), &status);
    for (Plane& p : planes) {
        long size[2] = {p.width > 0 ? p.width : p.side, p.height > 0 ? p.height : p.side};
        fits_create_img(fits, DOUBLE_IMG, 2, size, &status);
        fits_write_key(fits, TDOUBLE, "OVERSAMP", &p.oversampling, nullptr, &status);
        fits_write_key(fits, TDOUBLE, "FIELDX", &p.x, nullptr, &status);
        fits_write_key(fits, TDOUBLE, "FIELDY", &p.y, nullptr, &status);
        if (p.band > 0) fits_write_key(fits, TINT, "BAND", &p.band, nullptr, &status);
        fits_write_img(fits, TDOUBLE, 1, static_cast<LONGLONG>(p.values.size()), p.values.data(), &status);
    }
    fits_close_file(fits, &status);
    REQUIRE(status == 0);
    return file;
}

} // namespace obscura::test
