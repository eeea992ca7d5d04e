// SPDX-License-Identifier: Apache-2.0
// The codec of the compatible protocol against bytes written by hand, and streams that lie or break off.
#include "service/compatible/codec.hpp"
#include "service/failure.hpp"
#include "tests/support/catch.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace codec_test {

using namespace obscura::service;
using namespace obscura::service::compatible;
using namespace std::string_literals;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Bytes of numbers and text as Qt writes them, one function a kind.
std::string u32(std::uint32_t n) {
    return {static_cast<char>(n >> 24), static_cast<char>(n >> 16 & 0xFF), static_cast<char>(n >> 8 & 0xFF),
            static_cast<char>(n & 0xFF)};
}
std::string ascii(std::string_view text) {
    std::string out = u32(static_cast<std::uint32_t>(2 * text.size()));
    for (const char c : text)
        out += "\0"s + c;
    return out;
}
std::string value(std::uint32_t type, const std::string& payload = {}) {
    return u32(type) + "\0"s + payload;
}
std::string one_field(const std::string& payload) {
    return u32(1) + ascii("x") + payload;
}

Fields decode(std::string_view text, const CompatibleLimits& limits = {}) {
    Decoder decoder(limits);
    REQUIRE(decoder.read(text) == text.size());
    REQUIRE(decoder.complete());
    return decoder.take();
}
Value decode_value(const std::string& payload, const CompatibleLimits& limits = {}) {
    return decode(one_field(payload), limits).at(0).value;
}
void check_refused(std::string_view text, const char* what, FailureCode code,
                   const CompatibleLimits& limits = {}) {
    Decoder decoder(limits);
    try {
        (void)decoder.read(text);
        FAIL("was not refused");
    } catch (const Failure& failure) {
        CHECK_THAT(failure.what(), ContainsSubstring(what));
        CHECK(failure.code == code);
    }
}

/// {"": "setFocus", "a": [true, -2, 3, 2^40, 0.5, None, {"k": b"\x00\xff"}], "empty": ""}, by Python's
/// struct.
const std::string whole =
    "\x00\x00\x00\x03\xff\xff\xff\xff\x00\x00\x00\x0a\x00\x00\x00\x00\x10\x00s\x00"
    "e\x00t\x00"
    "F\x00o\x00"
    "c\x00u\x00s\x00\x00\x00\x02\x00"
    "a\x00\x00\x00\x09\x00\x00\x00\x00\x07\x00\x00\x00\x01\x00\x01\x00\x00\x00\x02\x00\xff\xff\xff\xfe"
    "\x00\x00\x00\x03\x00\x00\x00\x00\x03\x00\x00\x00\x05\x00\x00\x00\x01\x00\x00\x00\x00\x00"
    "\x00\x00\x00\x06\x00\x3f\xe0\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x1c\x00"
    "\x00\x00\x00\x01\x00\x00\x00\x02\x00k\x00\x00\x00\x0c\x00\x00\x00\x00\x02\x00\xff"
    "\x00\x00\x00\x0a\x00"
    "e\x00m\x00p\x00t\x00y\x00\x00\x00\x0a\x00\xff\xff\xff\xff"s;

const Fields whole_fields{{"", "setFocus"},
                          {"a", List{true, std::int32_t{-2}, std::uint32_t{3}, std::uint64_t{1} << 40, 0.5,
                                     Value(), Fields{{"k", Bytes{"\0\xff"s}}}}},
                          {"empty", ""}};

} // namespace

TEST_CASE("a message of every type is read, and written as the same bytes", "[service]") {
    CHECK(decode(whole) == whole_fields);
    CHECK(encode(whole_fields) == whole);
}

TEST_CASE("a message may arrive cut after any byte", "[service]") {
    for (std::size_t cut = 0; cut < whole.size(); ++cut) {
        Decoder decoder({});
        const std::size_t first = decoder.read(std::string_view(whole).substr(0, cut));
        REQUIRE_FALSE(decoder.complete());
        REQUIRE(first <= cut);
        REQUIRE(decoder.read(std::string_view(whole).substr(first)) == whole.size() - first);
        REQUIRE(decoder.complete());
        REQUIRE(decoder.take() == whole_fields);
    }
}

TEST_CASE("what follows a message is left for the next", "[service]") {
    Decoder decoder({});
    const std::string two = whole + whole;
    for (std::size_t at = 0; at < two.size(); at += whole.size()) {
        CHECK(decoder.read(std::string_view(two).substr(at)) == whole.size());
        CHECK(decoder.bytes() == whole.size());
        CHECK(decoder.take() == whole_fields);
    }
}

TEST_CASE("maps are read as hashes, and an empty string in both of its forms", "[service]") {
    const std::string inner = u32(1) + ascii("k") + value(1, "\1"s);
    CHECK(decode_value(value(8, inner)) == decode_value(value(28, inner)));
    CHECK(decode_value(value(10, u32(0))) == Value(""));
    CHECK(decode_value(value(12, u32(0))) == Value(Bytes{}));
    CHECK(decode_value(value(9, u32(0))) == Value(List{}));
    CHECK(decode_value(value(28, u32(0))) == Value(Fields{}));
    CHECK(decode(u32(0)) == Fields{});
    CHECK(decode_value(value(9, u32(2) + value(9, u32(0)) + value(9, u32(1) + value(0)))) ==
          Value(List{List{}, List{Value()}}));
}

TEST_CASE("text beyond the first plane is two units of UTF-16", "[service]") {
    const Value moon = decode_value(value(10, u32(8) + "\xd8\x3c\xdf\x11\x26\x09\x00\xe9"s));
    CHECK(moon == Value("\xf0\x9f\x8c\x91\xe2\x98\x89\xc3\xa9"));
    CHECK(decode(encode({{"x", moon}})).at(0).value == moon);
    // What is no UTF-8 is sent as U+FFFD.
    CHECK(decode(encode({{"x", "a\xff\xc0\x80z\xed\xa0\x80"}})).at(0).value ==
          Value("a\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbdz\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd"));
}

TEST_CASE("types that the protocol does not have break it", "[service]") {
    for (const std::uint32_t type : {4U, 7U, 11U, 38U, 127U, 0xFFFFFFFFU})
        check_refused(one_field(value(type, std::string(16, '\0'))), "a value of type",
                      FailureCode::bad_message);
}

TEST_CASE("text that is no UTF-16 breaks it", "[service]") {
    for (const std::string& text : {"\xd8\x00"s, "\xdc\x00\x00z"s, "\xd8\x00\x00z"s, "\xd8\x00\xd8\x00"s})
        check_refused(one_field(value(10, u32(static_cast<std::uint32_t>(text.size())) + text)), "surrogate",
                      FailureCode::bad_message);
    check_refused(one_field(value(10, u32(3) + "abc")), "odd number", FailureCode::bad_message);
    check_refused(u32(1) + u32(1) + "x", "odd number", FailureCode::bad_message);
}

TEST_CASE("counts and lengths that no message can have are refused at once", "[service]") {
    for (const std::uint32_t many : {0xFFFFFFFFU, 0x7FFFFFFFU, 4'000'001U}) {
        check_refused(u32(many), "allowed 4000000", FailureCode::too_large);
        check_refused(one_field(value(9, u32(many))), "allowed 4000000", FailureCode::too_large);
        check_refused(one_field(value(28, u32(many))), "allowed 4000000", FailureCode::too_large);
    }
    for (const std::uint32_t type : {10U, 12U})
        check_refused(one_field(value(type, u32(0xFFFFFFFE))), "larger than the limit",
                      FailureCode::too_large);
    check_refused(u32(1) + u32(0x80000000), "larger than the limit", FailureCode::too_large);
}

TEST_CASE("nesting is limited, however deep it goes on", "[service]") {
    const CompatibleLimits limits;
    std::string deep;
    for (int i = 0; i < 100'000; ++i)
        deep += value(9, u32(1));
    check_refused(one_field(deep), "nested deeper than 16", FailureCode::too_large);
    std::string allowed;
    for (std::size_t i = 1; i < limits.depth; ++i)
        allowed += value(9, u32(1));
    (void)decode_value(allowed + value(0));
}

TEST_CASE("the values of a message are limited in all", "[service]") {
    CompatibleLimits limits;
    limits.values = 10;
    std::string list = value(9, u32(4) + value(0) + value(0) + value(0) + value(0));
    (void)decode_value(value(9, u32(1) + list), limits);
    check_refused(one_field(value(9, u32(2) + list + list)), "more than 10 values", FailureCode::too_large,
                  limits);
    // Those that are read in parts are not counted twice.
    Decoder decoder(limits);
    const std::string text = one_field(value(9, u32(1) + list));
    std::size_t at = 0;
    for (std::size_t end = 1; end <= text.size(); ++end)
        at += decoder.read(std::string_view(text).substr(at, end - at));
    CHECK(decoder.complete());
}

TEST_CASE("the bytes of a message are limited in all", "[service]") {
    CompatibleLimits limits;
    limits.message_bytes = 100;
    check_refused(one_field(value(12, u32(90) + std::string(90, 'x'))), "larger than the limit",
                  FailureCode::too_large, limits);
    (void)decode_value(value(12, u32(70) + std::string(70, 'x')), limits);
}

TEST_CASE("bytes at the end of a message need no copy", "[service]") {
    const std::string data(1000, 'p');
    const Fields before{{"", "getImage"}, {"w", std::int32_t{10}}};
    Fields all = before;
    all.push_back({"image_data", Bytes{data}});
    CHECK(encode(before, "image_data", data.size()) + data == encode(all));
    all.back().value = Bytes{};
    CHECK(encode(before, "image_data", 0) == encode(all));
}

} // namespace codec_test
