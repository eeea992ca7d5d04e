// SPDX-License-Identifier: Apache-2.0
#include "images/readers/fits_rows.hpp"

#include "core/text/text.hpp"

namespace obscura::images {

void move_to_first_image(fitsfile* fits, int& status) {
    int units = 0, dimensions = 0;
    fits_get_num_hdus(fits, &units, &status);
    for (int unit = 1; unit <= units && dimensions < 2 && status == 0; ++unit) {
        int type = 0;
        fits_movabs_hdu(fits, unit, &type, &status);
        if (type == IMAGE_HDU) fits_get_img_dim(fits, &dimensions, &status);
    }
}

bool rows_from_bottom(fitsfile* fits) {
    int status = 0;
    char text[FLEN_VALUE] = {};
    fits_read_key(fits, TSTRING, "ROWORDER", text, nullptr, &status);
    fits_clear_errmsg();
    return status == 0 && upper_case(trimmed(text)) == "BOTTOM-UP";
}

} // namespace obscura::images
