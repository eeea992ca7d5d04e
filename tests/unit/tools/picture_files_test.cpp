// SPDX-License-Identifier: Apache-2.0
// FITS images of other programs (order of rows, packed tiles), and the date in pictures of scenes.
#include "images/image.hpp"
#include "sensors/fits_map.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/scene/date_cards.hpp"

#include <fitsio.h>

#include <array>
#include <numeric>
#include <string>
#include <vector>

namespace picture_files_test {

using namespace obscura;
using Catch::Matchers::WithinAbs;

namespace {

constexpr long width = 64, height = 48;

/// An image that counts its pixels, written by CFITSIO, packed by `method` (0: not).
std::filesystem::path write_fits(const std::filesystem::path& file, const char* row_order, int method) {
    int status = 0;
    fitsfile* fits = nullptr;
    fits_create_file(&fits, ("!" + file.string()).c_str(), &status);
    if (method != 0) fits_set_compression_type(fits, method, &status);
    std::array<long, 2> size{width, height};
    fits_create_img(fits, SHORT_IMG, 2, size.data(), &status);
    if (row_order != nullptr)
        fits_write_key(fits, TSTRING, "ROWORDER", const_cast<char*>(row_order), nullptr, &status);
    std::vector<short> values(width * height);
    std::iota(values.begin(), values.end(), short{0});
    fits_write_img(fits, TSHORT, 1, static_cast<LONGLONG>(values.size()), values.data(), &status);
    fits_close_file(fits, &status);
    REQUIRE(status == 0);
    return file;
}

} // namespace

TEST_CASE("rows of a FITS image are read in the order that it states") {
    const test::TempFolder folder;
    const std::filesystem::path file = folder.path() / "a.fits";
    for (const int method : {0, RICE_1, GZIP_1, HCOMPRESS_1}) {
        CAPTURE(method);
        for (const char* const order : {static_cast<const char*>(nullptr), "TOP-DOWN", "unknown"}) {
            const images::Image image = images::read_image(write_fits(file, order, method));
            REQUIRE(image.width == width);
            CHECK(image.values[1] == 1);
            CHECK(image.values[width] == width);
        }
        for (const char* const order : {"BOTTOM-UP", "bottom-up "}) {
            const images::Image image = images::read_image(write_fits(file, order, method));
            CHECK(image.values[1] == (height - 1) * width + 1);
            CHECK(image.values[width * (height - 1)] == 0);
            const std::vector<float> map = sensors::read_fits_map(file, width, height, 0);
            CHECK(map[1] == (height - 1) * width + 1);
        }
    }
}

TEST_CASE("a picture of a scene with an epoch has its date") {
    const test::TempFolder folder;
    CHECK(tools::date_cards(std::nullopt, 0, 0).empty());
    // 2026-01-01T00:00:00 UTC is 37 s behind TAI, 20454 days after 1970.
    const ephemeris::Epoch epoch{(20454LL * 86400 + 37) * 1'000'000'000};
    const images::Cards cards = tools::date_cards(epoch, 9.75, 10);
    const auto text = [&](const char* key) -> std::string {
        for (const images::Card& card : cards)
            if (card.key == key) return images::card_text(card);
        return "none";
    };
    CHECK(text("TIMESYS") == "UTC");
    CHECK(text("DATE-OBS") == "2026-01-01T00:00:09.75");
    CHECK(text("DATE-AVG") == "2026-01-01T00:00:10");
    CHECK_THAT(std::stod(text("MJD-AVG")), WithinAbs(61041 + 10.0 / 86400, 1e-11));
    CHECK_THAT(std::stod(text("MJD-OBS")), WithinAbs(61041 + 9.75 / 86400, 1e-11));
    // Before there was UTC.
    const images::Cards early = tools::date_cards(ephemeris::Epoch{-631152000LL * 1'000'000'000}, 0, 0);
    CHECK(images::card_text(early.front()) == "TT");
}

} // namespace picture_files_test
