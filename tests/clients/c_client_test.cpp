// SPDX-License-Identifier: Apache-2.0
// The C client beside servers that keep to the protocol, are late, or vanish.
#include "core/io/file_descriptor.hpp"
#include "service/tokens.hpp"
#include "tests/clients/c_client.hpp"
#include "tests/clients/fake_server.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/service_bench.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

using namespace obscura::test;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using obscura::service::MessageKind;

namespace {

Client connect(const FakeServer& server, double timeout_s = test_timeout_s) {
    obscura_connect_options options{};
    options.timeout_s = timeout_s;
    obscura_error error;
    Client client(obscura_connect(server.address().c_str(), &options, &error));
    INFO(error.message);
    REQUIRE(client != nullptr);
    return client;
}

} // namespace

TEST_CASE("values arrive at the server as they were made", "[clients]") {
    json received;
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        const auto request = connection.read();
        received = request.head;
        connection.answer(request.id, {{"value", request.head.at("value")}});
        connection.wait_for_end();
    });
    const Client client = connect(server);
    CHECK(std::string(obscura_as_string(obscura_find(obscura_server(client.get()), "version"))) == "fake");

    const std::string text = std::string(300, 'x') + "\xC3\xBC";
    obscura_value* numbers = obscura_numbers(std::vector<double>{0.1, -0.0, 1e300}.data(), 3);
    obscura_append(numbers, obscura_int(std::numeric_limits<std::int64_t>::min()));
    obscura_append(numbers, obscura_int(127));
    obscura_append(numbers, obscura_int(128));
    obscura_append(numbers, obscura_bool(1));
    obscura_append(numbers, obscura_nil());
    obscura_value* many = obscura_map_new();
    for (int i = 0; i < 70000; ++i)
        obscura_append(numbers, obscura_int(-1));
    for (int i = 0; i < 20; ++i)
        obscura_put(many, std::to_string(i).c_str(), obscura_int(i));
    obscura_put(many, "7", obscura_string("seven"));
    const char* const words[] = {"a", "", nullptr};
    obscura_value* value = obscura_map("numbers", numbers, "text", obscura_text(text.data(), text.size()),
                                       "many", many, "words", obscura_strings(words), nullptr);
    obscura_value* copy = obscura_value_copy(value);
    obscura_answer* raw = nullptr;
    REQUIRE(obscura_call(client.get(), "echo", obscura_map("value", value, nullptr), &raw) == OBSCURA_OK);
    const Answer answer(raw);
    CHECK(received.at("call") == "echo");
    const json& got = received.at("value");
    CHECK(got.at("text") == text);
    CHECK(got.at("words") == json::array({"a", ""}));
    CHECK(got.at("many").size() == 20);
    CHECK(got.at("many").at("7") == "seven");
    REQUIRE(got.at("numbers").size() == 70008);
    CHECK(got.at("numbers")[0] == 0.1);
    CHECK(std::signbit(got.at("numbers")[1].get<double>()));
    CHECK(got.at("numbers")[3] == std::numeric_limits<std::int64_t>::min());

    // And back: the answer is the value.
    const obscura_value* back = obscura_find(obscura_answer_map(answer.get()), "value");
    for (const obscura_value* each : {back, static_cast<const obscura_value*>(copy)}) {
        CHECK(std::string_view(obscura_as_string(obscura_find(each, "text"))) == text);
        const obscura_value* list = obscura_find(each, "numbers");
        REQUIRE(obscura_count(list) == 70008);
        CHECK(obscura_as_number(obscura_at(list, 2), 0) == 1e300);
        CHECK(obscura_as_int(obscura_at(list, 3), 0) == std::numeric_limits<std::int64_t>::min());
        CHECK(obscura_as_int(obscura_at(list, 5), 0) == 128);
        CHECK(obscura_as_bool(obscura_at(list, 6)) == 1);
        CHECK(obscura_type_of(obscura_at(list, 7)) == OBSCURA_NIL);
        CHECK(obscura_as_int(obscura_at(list, 70007), 0) == -1);
    }
    // What is not there is nil all the way.
    CHECK(obscura_as_number(obscura_at(obscura_find(obscura_find(back, "none"), "x"), 3), 5) == 5);
    CHECK(obscura_name_at(back, 99) == nullptr);
    obscura_value_free(copy);
}

TEST_CASE("arrays of an answer are views of its body", "[clients]") {
    const std::vector<float> light = {1, 2, 3, 4, 5, 6};
    std::string body(reinterpret_cast<const char*>(light.data()), 24);
    body += std::string("\x01\x02\x03\x04", 4);
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        for (auto request = connection.read(); request.id != 0; request = connection.read())
            connection.answer(request.id,
                              {{"arrays",
                                {array_row({1, 2, 3}, 0, 24), array_row({2}, 24, 4, "<u2"),
                                 array_row({0, 5}, 28, 0), array_row(json::array(), 4, 4)}}},
                              body);
    });
    const Client client = connect(server);
    obscura_answer* raw = nullptr;
    REQUIRE(obscura_render(client.get(), nullptr, &raw) == OBSCURA_OK);
    const Answer picture(raw);
    REQUIRE(obscura_array_count(raw) == 4);
    const obscura_array* first = obscura_array_find(raw, "a");
    REQUIRE(first == obscura_array_at(raw, 0));
    CHECK(first->dimensions == 3);
    CHECK(first->shape[2] == 3);
    CHECK(first->count == 6);
    CHECK(first->floats[5] == 6);
    const obscura_array* second = obscura_array_at(raw, 1);
    CHECK(second->floats == nullptr);
    CHECK(second->data == static_cast<const char*>(first->data) + 24);
    CHECK(obscura_array_at(raw, 2)->count == 0);
    CHECK(obscura_array_at(raw, 3)->floats[0] == 2);
    CHECK(obscura_array_at(raw, 4) == nullptr);
    CHECK(obscura_array_find(raw, "b") == nullptr);
}

TEST_CASE("an error answer has its texts and leaves the connection whole", "[clients]") {
    const FakeServer server([](const FakeConnection& connection) {
        connection.greet();
        connection.refuse(connection.read().id, {{"code", "bad-scene"},
                                                 {"message", std::string(5000, 'm')},
                                                 {"field", "body[0].albedo"},
                                                 {"allowed", "0 to 1"},
                                                 {"hint", 7}});
        connection.answer(connection.read().id);
        connection.wait_for_end();
    });
    const Client client = connect(server);
    CHECK(obscura_set_number(client.get(), "body", "ball", "albedo", 2) == OBSCURA_REFUSED);
    const obscura_error& error = *obscura_last_error(client.get());
    CHECK(std::string(error.code) == "bad-scene");
    CHECK(std::string(error.message) == std::string(1023, 'm'));
    CHECK(std::string(error.field) == "body[0].albedo");
    CHECK(std::string(error.allowed) == "0 to 1");
    CHECK(std::string(error.hint).empty());
    CHECK(obscura_remove(client.get(), "body", "ball") == OBSCURA_OK);
    CHECK(error.status == OBSCURA_OK);
    CHECK(std::string(error.message).empty());
}

TEST_CASE("an error of the connection ends it and tells why", "[clients]") {
    const FakeServer server([](const FakeConnection& connection) {
        connection.refuse(0, {{"code", "busy"}, {"message", "4 clients are connected already"}});
        connection.wait_for_end();
    });
    obscura_error error;
    CHECK(obscura_connect(server.address().c_str(), nullptr, &error) == nullptr);
    CHECK(error.status == OBSCURA_LOST);
    CHECK(std::string(error.code) == "busy");
    CHECK(std::string(error.message) == "4 clients are connected already");
}

TEST_CASE("what cannot be sent is not sent", "[clients]") {
    const FakeServer server([](const FakeConnection& connection) {
        connection.greet();
        for (auto request = connection.read(); request.id != 0; request = connection.read())
            connection.answer(request.id, {{"call", request.head.at("call")}});
    });
    const Client client = connect(server);
    CHECK(obscura_set_string(client.get(), "camera", nullptr, "look_at", nullptr) == OBSCURA_BAD_USE);
    CHECK_THAT(obscura_last_error(client.get())->message, ContainsSubstring("a value is missing"));
    CHECK(obscura_call(client.get(), "x", obscura_int(3), nullptr) == OBSCURA_BAD_USE);
    obscura_value* deep = obscura_int(1);
    for (int i = 0; i < 17; ++i) {
        obscura_value* around = obscura_array_new();
        obscura_append(around, deep);
        deep = around;
    }
    CHECK(obscura_load_scene(client.get(), deep) == OBSCURA_BAD_USE);
    CHECK_THAT(obscura_last_error(client.get())->message, ContainsSubstring("more than 16 levels"));
    CHECK(obscura_load_toml(client.get(), std::string(1U << 20, ' ').c_str()) == OBSCURA_BAD_USE);
    CHECK_THAT(obscura_last_error(client.get())->message, ContainsSubstring("allowed 1048576"));
    CHECK(obscura_wait(client.get(), 0, nullptr) == OBSCURA_BAD_USE);
    CHECK(obscura_load(client.get(), "demo") == OBSCURA_OK);
}

TEST_CASE("a late answer can be waited for again, and one that is given up is thrown away", "[clients]") {
    std::atomic<int> go{0};
    std::vector<std::string> calls;
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        const auto first = connection.read();
        while (go < 1)
            std::this_thread::sleep_for(1ms);
        connection.answer(first.id, {{"number", 1}});
        const auto second = connection.read();
        calls.push_back(connection.read().head.at("call")); // the cancel
        const auto third = connection.read();
        const std::string late =
            FakeConnection::message(MessageKind::answer, second.id, {{"number", 2}}, "body");
        connection.send(std::string_view(late).substr(0, 20));
        while (go < 2)
            std::this_thread::sleep_for(1ms);
        connection.send(std::string_view(late).substr(20));
        connection.answer(third.id, {{"number", 3}});
        connection.wait_for_end();
    });
    const Client client = connect(server);
    const auto number = [](const Answer& answer) {
        return obscura_as_int(obscura_find(obscura_answer_map(answer.get()), "number"), 0);
    };
    obscura_answer* raw = nullptr;
    REQUIRE(obscura_render_begin(client.get(), nullptr) == OBSCURA_OK);
    CHECK(obscura_wait(client.get(), 0, &raw) == OBSCURA_PENDING);
    CHECK(obscura_wait(client.get(), 0.02, &raw) == OBSCURA_PENDING);
    CHECK(raw == nullptr);
    go = 1;
    REQUIRE(obscura_wait(client.get(), -1, &raw) == OBSCURA_OK);
    CHECK(number(Answer(raw)) == 1);

    REQUIRE(obscura_render_begin(client.get(), nullptr) == OBSCURA_OK);
    REQUIRE(obscura_render_begin(client.get(), nullptr) == OBSCURA_OK);
    CHECK(obscura_wait(client.get(), 0.02, &raw) ==
          OBSCURA_PENDING); // part of the one that was given up is there
    go = 2;
    REQUIRE(obscura_wait(client.get(), -1, &raw) == OBSCURA_OK);
    CHECK(number(Answer(raw)) == 3);
    CHECK(calls == std::vector<std::string>{"cancel"});
}

TEST_CASE("frames of a stream come one by one, each for a credit", "[clients]") {
    std::vector<json> requests;
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        const auto stream = connection.read();
        const auto frame = [&](int number) {
            const json head{{"event", "frame"}, {"number", number}, {"arrays", {array_row({2}, 0, 8)}}};
            connection.send(FakeConnection::message(MessageKind::event, stream.id, head,
                                                    std::string(8, static_cast<char>(number))));
        };
        requests.push_back(stream.head);
        for (int number = 1; number <= 2; ++number)
            frame(number);
        for (int number = 3; number <= 5; ++number) {
            const auto credit = connection.read();
            requests.push_back(credit.head);
            CHECK(credit.head.at("request") == stream.id);
            connection.answer(credit.id, {{"credits", 1}});
            if (number == 3) frame(number);
        }
        connection.answer(stream.id, {{"frames", 3}});
        const auto further = connection.read();
        connection.send(FakeConnection::message(MessageKind::event, further.id,
                                                {{"event", "frame"}, {"arrays", {array_row({2}, 8, 8)}}},
                                                "12345678"));
        connection.wait_for_end();
    });
    const Client client = connect(server);
    REQUIRE(obscura_begin(client.get(), "stream", obscura_map("credits", obscura_int(2), NULL)) ==
            OBSCURA_OK);
    obscura_answer* raw = nullptr;
    for (int number = 1; number <= 3; ++number) {
        REQUIRE(obscura_next(client.get(), -1, &raw) == OBSCURA_OK);
        const Answer frame(raw);
        REQUIRE(frame);
        CHECK(obscura_as_int(obscura_find(obscura_answer_map(frame.get()), "number"), 0) == number);
        const obscura_array* const array = obscura_array_find(frame.get(), "a");
        REQUIRE(array != nullptr);
        CHECK(*static_cast<const char*>(array->data) == number);
    }
    CHECK(obscura_next(client.get(), -1, &raw) == OBSCURA_OK);
    CHECK(raw == nullptr); // it has ended
    CHECK(obscura_next(client.get(), 0, &raw) == OBSCURA_BAD_USE);
    CHECK(requests.size() == 4);
    // A frame with an array that is not in its body ends the connection.
    REQUIRE(obscura_begin(client.get(), "stream", nullptr) == OBSCURA_OK);
    CHECK(obscura_next(client.get(), -1, &raw) == OBSCURA_LOST);
    CHECK(raw == nullptr);
}

TEST_CASE("files of an answer are those that came with it", "[clients]") {
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        std::vector<int> ends(2), more(20);
        REQUIRE(::pipe(ends.data()) == 0);
        const auto first = connection.read();
        connection.answer(first.id, {{"number", 1}});
        const auto second = connection.read();
        connection.send(FakeConnection::message(MessageKind::event, second.id, {{"event", "progress"}}));
        connection.send_files(FakeConnection::message(MessageKind::answer, second.id, {{"descriptors", 2}}),
                              ends);
        const auto third = connection.read();
        for (int& each : more)
            each = ends[0];
        connection.send_files(FakeConnection::message(MessageKind::answer, third.id, {{"descriptors", 20}}),
                              more);
        for (const int end : ends)
            ::close(end);
        connection.wait_for_end();
    });
    const auto count_files = [] {
        return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
    };
    const auto before = count_files();
    {
        const Client client = connect(server);
        obscura_answer* raw = nullptr;
        REQUIRE(obscura_call(client.get(), "plain", nullptr, &raw) == OBSCURA_OK);
        CHECK(obscura_take_descriptor(Answer(raw).get(), 0) == -1);
        REQUIRE(obscura_call(client.get(), "ring", nullptr, &raw) == OBSCURA_OK);
        const Answer ring(raw);
        const obscura::FileDescriptor reads(obscura_take_descriptor(raw, 0)),
            writes(obscura_take_descriptor(raw, 1));
        CHECK(obscura_take_descriptor(raw, 0) == -1);
        CHECK(obscura_take_descriptor(raw, 2) == -1);
        REQUIRE(::write(writes.get(), "x", 1) == 1);
        char byte = 0;
        CHECK(::read(reads.get(), &byte, 1) == 1);
        CHECK(byte == 'x');
        CHECK((::fcntl(reads.get(), F_GETFD) & FD_CLOEXEC) != 0);
        // More than a client keeps.
        REQUIRE(obscura_call(client.get(), "many", nullptr, &raw) == OBSCURA_OK);
        const Answer many(raw);
        CHECK(obscura_take_descriptor(raw, 8) == -1);
    }
    until([&] { return count_files() <= before; }); // the server's side closes on its thread
}

TEST_CASE("progress is told, and cancels if it is wished", "[clients]") {
    const FakeServer server([](const FakeConnection& connection) {
        connection.greet();
        const auto request = connection.read();
        for (const json& event :
             {json{{"event", "progress"}, {"done", 1}, {"total", 9}}, json{{"event", "other"}},
              json{{"event", "progress"}, {"done", 2}, {"total", 9}, {"left_s", 3.5}}})
            connection.send(FakeConnection::message(MessageKind::event, request.id, event));
        const auto cancel = connection.read();
        CHECK(cancel.head.at("call") == "cancel");
        CHECK(cancel.head.at("request") == request.id);
        connection.answer(cancel.id, {{"cancelled", 1}});
        connection.refuse(request.id, {{"code", "cancelled"}, {"message", "cancelled"}});
        connection.answer(connection.read().id);
        connection.wait_for_end();
    });
    const Client client = connect(server);
    struct Told {
        std::vector<std::int64_t> done;
        double left_s = 0;
    } told;
    obscura_set_progress(
        client.get(),
        [](void* context, std::int64_t done, std::int64_t total, double left_s) {
            auto& all = *static_cast<Told*>(context);
            all.done.push_back(done);
            CHECK(total == 9);
            CHECK(std::isnan(left_s) == (done == 1));
            all.left_s = left_s;
            return done == 2 ? 1 : 0;
        },
        &told);
    CHECK(obscura_call(client.get(), "render", nullptr, nullptr) == OBSCURA_CANCELLED);
    CHECK(told.done == std::vector<std::int64_t>{1, 2});
    CHECK(told.left_s == 3.5);
    CHECK(obscura_call(client.get(), "status", nullptr, nullptr) == OBSCURA_OK);
}

TEST_CASE("another thread cancels a call that waits", "[clients]") {
    std::atomic<bool> asked{false};
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        const auto request = connection.read();
        asked = true;
        if (connection.read().head.at("request") != request.id) return;
        connection.refuse(request.id, {{"code", "cancelled"}, {"message", "cancelled"}});
        connection.wait_for_end();
    });
    const Client client = connect(server);
    obscura_cancel(client.get()); // of nothing: it does not hold for what comes
    std::thread other([&] {
        while (!asked)
            std::this_thread::sleep_for(1ms);
        obscura_cancel(client.get());
    });
    CHECK(obscura_call(client.get(), "render", nullptr, nullptr) == OBSCURA_CANCELLED);
    other.join();
}

TEST_CASE("a server that falls silent is given up", "[clients]") {
    const FakeServer server([](const FakeConnection& connection) {
        connection.greet();
        const auto request = connection.read();
        connection.send(FakeConnection::message(MessageKind::answer, request.id, {{"a", 1}}).substr(0, 26));
        connection.wait_for_end();
    });
    const Client client = connect(server, 0.05);
    CHECK(obscura_call(client.get(), "render", nullptr, nullptr) == OBSCURA_LOST);
    CHECK_THAT(obscura_last_error(client.get())->message, ContainsSubstring("no answer in time"));
    CHECK(obscura_socket(client.get()) == -1);
    CHECK(obscura_call(client.get(), "status", nullptr, nullptr) == OBSCURA_LOST);
    CHECK_THAT(obscura_last_error(client.get())->message, ContainsSubstring("closed"));
}

TEST_CASE("where no server is, none is found", "[clients]") {
    const TempFolder folder;
    for (const std::string& address :
         {(folder.path() / "socket").string(), std::string("127.0.0.1:1"), std::string("nonsense"),
          std::string(":5152"), std::string("127.0.0.1:x"), "/" + std::string(300, 'x')}) {
        obscura_error error;
        CHECK(obscura_connect(address.c_str(), nullptr, &error) == nullptr);
        CHECK(error.status == OBSCURA_LOST);
        CHECK_THAT(error.message, ContainsSubstring("is `obscura serve` running there?"));
    }
    obscura_error error;
    CHECK(obscura_connect(nullptr, nullptr, &error) == nullptr);
    CHECK(error.status == OBSCURA_BAD_USE);
    obscura_close(nullptr);
    obscura_answer_free(nullptr);
}

TEST_CASE("a token is proved without being sent", "[clients]") {
    const TempFolder folder;
    const std::string secret = "0123456789abcdef0123456789ABCDEF",
                      challenge = obscura::service::make_challenge();
    const std::string file = folder.write("token", secret);
    obscura::service::Token token{};
    std::copy(secret.begin(), secret.end(), token.begin());
    std::vector<json> calls;
    std::string given = challenge;
    const FakeServer server([&](const FakeConnection& connection) {
        calls.clear();
        for (auto request = connection.read(); request.id != 0; request = connection.read()) {
            calls.push_back(request.head);
            connection.answer(request.id, {{"challenge", given}});
        }
    });
    const auto connected = [&](const std::string& name) {
        obscura_connect_options options{};
        options.token_file = name.c_str();
        obscura_error error{};
        const bool good = Client(obscura_connect(server.address().c_str(), &options, &error)) != nullptr;
        return good ? std::string() : std::string(error.message);
    };
    CHECK(connected(file).empty());
    REQUIRE(calls.size() == 2);
    CHECK(calls[0].at("call") == "challenge");
    CHECK(calls[1].at("call") == "hello");
    CHECK(calls[1].at("proof") == obscura::service::proof_of(token, challenge)); // by OpenSSL
    CHECK_THAT(connected((folder.path() / "none").string()), ContainsSubstring("No such file"));
    CHECK_THAT(connected(folder.write("short", "31 bytes").string()),
               ContainsSubstring("which has 32 bytes"));
    CHECK_THAT(connected(folder.write("long", secret + "\n").string()),
               ContainsSubstring("which has 32 bytes"));
    for (const char* bad : {"", "00", "x"}) {
        given = bad + challenge.substr(1);
        CHECK_THAT(connected(file), ContainsSubstring("challenge is none"));
    }
}

TEST_CASE("a program that is no server is told of", "[clients]") {
    const TempFolder folder;
    const auto script = [&](const char* name, const std::string& text) {
        const auto file = folder.write(name, "#!/bin/sh\n" + text);
        std::filesystem::permissions(file, std::filesystem::perms::owner_all);
        return file.string();
    };
    const auto message = [](const std::string& program) {
        obscura_start_options options{};
        options.program = program.c_str();
        options.timeout_s = 0.3;
        obscura_error error;
        CHECK(obscura_start(&options, &error) == nullptr);
        CHECK(error.status == OBSCURA_LOST);
        return std::string(error.message);
    };
    CHECK_THAT(message((folder.path() / "none").string()), ContainsSubstring("environment variable OBSCURA"));
    CHECK(message(script("complains", "echo 'obscura: no licence' >&2; echo more >&2; exit 1\n")) ==
          "obscura: no licence");
    CHECK(message(script("ends", "exit 0\n")) == "the server ended at its start");
    CHECK(message(script("sleeps", "exec cat\n")) ==
          "the server ended at its start"); // it ends with its input
}
