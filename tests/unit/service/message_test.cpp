// SPDX-License-Identifier: Apache-2.0
// Messages of the native protocol: what is sent is read back, and nothing else is taken for a message.
#include "core/error.hpp"
#include "service/failure.hpp"
#include "service/message.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

namespace message_test {

using namespace obscura;
using namespace obscura::service;
using Catch::Matchers::ContainsSubstring;
using nlohmann::json;

namespace {

const Limits limits;

std::string packed(const json& value) {
    std::string text;
    json::to_msgpack(value, text);
    return text;
}

/// What read_head() complains of; empty: nothing.
std::string refusal(std::string_view text) {
    try {
        (void)read_head(text, limits);
        return {};
    } catch (const Failure& failure) {
        CHECK(failure.code == FailureCode::bad_message);
        return failure.what();
    }
}

/// `count` in 4 bytes behind `code`, big-endian.
std::string sized(unsigned char code, std::uint32_t count) {
    std::string text(1, static_cast<char>(code));
    for (int shift = 24; shift >= 0; shift -= 8)
        text += static_cast<char>(count >> shift & 0xFF);
    return text;
}

const std::string map_of_a = "\x81\xA1"
                             "a"; // a map of one key, "a", whose value follows

} // namespace

TEST_CASE("a value becomes the head that its JSON text would become", "[service]") {
    using Ordered = nlohmann::ordered_json;
    const double none = std::numeric_limits<double>::quiet_NaN();
    const Ordered value{{"z", 1},
                        {"a", {{"late", -2}, {"early", 18446744073709551615U}, {"share", 0.1F}}},
                        {"path", "/s\xff/\xe2\x82"},
                        {"rows", {1.5, none, std::numeric_limits<double>::infinity(), nullptr, true}},
                        {"k\xc0y", Ordered::object()},
                        {"none", Ordered::array()}};
    CHECK(head_of(value) == json::parse(value.dump(-1, ' ', false, Ordered::error_handler_t::replace)));
}

TEST_CASE("a head is read back as it was sent, numbers to the last bit", "[service]") {
    const json head{{"call", "render"},
                    {"nil", nullptr},
                    {"yes", true},
                    {"small", -3},
                    {"large", std::numeric_limits<std::int64_t>::min()},
                    {"au", 149597870700.123},
                    {"tiny", 1e-300},
                    {"infinite", std::numeric_limits<double>::infinity()},
                    {"text", "Bahn \xC3\xBC"
                             "ber \xF0\x9F\x8C\x99"},
                    {"list", {1, 2.5, "three", json::array(), json::object()}}};
    CHECK(read_head(packed(head), limits) == head);
    const json nan = read_head(packed({{"x", std::nan("")}}), limits);
    CHECK(std::isnan(nan["x"].get<double>()));
}

TEST_CASE("a head that is cut after any byte, or goes on, is refused", "[service]") {
    const std::string whole =
        packed({{"call", "scene.set"},
                {"keys", {{"position_m", {1.5, -2e11, 3}}, {"name", std::string(40, 'x')}}},
                {"number", 1LL << 40}});
    for (std::size_t bytes = 0; bytes < whole.size(); ++bytes) {
        INFO(bytes);
        CHECK_THAT(refusal(std::string_view(whole).substr(0, bytes)), ContainsSubstring("head of a message"));
    }
    CHECK(refusal(whole).empty());
    CHECK_FALSE(refusal(whole + '\xC0').empty());
}

TEST_CASE("lengths and counts that the head does not have are refused at once", "[service]") {
    for (const unsigned char code : {0xDB, 0xDD, 0xDF, 0xC6, 0xC9}) {
        INFO(static_cast<int>(code));
        for (const std::uint32_t count : {0xFFFFFFFFU, 0x80000000U, 100U})
            CHECK_FALSE(refusal(map_of_a + sized(code, count)).empty());
    }
    CHECK_FALSE(refusal(sized(0xDF, 0xFFFFFFFFU)).empty());
}

TEST_CASE("nesting is refused beyond the limit, however deep it is", "[service]") {
    // The map around them is one level.
    const std::string fits = map_of_a + std::string(limits.head_depth - 2, '\x91') + '\x90';
    CHECK(refusal(fits).empty());
    CHECK_THAT(refusal(map_of_a + std::string(limits.head_depth - 1, '\x91') + '\x90'),
               ContainsSubstring("8 levels"));
    CHECK_THAT(refusal(map_of_a + std::string(1000000, '\x91')), ContainsSubstring("8 levels"));
    std::string maps;
    for (int i = 0; i < 100000; ++i)
        maps += map_of_a;
    CHECK_THAT(refusal(maps), ContainsSubstring("8 levels"));
}

TEST_CASE("more values than the limit are refused", "[service]") {
    const auto nils = [](std::uint32_t count) {
        return map_of_a + sized(0xDD, count) + std::string(count, '\xC0');
    };
    const auto most = static_cast<std::uint32_t>(limits.head_values) - 2; // beside map and array
    CHECK(refusal(nils(most)).empty());
    CHECK_THAT(refusal(nils(most + 1)), ContainsSubstring("200000 values"));
}

TEST_CASE("heads are maps with distinct UTF-8 keys, of plain values", "[service]") {
    CHECK_THAT(refusal("\x01"), ContainsSubstring("no map"));
    CHECK_THAT(refusal("\x90"), ContainsSubstring("no map"));
    CHECK_THAT(refusal("\x82\xA1"
                       "a\x01\xA1"
                       "a\x02"),
               ContainsSubstring("twice"));
    CHECK_FALSE(refusal("\x81\x01\x02").empty()); // an integer as a key
    CHECK_THAT(refusal(map_of_a + "\xC4\x01x"), ContainsSubstring("binary"));
    CHECK_THAT(refusal(map_of_a + "\xD4\x01x"), ContainsSubstring("binary"));
    CHECK_THAT(refusal(map_of_a + "\xCF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF"), ContainsSubstring("64 bits"));
    for (const char* const bad : {"\x80", "\xC3", "\xC0\xAF", "\xE0\x80\x80", "\xED\xA0\x80",
                                  "\xF4\x90\x80\x80", "\xF8\x88\x80\x80\x80", "a\xFF"}) {
        const std::string text = bad;
        INFO(text.size());
        CHECK_THAT(refusal(map_of_a + static_cast<char>(0xA0 + text.size()) + text),
                   ContainsSubstring("UTF-8"));
    }
}

TEST_CASE("a frame has the bytes that the protocol says", "[service]") {
    const std::string text = frame_text({MessageKind::answer, 0x01020304, 0x11, 0x0102030405060708});
    CHECK(text ==
          std::string("OBSC\x01\x02\x00\x00\x04\x03\x02\x01\x11\x00\x00\x00\x08\x07\x06\x05\x04\x03\x02\x01",
                      24));
    Limits wide;
    wide.body_bytes = std::numeric_limits<std::uint64_t>::max();
    const Frame frame = read_frame(text, wide);
    CHECK(frame.kind == MessageKind::answer);
    CHECK(frame.id == 0x01020304);
    CHECK(frame.head_bytes == 0x11);
    CHECK(frame.body_bytes == 0x0102030405060708);
}

TEST_CASE("frames of another protocol, and beyond the limits, are refused", "[service]") {
    const auto refused = [](std::string text) {
        try {
            (void)read_frame(text, limits);
            return std::string();
        } catch (const Failure& failure) {
            return std::string(name_of(failure.code)) + ": " + failure.what();
        }
    };
    const std::string good = frame_text({MessageKind::request, 1, 10, 0});
    CHECK(refused(good).empty());
    CHECK_THAT(refused("GET / HTTP/1.1\r\nHost: x\r\n"), ContainsSubstring("bad-message: not a message"));
    for (const auto& [at, value] : {std::pair{4, 2}, {5, 0}, {5, 5}, {6, 1}, {7, 1}}) {
        std::string text = good;
        text[static_cast<std::size_t>(at)] = static_cast<char>(value);
        INFO(at);
        CHECK_THAT(refused(text), ContainsSubstring("bad-message: "));
    }
    CHECK_THAT(refused(frame_text({MessageKind::request, 1, limits.head_bytes + 1, 0})),
               ContainsSubstring("too-large: a head of 1048577 bytes, allowed 1048576"));
    CHECK_THAT(refused(frame_text({MessageKind::request, 1, 10, std::numeric_limits<std::uint64_t>::max()})),
               ContainsSubstring("too-large: a body"));
}

TEST_CASE("a message lists its arrays", "[service]") {
    const Outgoing message = make_message(MessageKind::answer, 7, {{"unit", "W m-2"}},
                                          {{"irradiance", {1, 2, 3}, std::vector<float>{1, 2, 3, 4, 5, 6}},
                                           {"dn", {2}, std::vector<std::uint16_t>{7, 8}}});
    Limits wide;
    wide.body_bytes = 100;
    const Frame frame = read_frame(message.start, wide);
    CHECK(frame.id == 7);
    CHECK(frame.body_bytes == 28);
    REQUIRE(message.start.size() == Frame::bytes + frame.head_bytes);
    const json head = read_head(std::string_view(message.start).substr(Frame::bytes), limits);
    CHECK(head["unit"] == "W m-2");
    CHECK(head["arrays"][1] == json{{"name", "dn"},
                                    {"dtype", "<u2"},
                                    {"shape", {2}},
                                    {"offset", 24},
                                    {"codec", "none"},
                                    {"bytes", 4}});
}

TEST_CASE("arrays begin at multiples of 8 bytes", "[service]") {
    const Outgoing message = make_message(
        MessageKind::answer, 7, json::object(),
        {{"dn", {3}, std::vector<std::uint16_t>{1, 2, 3}}, {"depth_m", {1}, std::vector<float>{7}}});
    Limits wide;
    wide.body_bytes = 100;
    CHECK(read_frame(message.start, wide).body_bytes == 12);
    const json head = read_head(std::string_view(message.start).substr(Frame::bytes), limits);
    CHECK(head["arrays"][1]["offset"] == 8);
}

} // namespace message_test
