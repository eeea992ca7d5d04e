// SPDX-License-Identifier: Apache-2.0
// The C client beside servers that mean harm.
#include "tests/clients/c_client.hpp"
#include "tests/clients/fake_server.hpp"
#include "tests/support/catch.hpp"

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using obscura::service::MessageKind;

namespace {

/// Status of one call, of a server that says `said` in answer to it, and hangs up.
obscura_error outcome_of(const std::string& said, obscura_connect_options options = {}) {
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        (void)connection.read();
        connection.send(said);
    });
    options.timeout_s = test_timeout_s;
    const Client client(obscura_connect(server.address().c_str(), &options, nullptr));
    REQUIRE(client != nullptr);
    obscura_answer* raw = nullptr;
    const obscura_status status = obscura_call(client.get(), "render", nullptr, &raw);
    const Answer answer(raw);
    const obscura_error error = *obscura_last_error(client.get());
    CHECK(error.status == status);
    CHECK((status == OBSCURA_OK) == (answer != nullptr));
    CHECK(std::string_view(error.message).find('\n') == std::string_view::npos);
    return error;
}

/// An answer to the second request, whose head is these bytes of MessagePack.
std::string answer_of(std::string_view packed) {
    return obscura::service::frame_text(
               {MessageKind::answer, 2, static_cast<std::uint32_t>(packed.size()), 0}) +
           std::string(packed);
}

} // namespace

TEST_CASE("an answer that is cut after any byte ends the connection", "[clients]") {
    const std::string whole = FakeConnection::message(MessageKind::answer, 2,
                                                      {{"text", std::string(40, 'x')},
                                                       {"numbers", {1, -1000, 1.5, nullptr, true}},
                                                       {"arrays", {array_row({2}, 0, 8)}}},
                                                      "12345678");
    CHECK(outcome_of(whole).status == OBSCURA_OK);
    for (std::size_t bytes = 0; bytes < whole.size(); ++bytes) {
        const obscura_error error = outcome_of(whole.substr(0, bytes));
        INFO(bytes);
        CHECK(error.status == OBSCURA_LOST);
        CHECK_THAT(error.message, ContainsSubstring("ended the connection"));
    }
}

TEST_CASE("what is no message of the protocol ends the connection", "[clients]") {
    const std::string good = FakeConnection::message(MessageKind::answer, 2, {{"a", 1}});
    const auto changed = [&](std::size_t at, char byte) {
        std::string text = good;
        text[at] = byte;
        return text;
    };
    for (const auto& [what, said] : std::vector<std::pair<const char*, std::string>>{
             {"magic", changed(0, 'X')},
             {"version", changed(4, 2)},
             {"kind", changed(5, 9)},
             {"flags", changed(6, 1)},
             {"head of 4 GiB", changed(15, '\x7F')},
             {"body of 2^63 bytes", changed(23, '\x7F')},
             {"a page of the web", "HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n"},
             {"no bytes", answer_of("")},
             {"no map", answer_of("\x91\xC0")},
             {"two values", answer_of("\x80\x80")},
             {"levels", answer_of(std::string(100000, '\x91') + "\xC0")},
             {"levels of maps",
              answer_of("\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x"
                        "\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\x81\xA1x\xC0")},
             {"4 G elements", answer_of("\xDD\xFF\xFF\xFF\xFF")},
             {"4 G members", answer_of("\xDF\xFF\xFF\xFF\xFF")},
             {"4 G bytes", answer_of("\x81\xA1x\xDB\xFF\xFF\xFF\xFF")},
             {"a key that is no string", answer_of("\x81\x01\x02")},
             {"binary data", answer_of(std::string_view("\x81\xA1x\xC4\x00", 5))},
             {"a code that is not used", answer_of("\xC1")},
             {"2^64 - 1", answer_of("\x81\xA1x\xCF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF")},
             {"too many values",
              answer_of("\xDD" + std::string("\x00\x20\x00\x00", 4) + std::string(1U << 21, '\xC0'))}}) {
        INFO(what);
        const obscura_error error = outcome_of(said);
        CHECK(error.status == OBSCURA_LOST);
        CHECK(std::string_view(error.message).size() > 20);
    }
    obscura_connect_options small{};
    small.max_body_bytes = 7;
    const std::string body = FakeConnection::message(MessageKind::answer, 2, json::object(), "12345678");
    CHECK_THAT(outcome_of(body, small).message, ContainsSubstring("too large"));
    CHECK(outcome_of(body).status == OBSCURA_OK);
}

TEST_CASE("arrays that are not in the body end the connection", "[clients]") {
    for (const json& row : {array_row({2}, 0, 12),
                            array_row({2}, 8, 8),
                            array_row({2}, 2, 8),
                            array_row({3}, 0, 8),
                            array_row({-2}, 0, 8),
                            array_row({2}, -4, 8),
                            array_row({2}, 0, -8),
                            array_row({2}, std::numeric_limits<std::int64_t>::max(), 8),
                            array_row({2}, 0, std::numeric_limits<std::int64_t>::max()),
                            array_row({2}, 0, 7),
                            array_row({0}, 0, 8),
                            array_row({1LL << 33, 1LL << 33}, 0, 8),
                            array_row({2}, 0, 8, "<f2"),
                            array_row({2}, 0, 8, ">f4"),
                            array_row({2}, 0, 8, "<f4x"),
                            array_row({2}, 0, 8, ""),
                            array_row("x", 0, 8),
                            array_row({2, "x"}, 0, 8),
                            array_row({1, 1, 1, 1, 1, 1, 1, 1, 2}, 0, 8),
                            json("row"),
                            json{{"name", "a"}},
                            json{{"name", "a"},
                                 {"dtype", "<f4"},
                                 {"shape", {2}},
                                 {"offset", 0},
                                 {"bytes", 8},
                                 {"codec", "lz4"}}}) {
        INFO(row.dump());
        const obscura_error error =
            outcome_of(FakeConnection::message(MessageKind::answer, 2, {{"arrays", {row}}}, "12345678"));
        CHECK(error.status == OBSCURA_LOST);
        CHECK_THAT(error.message, ContainsSubstring("an array "));
    }
}

TEST_CASE("noise for an answer does no harm", "[clients]") {
    std::uint64_t state = 1;
    const auto dice = [&state](std::uint64_t sides) {
        state = state * 6364136223846793005U + 1442695040888963407U;
        return (state >> 33) % sides;
    };
    const std::string good = FakeConnection::message(
        MessageKind::answer, 2, {{"a", {1, 2.5, "text", nullptr}}, {"arrays", {array_row({2}, 0, 8)}}},
        "12345678");
    for (int run = 0; run < 300; ++run) {
        std::string said = good;
        for (std::uint64_t changes = 1 + dice(4); changes > 0; --changes)
            said[dice(said.size())] = static_cast<char>(dice(256));
        obscura_connect_options options{};
        options.max_body_bytes = 1 << 20;
        (void)outcome_of(said, options);
    }
}
