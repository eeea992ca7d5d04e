// SPDX-License-Identifier: Apache-2.0
// Image readers against the writers' own independent checks, hostile files, and registration against shifts
// that are known because they were put in.
#include "core/error.hpp"
#include "core/geometry.hpp"
#include "images/image.hpp"
#include "images/readers/pds_label.hpp"
#include "images/writers/exr.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/png.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/compare/registration.hpp"
#include "tools/import/near_msi.hpp"
#include "tools/import/utc.hpp"

#include <sys/stat.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <sstream>

namespace images_test {

using namespace obscura;
using namespace obscura::tools;
using namespace obscura::images;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using obscura::images::Image;

namespace {

std::string complaint(const test::TempFolder& folder, const std::function<void()>& read) {
    try {
        read();
    } catch (const Error& error) {
        CHECK(error.status() == exit_no_input);
        std::string line = error.what();
        CHECK(line.find('\n') == std::string::npos);
        const std::string prefix = folder.path().string() + "/";
        if (const auto at = line.find(prefix); at != std::string::npos) line.erase(at, prefix.size());
        return line;
    }
    return "no error";
}

/// A field of Gaussian blobs whose centres are known, sampled at the pixel centres after a shift.
Image blobs(double shift_x, double shift_y, double scale, double offset, double noise, unsigned seed) {
    constexpr std::int32_t width = 96, height = 80;
    std::mt19937 places(5), random(seed);
    std::normal_distribution<double> normal;
    Image image{width, height, std::vector<double>(width * height, offset)};
    for (int blob = 0; blob < 40; ++blob) {
        const double x = static_cast<double>(places() % 1000) * 0.11 - 7 + shift_x;
        const double y = static_cast<double>(places() % 1000) * 0.094 - 7 + shift_y;
        const double sigma = 1.5 + static_cast<double>(places() % 100) * 0.03;
        for (std::int32_t j = 0; j < height; ++j)
            for (std::int32_t i = 0; i < width; ++i)
                image.values[static_cast<std::size_t>(j * width + i)] +=
                    scale * std::exp(-0.5 * ((i - x) * (i - x) + (j - y) * (j - y)) / (sigma * sigma));
    }
    for (double& v : image.values)
        v += noise * normal(random);
    return image;
}

/// Gaussian random field of mean 0 and variance 1, correlated over about `length_px`.
std::vector<double> texture(std::int32_t side, double length_px, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<double> field(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    for (double& v : field)
        v = normal(random);
    const auto radius = static_cast<std::int32_t>(3 * length_px);
    for (const bool along_x : {true, false}) {
        std::vector<double> out(field.size(), 0.0);
        for (std::int32_t y = 0; y < side; ++y)
            for (std::int32_t x = 0; x < side; ++x)
                for (std::int32_t i = -radius; i <= radius; ++i) {
                    const std::int32_t from = ((along_x ? x : y) + i + side) % side;
                    out[static_cast<std::size_t>(y * side + x)] +=
                        std::exp(-0.5 * i * i / (length_px * length_px)) *
                        field[static_cast<std::size_t>(along_x ? y * side + from : from * side + x)];
                }
        field = out;
    }
    double squares = 0;
    for (const double v : field)
        squares += v * v / static_cast<double>(field.size());
    for (double& v : field)
        v /= std::sqrt(squares);
    return field;
}

/// Lambert sphere before black sky, centre displaced by the shift, with a texture of the given contrast.
Image sphere(double shift_x, double shift_y, double radius_px, double length_px, double contrast,
             unsigned seed) {
    constexpr std::int32_t side = 112;
    const std::vector<double> pattern = texture(side, length_px, seed);
    Image image{side, side, {}};
    for (std::int32_t j = 0; j < side; ++j)
        for (std::int32_t i = 0; i < side; ++i) {
            const double x = (i - 55.5 - shift_x) / radius_px, y = (j - 55.5 - shift_y) / radius_px;
            const double r = std::hypot(x, y), z = std::sqrt(std::max(0.0, 1 - r * r));
            const double edge = std::clamp((1 - r) * radius_px + 0.5, 0.0, 1.0);
            const double lambert = std::max(0.0, x * std::sin(0.7) + z * std::cos(0.7));
            image.values.push_back(edge * lambert *
                                   (1 + contrast * pattern[static_cast<std::size_t>(j * side + i)]));
        }
    return image;
}

} // namespace

TEST_CASE("sub-pixel shifts, scale and offset come back") {
    const Image reference = blobs(0, 0, 1, 0, 0, 1);
    const double shifts[][2] = {{0, 0}, {0.3, -0.7}, {-2.45, 5.1}, {7.62, 0.5}, {-13.2, 11.9}};
    for (const auto& [x, y] : shifts) {
        const Agreement a = compare_images(reference, blobs(x, y, 3.5, 10, 0, 1), {16, true});
        CHECK_THAT(a.shift_x_px, WithinAbs(x, 0.01));
        CHECK_THAT(a.shift_y_px, WithinAbs(y, 0.01));
        CHECK_THAT(a.scale, WithinRel(3.5, 2e-3));
        CHECK_THAT(a.offset, WithinAbs(10, 0.01));
        CHECK(a.correlation > 0.9999);
        CHECK(a.residual_rms < 0.02);
    }
}

TEST_CASE("noise is told as a residual, and moves the shift by no more than it must") {
    const Agreement a =
        compare_images(blobs(0, 0, 1, 0, 0.02, 2), blobs(1.37, -0.81, 2, 1, 0.02, 3), {8, true});
    CHECK_THAT(a.shift_x_px, WithinAbs(1.37, 0.03));
    CHECK_THAT(a.shift_y_px, WithinAbs(-0.81, 0.03));
    CHECK(a.correlation > 0.99);
    CHECK(a.residual_rms > 0.02);
    CHECK(a.residual_rms < 0.06);
}

TEST_CASE("the standard error of a shift is what shifts scatter by") {
    // Twelve pairs with noise of their own: errors over standard errors must scatter by about one.
    double square_x = 0, square_y = 0;
    constexpr int pairs = 12;
    for (unsigned i = 0; i < pairs; ++i) {
        const Agreement a = compare_images(blobs(0, 0, 1, 0, 0.1, 100 + i),
                                           blobs(0.37, -0.81, 2, 1, 0.2, 200 + i), {2, true});
        REQUIRE(a.error_x_px > 0);
        REQUIRE(a.error_y_px > 0);
        CHECK(a.error_x_px < 0.1);
        square_x += std::pow((a.shift_x_px - 0.37) / a.error_x_px, 2) / pairs;
        square_y += std::pow((a.shift_y_px + 0.81) / a.error_y_px, 2) / pairs;
    }
    // Chi-square with 12 degrees of freedom, 99.9 % on either side, and 8 x 8 blocks to estimate from.
    CHECK(std::sqrt(square_x) > 0.4);
    CHECK(std::sqrt(square_x) < 1.8);
    CHECK(std::sqrt(square_y) > 0.4);
    CHECK(std::sqrt(square_y) < 1.8);
}

TEST_CASE("bodies with other textures do not pretend a significant shift") {
    // The texture moves the best shift by up to a pixel; over its standard error that must look like noise.
    struct Case {
        double radius_px, length_px, contrast;
    };
    double squares = 0, largest = 0;
    int beyond = 0, count = 0;
    for (const Case& c : {Case{20, 2, 0.1}, Case{20, 8, 0.1}, Case{20, 15, 0.1}, Case{40, 3, 0.3},
                          Case{40, 8, 0.1}, Case{40, 15, 0.3}})
        for (unsigned pair = 0; pair < 6; ++pair) {
            const Agreement a =
                compare_images(sphere(0, 0, c.radius_px, c.length_px, c.contrast, 100 + pair),
                               sphere(0, 0, c.radius_px, c.length_px, c.contrast, 200 + pair), {4, true});
            for (const auto& [shift, error] :
                 {std::pair{a.shift_x_px, a.error_x_px}, {a.shift_y_px, a.error_y_px}}) {
                CAPTURE(c.radius_px, c.length_px, pair, shift, error);
                const double z = std::isfinite(error) ? std::abs(shift) / error : 0;
                CHECK(z < 4);
                squares += z * z, largest = std::max(largest, z), beyond += z > 2 ? 1 : 0, ++count;
            }
        }
    CAPTURE(largest, beyond, count);
    CHECK(std::sqrt(squares / count) < 1.3);
    CHECK(std::sqrt(squares / count) > 0.4); // not merely large
    CHECK(beyond <= count / 10);
}

TEST_CASE("a shift between bodies with other textures is found where it exceeds their effect") {
    for (unsigned pair = 0; pair < 4; ++pair) {
        const Agreement a = compare_images(sphere(0, 0, 40, 4, 0.05, 300 + pair),
                                           sphere(2.3, -1.6, 40, 4, 0.05, 400 + pair), {6, true});
        CAPTURE(a.shift_x_px, a.shift_y_px, a.error_x_px, a.error_y_px);
        CHECK(std::abs(a.shift_x_px - 2.3) < 3 * a.error_x_px);
        CHECK(std::abs(a.shift_y_px + 1.6) < 3 * a.error_y_px);
        CHECK(a.shift_x_px > 5 * a.error_x_px);
        CHECK(a.shift_y_px < -5 * a.error_y_px);
    }
}

TEST_CASE("where images do not tell the shift, it has no standard error") {
    // A ramp: brighter to the right whatever the shift, so that the search ends at its border or anywhere.
    Image reference{64, 64, std::vector<double>(64 * 64)}, image = reference;
    std::mt19937 random(4);
    std::normal_distribution<double> normal;
    for (std::int32_t y = 0; y < 64; ++y)
        for (std::int32_t x = 0; x < 64; ++x) {
            const auto i = static_cast<std::size_t>(y * 64 + x);
            reference.values[i] = x;
            image.values[i] = x + 0.02 * x * x + 0.3 * normal(random);
        }
    const Agreement a = compare_images(reference, image, {4, true});
    CHECK(a.correlation > 0.9);
    CHECK((!std::isfinite(a.error_x_px) || a.error_x_px > 1));
    CHECK((!std::isfinite(a.error_y_px) || a.error_y_px > 1));
}

TEST_CASE("parts of a pixel come back from a real picture") {
    const auto file = test::data_file("flight_near_msi_eros/m0157063318f4_2p_iof_gbl.fit");
    if (!file) return;
    // Means over 4 x 4 pixels, begun at different pixels: the displacement is a number of quarters, exactly.
    const Image full = read_image(*file);
    const auto binned = [&](std::int32_t left, std::int32_t top) {
        Image out{130, 100, {}};
        for (std::int32_t y = 0; y < out.height; ++y)
            for (std::int32_t x = 0; x < out.width; ++x) {
                double sum = 0;
                for (std::int32_t j = 0; j < 4; ++j)
                    for (std::int32_t i = 0; i < 4; ++i)
                        sum += full.at(left + 4 * x + i, top + 4 * y + j);
                out.values.push_back(sum / 16);
            }
        return out;
    };
    const Image reference = binned(6, 5);
    for (const auto& [left, top] : {std::pair{7, 5}, {8, 3}, {3, 6}, {15, 10}}) {
        const Agreement a = compare_images(reference, binned(left, top), {4, true});
        CAPTURE(left, top, a.shift_x_px, a.shift_y_px, a.error_x_px, a.error_y_px);
        // Detail finer than these pixels is folded into them and moves with them, not with the scene.
        CHECK_THAT(a.shift_x_px, WithinAbs((6 - left) / 4.0, 0.03));
        CHECK_THAT(a.shift_y_px, WithinAbs((5 - top) / 4.0, 0.03));
        CHECK(a.error_x_px < 0.02);
        CHECK(a.error_y_px < 0.02);
    }
}

TEST_CASE("no shift is found beyond the limit, none is searched when none is allowed") {
    const Image reference = blobs(0, 0, 1, 0, 0, 1), image = blobs(6, 0, 1, 0, 0, 1);
    const Agreement limited = compare_images(reference, image, {2, true});
    CHECK(std::abs(limited.shift_x_px) <= 2);
    const Agreement none = compare_images(reference, image, {0, true});
    CHECK(none.shift_x_px == 0);
    CHECK(none.correlation == none.correlation_unshifted);
}

TEST_CASE("a known residual and block means") {
    Image reference{4, 4, std::vector<double>(16, 0)}, image = reference;
    for (std::size_t i = 0; i < 16; ++i)
        reference.values[i] = static_cast<double>(i + 1), image.values[i] = 2.0 * static_cast<double>(i + 1);
    image.values[5] += 1.6;
    const Agreement a = compare_images(reference, image, {0, false});
    // By hand: sum of squares 1496, 6 * 1.6 more in the cross term.
    CHECK_THAT(a.scale, WithinRel((2 * 1496 + 6 * 1.6) / 1496, 1e-12));
    const Image residual = residual_image(reference, image, a);
    CHECK_THAT(residual.values[5], WithinRel(13.6 - a.scale * 6, 1e-12));
    Agreement exact = a;
    exact.scale = 2;
    const BlockDisagreement blocks = compare_blocks(reference, image, exact, 2, 0.0);
    CHECK(blocks.blocks == 4);
    CHECK_THAT(blocks.worst, WithinRel(1.6 / (2 * (1 + 2 + 5 + 6)), 1e-12));
    CHECK(blocks.median == 0);
}

TEST_CASE("NaN pixels and flat images") {
    Image reference = blobs(0, 0, 1, 0, 0, 1), image = blobs(0, 0, 2, 0, 0, 1);
    image.values[40 * 96 + 40] = std::nan("");
    const Agreement a = compare_images(reference, image, {0, true});
    CHECK(a.pixels == 96 * 80 - 1);
    CHECK_THAT(a.scale, WithinRel(2.0, 1e-9));
    const Image flat{96, 80, std::vector<double>(96 * 80, 3.0)};
    CHECK_THROWS_AS(compare_images(flat, image, {0, true}), InputError);
    CHECK_THROWS_AS(compare_images(reference, Image{4, 4, std::vector<double>(16)}, {}), InputError);
}

TEST_CASE("what was written is read") {
    const test::TempFolder folder;
    const std::vector<std::uint16_t> words{0, 1, 2, 4095, 65535, 7};
    images::write_png16(folder.path() / "a.png", 3, 2, 12, words, {});
    images::write_fits16(folder.path() / "a.fits", 3, 2, words, {});
    const std::vector<double> expected(words.begin(), words.end());
    for (const char* name : {"a.png", "a.fits"}) {
        const Image image = read_image(folder.path() / name);
        CHECK(image.width == 3);
        CHECK(image.height == 2);
        CHECK(image.values == expected);
    }
    const std::vector<float> floats{0.5F, -1, 1e-20F, 3, 4, 5, 6, 7};
    images::write_fits_float(folder.path() / "cube.fits", 2, 2, 2, floats, "W m-2", {});
    CHECK(read_image(folder.path() / "cube.fits").values == std::vector<double>{0.5, -1, 1e-20F, 3});
    CHECK(read_image(folder.path() / "cube.fits", "1").values == std::vector<double>{4, 5, 6, 7});
    CHECK(complaint(folder, [&] { (void)read_image(folder.path() / "cube.fits", "2"); }) ==
          "cube.fits: no plane \"2\", allowed 0 to 1");
    const std::span<const float> all(floats);
    images::write_exr(folder.path() / "a.exr", 2, 2, {{"z.b", "", all.first(4)}, {"a.a", "", all.subspan(4)}},
                      {});
    CHECK(read_image(folder.path() / "a.exr").values == std::vector<double>{4, 5, 6, 7});
    CHECK(read_image(folder.path() / "a.exr", "z.b").values == std::vector<double>{0.5, -1, 1e-20F, 3});
    CHECK(read_image(folder.path() / "a.exr", "1").values == std::vector<double>{0.5, -1, 1e-20F, 3});
    CHECK(complaint(folder, [&] { (void)read_image(folder.path() / "a.exr", "red"); }) ==
          "a.exr: no channel \"red\", allowed a.a, z.b");
}

TEST_CASE("PDS3 images, attached and detached, in every sample type") {
    const test::TempFolder folder;
    const auto label = [](const std::string& pointer, const std::string& type, int bits,
                          const std::string& more) {
        return "PDS_VERSION_ID = PDS3\r\nRECORD_BYTES = 100\r\n/* a comment */\r\n^IMAGE = " + pointer +
               "\r\nNOTE = \"several\r\nlines = 3\"\r\nOBJECT = IMAGE\r\n LINES = 2\r\n LINE_SAMPLES = 2\r\n "
               "SAMPLE_TYPE = " +
               type + "\r\n SAMPLE_BITS = " + std::to_string(bits) + "\r\n" + more +
               "END_OBJECT = IMAGE\r\nEND\r\n";
    };
    folder.write("data.img", std::string("\x01\x02\xff\xfe\x00\x00\x7f\xff", 8));
    const auto values = [&](const std::string& text) {
        return read_image(folder.write("x.lbl", text)).values;
    };
    using V = std::vector<double>;
    CHECK(values(label("\"DATA.IMG\"", "MSB_INTEGER", 16, "")) == V{258, -2, 0, 32767});
    CHECK(values(label("\"DATA.IMG\"", "LSB_UNSIGNED_INTEGER", 16, "")) == V{513, 65279, 0, 65407});
    CHECK(values(label("('data.img', 2 <BYTES>)", "UNSIGNED_INTEGER", 8, "")) == V{2, 255, 254, 0});
    CHECK(values(label("\"DATA.IMG\"", "MSB_INTEGER", 16, " SCALING_FACTOR = 0.5\r\n OFFSET = 10.\r\n")) ==
          V{139, 9, 10, 16393.5});
    CHECK(values(label("\"DATA.IMG\"", "UNSIGNED_INTEGER", 8,
                       " LINE_PREFIX_BYTES = 1\r\n LINE_SUFFIX_BYTES = 1\r\n")) == V{2, 255, 0, 127});
    folder.write("data.img",
                 std::string("\x3f\x80\x00\x00\xc0\x00\x00\x00\x00\x00\x00\x00\x7f\x7f\xff\xff", 16));
    CHECK(values(label("\"DATA.IMG\"", "IEEE_REAL", 32, ""))[1] == -2);
    // Attached: the second record of the same file.
    std::string attached = label("2", "UNSIGNED_INTEGER", 8, "");
    attached.resize(100 * ((attached.size() + 99) / 100), ' ');
    const auto records = attached.size() / 100;
    attached.replace(attached.find("^IMAGE = 2"), 10, "^IMAGE = " + std::to_string(records + 1));
    attached += "abcd";
    CHECK(read_image(folder.write("a.img", attached)).values == V{'a', 'b', 'c', 'd'});

    const auto refusal = [&](const std::string& text) {
        return complaint(folder, [&] { (void)read_image(folder.write("x.lbl", text)); });
    };
    CHECK(refusal(label("\"GONE.IMG\"", "MSB_INTEGER", 16, "")) ==
          "GONE.IMG: cannot be opened: No such file or directory");
    CHECK(refusal(label("\"../../etc/passwd\"", "MSB_INTEGER", 16, "")).find("PASSWD: cannot be opened") ==
          0);
    CHECK(refusal(label("\"DATA.IMG\"", "MSB_INTEGER", 24, "")) ==
          "x.lbl: samples of type MSB_INTEGER with 24 bits cannot be read, allowed are integers of 8, 16, 32 "
          "and 64 bits and reals of 32 and 64 bits (IEEE, VAX)");
    CHECK(refusal(label("99", "UNSIGNED_INTEGER", 8, "")).find("x.lbl: ") == 0);
    CHECK(refusal("PDS_VERSION_ID = PDS3\nEND\n") == "x.lbl: the label has no IMAGE.LINE_SAMPLES");
    CHECK(refusal("PDS_VERSION_ID = \"PDS3\nEND\n") ==
          "x.lbl:3: not a PDS3 label: a text without its closing quote");
    CHECK(
        refusal("PDS_VERSION_ID = PDS3\nOBJECT = IMAGE\n LINES = 9999999\n LINE_SAMPLES = 9999999\nEND\n") ==
        "x.lbl: an image of 9999999 x 9999999 pixels, allowed 1 to 268435456 in total");
    CHECK(refusal(label("(\"DATA.IMG\", 9223372036854775807 <BYTES>)", "UNSIGNED_INTEGER", 8, "")) ==
          "x.lbl: ^IMAGE points behind any file");
    CHECK(
        refusal("PDS_VERSION_ID = PDS3\n^IMAGE = \"DATA.IMG\"\nRECORD_BYTES = 1\nOBJECT = IMAGE\n LINES = "
                "268435456\n LINE_SAMPLES = 1\n LINE_SUFFIX_BYTES = 1048576\n BANDS = 65536\n SAMPLE_BITS = "
                "8\nEND_OBJECT\nEND\n") == "x.lbl: the label's image layout is invalid");
    // In one pass: blanks looked at again for each of them would take this a quarter of an hour.
    CHECK(refusal("PDS_VERSION_ID = PDS3\nA = 1" + std::string(1'000'000, '\n') + "<m>\nEND\n") ==
          "x.lbl: the label has no IMAGE.LINE_SAMPLES");
}

TEST_CASE("TIFF and JPEG pictures are read, and their colours one by one") {
    // Written without this project: by plain byte lists, and by libjpeg with (10 x + y) in each sample.
    const std::filesystem::path corpus = OBSCURA_SOURCE_DIR "/tests/fuzz/texture_corpus";
    const Image grey = read_image(corpus / "grey.tif");
    CHECK(grey.width == 4);
    CHECK(grey.height == 3);
    CHECK(grey.full_scale == 255);
    for (std::size_t i = 0; i < 12; ++i)
        CHECK(grey.values[i] == static_cast<double>(i));
    CHECK(read_image(corpus / "float.tif").values == std::vector<double>{0, 0.5, 0.25, 1});
    CHECK(colour_planes(corpus / "rgb16.tif") == std::vector<std::string>{"red", "green", "blue"});
    CHECK(colour_planes(corpus / "grey.tif") == std::vector<std::string>{""});
    const Image blue = read_image(corpus / "rgb16.tif", "blue");
    CHECK(blue.full_scale == 65535);
    CHECK(blue.values == std::vector<double>{0x0504, 0x0B0A, 0x1110, 0x1716});
    CHECK(colour_planes(corpus / "cube.fits") == std::vector<std::string>{"0", "1", "2"});
    CHECK(colour_planes(corpus / "rgb.png").size() == 3);
    CHECK(colour_planes(corpus / "rgb.jpg").size() == 3);
    const Image jpeg = read_image(corpus / "grey.jpg");
    CHECK(jpeg.width == 8);
    CHECK(jpeg.height == 4);
    for (std::int32_t y = 0; y < 4; ++y)
        for (std::int32_t x = 0; x < 8; ++x)
            CHECK_THAT(jpeg.at(x, y), WithinAbs(10 * x + y, 4));
    const Image red = read_image(corpus / "rgb.jpg", "red");
    for (std::int32_t x = 0; x < 7; ++x)
        CHECK_THAT(red.at(x, 2), WithinAbs(30 * x + 2, 20));
    try {
        (void)read_image(corpus / "grey.jpg", "0");
        FAIL("accepted");
    } catch (const InputError& error) {
        CHECK(std::string(error.what()).find("grey.jpg: no plane \"0\", allowed red, green, blue") !=
              std::string::npos);
    }
}

TEST_CASE("broken and hostile image files are refused with one line") {
    const test::TempFolder folder;
    const auto refusal = [&](const std::string& name, const std::string& bytes) {
        return complaint(folder, [&] { (void)read_image(folder.write(name, bytes)); });
    };
    CHECK(
        refusal("empty", "") ==
        "empty: not an image of a supported format, allowed are FITS, PNG, TIFF, JPEG, OpenEXR and PDS3 (an "
        "image with a detached label: give the label)");
    CHECK(complaint(folder, [&] { (void)read_image(folder.path() / "gone"); }) ==
          "gone: cannot be opened: No such file or directory");
    CHECK(complaint(folder, [&] { (void)read_image(folder.path()); }).find("cannot be opened") !=
          std::string::npos);
    REQUIRE(mkfifo((folder.path() / "pipe").c_str(), 0600) == 0);
    CHECK(complaint(folder, [&] { (void)read_image(folder.path() / "pipe"); }) ==
          "pipe: cannot be opened: not a regular file");
    // Every file cut short at many places, and with flipped bytes, is refused or read, never worse.
    const std::vector<std::uint16_t> words(64 * 64, 1234);
    const std::vector<float> floats(64 * 64, 0.5F);
    images::write_png16(folder.path() / "g.png", 64, 64, 12, words, {});
    images::write_fits16(folder.path() / "g.fits", 64, 64, words, {});
    images::write_exr(folder.path() / "g.exr", 64, 64, {{"Y", "", floats}}, {});
    std::mt19937 random(9);
    for (const char* name : {"g.png", "g.fits", "g.exr"}) {
        std::ifstream in(folder.path() / name, std::ios::binary);
        const std::string good{std::istreambuf_iterator<char>(in), {}};
        int refused = 0;
        for (int i = 0; i < 60; ++i) {
            std::string bad = good;
            if (i % 2 == 0)
                bad.resize(16 + random() % (good.size() - 16));
            else
                for (int flips = 0; flips < 5; ++flips)
                    bad[8 + random() % (good.size() - 8)] ^= static_cast<char>(1 + random() % 255);
            try {
                (void)read_image(folder.write(std::string("bad-") + name, bad));
            } catch (const InputError& error) {
                ++refused;
                CHECK(std::string(error.what()).find('\n') == std::string::npos);
            }
        }
        CHECK(refused >= 5);
    }
}

TEST_CASE("times") {
    CHECK_THAT(tdb_days_from_j2000("2000-01-01T11:58:55.816").value(),
               WithinAbs(0, 1e-9)); // J2000 itself, in UTC
    // The leap second of 2017-01-01: 24 hours of UTC are 86401 s.
    CHECK_THAT((tdb_days_from_j2000("2017-01-01T00:00:00").value() -
                tdb_days_from_j2000("2016-12-31T00:00:00").value()) *
                   86400,
               WithinAbs(86401, 1e-4));
    for (const char* bad : {"", "2001", "2001-02-30T00:00:00", "1960-01-01T00:00:00", "2001-01-01T25:00:00",
                            "2001-01-01T00:00:00x", "2001-01-01 00:00:00"})
        CHECK_FALSE(tdb_days_from_j2000(bad).has_value());
}

TEST_CASE("real PDS3 products are read") {
    if (const auto moon = test::data_file("dem_moon_lola_ldem4/LDEM_4.LBL")) {
        const Image image = read_image(*moon);
        CHECK(image.width == 1440);
        CHECK(image.height == 720);
        const auto [low, high] = std::minmax_element(image.values.begin(), image.values.end());
        // Deepest (Antoniadi) and highest (Selenean summit) of the Moon, in metres about its reference
        // sphere.
        CHECK(*low - 1737400 < -8500);
        CHECK(*low - 1737400 > -9200);
        CHECK(*high - 1737400 > 9500);
        CHECK(*high - 1737400 < 10800);
    }
    const auto label = test::data_file("flight_near_msi_eros/m0157063318f4_2p_iof_gbl.lbl");
    const auto fits = test::data_file("flight_near_msi_eros/m0157063318f4_2p_iof_gbl.fit");
    if (label && fits) {
        // The same frame through two readers: the label's and the FITS header's description of it.
        CHECK(read_image(*label).values == read_image(*fits).values);
        const std::string scene = near_msi_scene(*fits, {"/mesh.obj", 1000, ""});
        CHECK(scene.find("position_m = [-11661, 27530, 20817]") != std::string::npos);

        // What the frame's own processing found its centre to show, from NEAR's pointing and its shape model
        // of the time: latitude -6.36, longitude 189.76 west, 23.6 km away (CENTER_LATITUDE,
        // CENTER_LONGITUDE, SLANT_DISTANCE of the label). Where our line of sight is at that longitude it
        // must be at that latitude and distance: 0.01 degrees are 0.75 pixels there.
        const auto numbers = [&scene](const std::string& key, std::size_t after) {
            std::istringstream text(scene.substr(scene.find(key, after) + key.size()));
            std::array<double, 4> out{};
            char comma = 0;
            for (double& v : out)
                text >> v >> comma;
            return out;
        };
        const std::size_t camera_at = scene.find("[camera]"), body_at = scene.find("[[body]]");
        const auto [px, py, pz, none] = numbers("position_m = [", camera_at);
        const auto [cw, cx, cy, cz] = numbers("orientation = [", camera_at);
        const auto [bw, bx, by, bz] = numbers("orientation = [", body_at);
        (void)none;
        const Quat to_body = conjugate(Quat{bw, bx, by, bz});
        const Vec3 from = rotate(to_body, Vec3{px, py, pz});
        const Vec3 ahead = rotate(to_body, rotate(Quat{cw, cx, cy, cz}, {0, 0, 1}));
        constexpr double degree = std::numbers::pi / 180;
        const double east = (360 - 189.76) * degree;
        // from + distance * ahead lies in the half plane of that meridian.
        const Vec3 across{-std::sin(east), std::cos(east), 0};
        const double distance_m = -dot(from, across) / dot(ahead, across);
        const Vec3 at = from + ahead * distance_m;
        CHECK(dot(at, Vec3{std::cos(east), std::sin(east), 0}) > 0);
        CHECK_THAT(std::asin(at.z / length(at)) / degree, WithinAbs(-6.36, 0.0125));
        CHECK_THAT(distance_m, WithinAbs(23600, 50));
    }
}

} // namespace images_test
