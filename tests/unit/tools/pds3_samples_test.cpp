// SPDX-License-Identifier: Apache-2.0
// Images of PDS3 labels over all sample types, byte orders, orders of bands, prefixes and forms of missing
// numbers, written byte by byte by the test.
#include "images/image.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace pds3_samples_test {

using namespace obscura;

namespace {

constexpr int width = 5, height = 4, bands = 3;

struct Type {
    const char* name;
    int bits;
    bool little, real, negative; ///< negative: the type has numbers below 0
};
constexpr std::array types{Type{"MSB_INTEGER", 8, false, false, true},
                           Type{"UNSIGNED_INTEGER", 8, false, false, false},
                           Type{"MSB_INTEGER", 16, false, false, true},
                           Type{"LSB_INTEGER", 16, true, false, true},
                           Type{"MSB_UNSIGNED_INTEGER", 16, false, false, false},
                           Type{"LSB_UNSIGNED_INTEGER", 16, true, false, false},
                           Type{"PC_INTEGER", 16, true, false, true},
                           Type{"VAX_UNSIGNED_INTEGER", 16, true, false, false},
                           Type{"SUN_INTEGER", 32, false, false, true},
                           Type{"LSB_UNSIGNED_INTEGER", 32, true, false, false},
                           Type{"MAC_INTEGER", 32, false, false, true},
                           Type{"LSB_INTEGER", 64, true, false, true},
                           Type{"IEEE_REAL", 32, false, true, true},
                           Type{"PC_REAL", 32, true, true, true},
                           Type{"MSB_IEEE_REAL", 64, false, true, true},
                           Type{"LSB_IEEE_REAL", 64, true, true, true}};

/// Number of a sample, which every type can hold.
int number_at(const Type& type, int x, int y, int b) {
    return (x + 5 * y + 20 * b) * (type.negative ? -1 : 1) + (type.negative ? 30 : 1);
}

/// Bits of a number in a type.
std::uint64_t bits_of(const Type& type, double value) {
    if (type.real)
        return type.bits == 32 ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                               : std::bit_cast<std::uint64_t>(value);
    const auto whole = static_cast<std::uint64_t>(static_cast<std::int64_t>(value));
    return type.bits == 64 ? whole : whole & ((std::uint64_t{1} << type.bits) - 1);
}

void append(std::string& data, const Type& type, double value) {
    const std::uint64_t bits = bits_of(type, value);
    const int bytes = type.bits / 8;
    for (int i = 0; i < bytes; ++i)
        data += static_cast<char>(bits >> (8 * (type.little ? i : bytes - 1 - i)));
}

/// The data of an image: bands one after the other, line by line, or sample by sample.
std::string data_of(const Type& type, const std::string& storage, int prefix, int suffix) {
    std::string data;
    const auto line = [&](auto samples) {
        data += std::string(static_cast<std::size_t>(prefix), '\x55');
        samples();
        data += std::string(static_cast<std::size_t>(suffix), '\x66');
    };
    const auto row = [&](int y, int b) {
        line([&] {
            for (int x = 0; x < width; ++x)
                append(data, type, number_at(type, x, y, b));
        });
    };
    if (storage == "SAMPLE_INTERLEAVED")
        for (int y = 0; y < height; ++y)
            line([&] {
                for (int x = 0; x < width; ++x)
                    for (int b = 0; b < bands; ++b)
                        append(data, type, number_at(type, x, y, b));
            });
    else if (storage == "LINE_INTERLEAVED")
        for (int y = 0; y < height; ++y)
            for (int b = 0; b < bands; ++b)
                row(y, b);
    else
        for (int b = 0; b < bands; ++b)
            for (int y = 0; y < height; ++y)
                row(y, b);
    return data;
}

std::string label_of(const Type& type, const std::string& more) {
    return fmt::format(
        "PDS_VERSION_ID = PDS3\r\n^IMAGE = \"a.img\"\r\nOBJECT = IMAGE\r\n LINES = {}\r\n"
        " LINE_SAMPLES = {}\r\n SAMPLE_TYPE = {}\r\n SAMPLE_BITS = {}\r\n{}END_OBJECT = IMAGE\r\nEND\r\n",
        height, width, type.name, type.bits, more);
}

} // namespace

TEST_CASE("samples of every type, byte order, order of bands and padding are read as they were written") {
    const test::TempFolder folder;
    for (const Type& type : types)
        for (const std::string storage : {"BAND_SEQUENTIAL", "LINE_INTERLEAVED", "SAMPLE_INTERLEAVED"})
            for (const auto& [prefix, suffix] : {std::pair{0, 0}, {3, 0}, {0, 2}, {7, 5}}) {
                INFO(type.name << type.bits << ' ' << storage << ' ' << prefix << ' ' << suffix);
                (void)folder.write("a.img", data_of(type, storage, prefix, suffix));
                const auto label = folder.write(
                    "a.lbl",
                    label_of(type, fmt::format(" BANDS = {}\r\n BAND_STORAGE_TYPE = {}\r\n"
                                               " LINE_PREFIX_BYTES = {}\r\n LINE_SUFFIX_BYTES = {}\r\n"
                                               " SCALING_FACTOR = 0.5\r\n OFFSET = 10\r\n",
                                               bands, storage, prefix, suffix)));
                for (int b = 0; b < bands; ++b) {
                    const images::Image image = images::read_image(label, std::to_string(b));
                    REQUIRE(image.values.size() == width * height);
                    bool same = true;
                    for (int y = 0; y < height; ++y)
                        for (int x = 0; x < width; ++x)
                            same = same && image.values[static_cast<std::size_t>(y * width + x)] ==
                                               10 + 0.5 * number_at(type, x, y, b);
                    CHECK(same);
                }
            }
}

TEST_CASE("every keyword and form of a missing number marks its samples") {
    const test::TempFolder folder;
    for (const Type& type : types) {
        const int missing = number_at(type, 2, 1, 0);
        const std::uint64_t bits = bits_of(type, missing);
        std::string binary;
        for (int i = type.bits - 1; i >= 0; --i)
            binary += (bits >> i & 1) != 0 ? '1' : '0';
        (void)folder.write("a.img", data_of(type, "BAND_SEQUENTIAL", 0, 0));
        for (const char* const keyword : {"MISSING_CONSTANT", "MISSING", "NULL_CONSTANT", "NULL", "CORE_NULL",
                                          "INVALID_CONSTANT", "UNKNOWN_CONSTANT", "NOT_APPLICABLE_CONSTANT"})
            for (const std::string& form : {std::to_string(missing), fmt::format("+{}.0", std::abs(missing)),
                                            fmt::format("16#{:X}#", bits), fmt::format("16#{:x}#", bits),
                                            "2#" + binary + "#", fmt::format("0x{:X}", bits)}) {
                if (form.front() == '+' && missing < 0) continue;
                INFO(type.name << type.bits << ' ' << keyword << ' ' << form);
                const auto label =
                    folder.write("a.lbl", label_of(type, fmt::format(" {} = {}\r\n", keyword, form)));
                const images::Image image = images::read_image(label);
                int holes = 0;
                for (const double v : image.values)
                    holes += std::isnan(v) ? 1 : 0;
                CHECK(holes == 1);
                CHECK(std::isnan(image.values[width + 2]));
            }
        // Several at once, and a text that is none.
        const auto label = folder.write(
            "a.lbl",
            label_of(type, fmt::format(
                               " CORE_NULL = {}\r\n MISSING_CONSTANT = {}\r\n UNKNOWN_CONSTANT = \"N/A\"\r\n",
                               missing, number_at(type, 0, 3, 0))));
        const images::Image image = images::read_image(label);
        CHECK(std::isnan(image.values[width + 2]));
        CHECK(std::isnan(image.values[3 * width]));
        CHECK(image.values[0] == number_at(type, 0, 0, 0));
    }
}

} // namespace pds3_samples_test
