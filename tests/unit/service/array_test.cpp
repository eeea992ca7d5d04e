// SPDX-License-Identifier: Apache-2.0
// Codecs of arrays: what is sent is what was there, byte for byte, or is sent as it is.
#include "service/array.hpp"
#include "tests/support/catch.hpp"

#include <lz4.h>
#include <zstd.h>

#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace array_test {

using namespace obscura::service;

namespace {

/// The sorted bytes of what was encoded.
std::string decompressed(const Array& array, std::size_t bytes) {
    std::string out(bytes, '\0');
    if (array.codec == Codec::shuffle_lz4)
        REQUIRE(LZ4_decompress_safe(array.encoded.data(), out.data(), static_cast<int>(array.encoded.size()),
                                    static_cast<int>(bytes)) == static_cast<int>(bytes));
    else
        REQUIRE(ZSTD_decompress(out.data(), bytes, array.encoded.data(), array.encoded.size()) == bytes);
    return out;
}

template<typename Element>
std::vector<Element> decoded(const Array& array, std::size_t count) {
    const std::string sorted = decompressed(array, count * sizeof(Element));
    std::string bytes(sorted.size(), '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = sorted[i % sizeof(Element) * count + i / sizeof(Element)];
    std::vector<Element> values(count);
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

} // namespace

TEST_CASE("values come back from each codec", "[service]") {
    std::mt19937 random(1);
    std::vector<float> light(4099);
    for (float& value : light)
        value = static_cast<float>(random() % 100) / 7;
    std::vector<std::uint16_t> dn(4099);
    for (std::uint16_t& value : dn)
        value = static_cast<std::uint16_t>(random() % 300);
    for (const Codec codec : {Codec::shuffle_lz4, Codec::shuffle_zstd}) {
        Array array{"irradiance", {4099}, light};
        encode(array, codec);
        CHECK(array.codec == codec);
        CHECK(dtype_of(array) == "<f4");
        CHECK(bytes_of(array).size() == array.encoded.size());
        CHECK(array.encoded.size() < sizeof(float) * light.size());
        CHECK(decoded<float>(array, light.size()) == light);
        Array numbers{"dn", {4099}, dn};
        encode(numbers, codec);
        CHECK(numbers.codec == codec);
        CHECK(dtype_of(numbers) == "<u2");
        CHECK(decoded<std::uint16_t>(numbers, dn.size()) == dn);
    }
}

TEST_CASE("what would not become smaller is sent as it is", "[service]") {
    std::mt19937 random(1);
    std::vector<std::uint16_t> noise(1000);
    for (std::uint16_t& value : noise)
        value = static_cast<std::uint16_t>(random());
    for (const auto& values : {noise, std::vector<std::uint16_t>{}, std::vector<std::uint16_t>{7}})
        for (const Codec codec : {Codec::none, Codec::shuffle_lz4, Codec::shuffle_zstd}) {
            Array array{"dn", {values.size()}, values};
            encode(array, codec);
            CHECK(array.codec == Codec::none);
            CHECK(std::get<std::vector<std::uint16_t>>(array.values) == values);
        }
}

} // namespace array_test
