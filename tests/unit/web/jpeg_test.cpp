// SPDX-License-Identifier: Apache-2.0
// Pictures as JPEG: levels by the formula of the previews, pixels after decoding, and who gets them.
#include "core/error.hpp"
#include "images/image.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "web/live/jpeg.hpp"
#include "web/live/live_budget.hpp"
#include "web/live/live_message.hpp"
#include "web/live/made_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <string>
#include <vector>

namespace jpeg_test {

using namespace obscura;
using namespace obscura::web;

namespace {

/// A bright disc before noise, 12 bits.
std::vector<std::uint16_t> scene(std::size_t width, std::size_t height) {
    std::mt19937 dice(7);
    std::vector<std::uint16_t> out;
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const double r = std::hypot(static_cast<double>(x) - 40, static_cast<double>(y) - 30);
            out.push_back(static_cast<std::uint16_t>(60 + dice() % 4 + (r < 20 ? 1500 + 30 * r : 0)));
        }
    return out;
}

std::size_t count_of(const std::vector<Share>& shares, bool jpeg) {
    return static_cast<std::size_t>(std::count_if(shares.begin(), shares.end(),
                                                  [jpeg](const Share& share) { return share.jpeg == jpeg; }));
}

} // namespace

TEST_CASE("levels are those of the previews", "[web]") {
    const std::vector<std::uint16_t> image = scene(97, 61);
    std::vector<std::uint64_t> counts;
    const std::vector<std::uint8_t> levels = preview_levels(image, 12, counts);
    REQUIRE(levels.size() == 65536);
    std::vector<std::uint16_t> sorted = image;
    std::sort(sorted.begin(), sorted.end());
    const auto at = [&sorted](double part) {
        return static_cast<double>(
            sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1))]);
    };
    const double black = at(0.05), white = at(0.9999);
    for (std::size_t dn = 0; dn < levels.size(); ++dn) {
        const double x = std::clamp((static_cast<double>(dn) - black) / (white - black), 0.0, 1.0);
        const double level = 0.8 * std::pow(x, 1 / 2.2) + 0.2 * std::asinh(1000 * x) / std::asinh(1000.0);
        if (levels[dn] != std::lround(255 * level)) CHECK(levels[dn] == std::lround(255 * level));
    }
    // All pixels alike.
    CHECK(preview_levels(std::vector<std::uint16_t>(9, 5), 12, counts)[6] == 255);
}

TEST_CASE("a JPEG shows the levels", "[web]") {
    constexpr std::size_t width = 97, height = 61;
    const std::vector<std::uint16_t> image = scene(width, height);
    std::vector<std::uint64_t> counts;
    const std::vector<std::uint8_t> levels = preview_levels(image, 12, counts);
    const std::vector<unsigned char> jpeg = jpeg_of(image, height, levels);
    const test::TempFolder folder;
    const auto file = folder.path() / "picture.jpg";
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(jpeg.data()), static_cast<std::streamsize>(jpeg.size()));
    const images::Image read = images::read_jpeg_image(file, "");
    REQUIRE(read.width == width);
    REQUIRE(read.height == height);
    double sum = 0;
    for (std::size_t i = 0; i < image.size(); ++i)
        sum += std::pow(static_cast<double>(read.values[i]) - levels[image[i]], 2);
    CHECK(std::sqrt(sum / static_cast<double>(image.size())) < 12); // quality 85 of noise
    CHECK(jpeg.size() < 2 * image.size());
}

TEST_CASE("what has no pixel or too many is no JPEG", "[web]") {
    const std::vector<std::uint8_t> levels(65536);
    CHECK(jpeg_of({}, 0, levels).empty());
    CHECK(jpeg_of({}, 3, levels).empty());
    CHECK(jpeg_of(std::vector<std::uint16_t>(max_jpeg_side + 1), 1, levels).empty());
    CHECK(jpeg_of(std::vector<std::uint16_t>(max_jpeg_side + 1), max_jpeg_side + 1, levels).empty());
    CHECK_FALSE(jpeg_of(std::vector<std::uint16_t>(max_jpeg_side), 1, levels).empty());
}

TEST_CASE("a picture of a frame is made once for all viewers", "[web]") {
    const std::vector<std::uint16_t> image = scene(64, 48);
    transports::RingFrame frame;
    frame.serial = 3;
    frame.header.width = 64;
    frame.header.height = 48;
    frame.header.bits = 12;
    frame.pixels = image;
    MadePictures made;
    const View whole{0, 0, 64, 48, 1, Reduce::max}, half{0, 0, 64, 48, 2, Reduce::max};
    const MadePicture first = made.picture(frame, whole, true), second = made.picture(frame, whole, false);
    REQUIRE(first.jpeg);
    CHECK(*first.pixels == image);
    CHECK(first.pixels == second.pixels);
    CHECK_FALSE(second.jpeg);
    CHECK(made.picture(frame, whole, true).jpeg == first.jpeg);
    CHECK(made.picture(frame, half, true).jpeg != first.jpeg);
    frame.serial = 4;
    CHECK(made.picture(frame, whole, true).jpeg != first.jpeg);
}

TEST_CASE("viewers say which encoding they take", "[web]") {
    const auto encoding = [](const std::string& member) {
        return viewer_message_of(R"({"view": {"camera": "1-0")" + member + "}}").view->encoding;
    };
    CHECK(encoding("") == PictureEncoding::u16);
    CHECK(encoding(R"(, "enc": "u16")") == PictureEncoding::u16);
    CHECK(encoding(R"(, "enc": "jpeg")") == PictureEncoding::jpeg);
    CHECK(encoding(R"(, "enc": "auto")") == PictureEncoding::automatic);
    for (const char* value : {"1", "null", "\"png\"", "\"\""})
        CHECK_THROWS_WITH(encoding(std::string(", \"enc\": ") + value), "view: enc: u16, jpeg or auto");
}

TEST_CASE("over the budget those who take any encoding get JPEGs before larger bins", "[web]") {
    const View view{0, 0, 512, 512, 1, Reduce::max};
    const auto viewers = [&view](std::size_t count, PictureEncoding encoding) {
        return std::vector<Wish>(count, {view, 10, encoding});
    };
    CHECK(count_of(shared_out(viewers(2, PictureEncoding::automatic), 12e6), true) == 0);
    const std::vector<Share> many = shared_out(viewers(20, PictureEncoding::automatic), 12e6);
    CHECK(count_of(many, true) == 20);
    for (const Share& share : many) {
        CHECK(share.view.bin == 1);
        CHECK(share.hz >= min_hz);
    }
    for (const Share& share : shared_out(viewers(20, PictureEncoding::u16), 12e6)) {
        CHECK_FALSE(share.jpeg);
        CHECK(share.view.bin == 2);
    }
    CHECK(count_of(shared_out(viewers(1, PictureEncoding::jpeg), 12e6), true) == 1);
    // Once it is known how small they are.
    std::vector<Wish> small = viewers(20, PictureEncoding::jpeg);
    for (Wish& wish : small)
        wish.jpeg_share = 0.1;
    for (const Share& share : shared_out(small, 12e6))
        CHECK(share.hz == 10);
    // More than JPEGs can give.
    for (const Share& share : shared_out(viewers(200, PictureEncoding::automatic), 12e6))
        CHECK(share.view.bin > 1);
}

} // namespace jpeg_test
