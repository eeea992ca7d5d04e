// SPDX-License-Identifier: Apache-2.0
// The logic of the Simulink block beside a server that is late, refuses, vanishes, or sends another picture.
extern "C" {
#include "clients/simulink/obscura_block.h"
}

#include "tests/clients/fake_server.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

using namespace obscura::test;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;
using nlohmann::json;

namespace {

struct Stop {
    void operator()(obscura_block* block) const { obscura_block_stop(block); }
};
using Block = std::unique_ptr<obscura_block, Stop>;

constexpr double fresh = OBSCURA_BLOCK_FRESH, late = OBSCURA_BLOCK_LATE, refused = OBSCURA_BLOCK_REFUSED,
                 gone = OBSCURA_BLOCK_GONE;
constexpr int width = 3, height = 2;

Block start(const std::string& address, double wait_s, const char* bodies = "ball") {
    const obscura_block_settings settings{address.c_str(), "demo", bodies, width, height, 4, wait_s};
    char why[512] = "";
    Block block(obscura_block_start(&settings, why, sizeof why));
    INFO(why);
    REQUIRE(block != nullptr);
    return block;
}

/// Poses of camera and one ball at this place.
std::array<double, 14> poses(double x) {
    return {0, 0, 0, 1, 0, 0, 0, x, 0, 10, 1, 0, 0, 0};
}

/// Answers a picture whose values count from `first`, row by row, and a truth in which the ball is there.
void answer_picture(const FakeConnection& connection, std::uint32_t id, float first,
                    std::vector<int> shape = {1, height, width}) {
    std::vector<float> values;
    for (int i = 0; i < width * height; ++i)
        values.push_back(first + static_cast<float>(i));
    const json truth{
        {"camera", {{"position_m", {1, 2, 3}}}},
        {"bodies",
         {{{"name", "other"}}, {{"name", "ball"}, {"position_m", {first, 0, 10}}, {"range_m", 10}}}}};
    connection.answer(id,
                      {{"truth", truth},
                       {"arrays",
                        {{{"name", "irradiance"},
                          {"dtype", "<f4"},
                          {"shape", shape},
                          {"offset", 0},
                          {"bytes", 24},
                          {"codec", "none"}}}}},
                      std::string_view(reinterpret_cast<const char*>(values.data()), 24));
}

/// Answers the calls of the block, and tells what they were; `render` decides about pictures, false: hangs
/// up.
template<typename Render>
void play(const FakeConnection& connection, std::vector<json>& calls, Render render) {
    connection.greet();
    for (auto request = connection.read(); request.id != 0; request = connection.read()) {
        calls.push_back(request.head);
        if (request.head.at("call") != "render")
            connection.answer(request.id);
        else if (!render(request.id, request.head))
            return;
    }
}

} // namespace

TEST_CASE("a step sends the poses that have changed and gives the picture by columns", "[clients]") {
    std::vector<json> calls;
    const FakeServer server([&](const FakeConnection& connection) {
        play(connection, calls, [&](std::uint32_t id, const json& head) {
            answer_picture(connection, id, head.at("time_s").get<float>());
            return true;
        });
    });
    {
        const Block block = start(server.address(), 60, " ball ");
        const auto* first = obscura_block_step(block.get(), 1, poses(0).data());
        CHECK(std::vector<float>(first->picture, first->picture + 6) == std::vector<float>{1, 4, 2, 5, 3, 6});
        CHECK(std::vector<double>(first->flags, first->flags + 4) == std::vector<double>{fresh, 0, 1, 0});
        CHECK(first->truth[2] == 3);
        CHECK(std::isnan(first->truth[3]));
        CHECK(first->truth[11] == 1);
        CHECK(first->truth[11 + 7] == 10);
        CHECK(std::isnan(first->truth[11 + 10]));
        const auto* second = obscura_block_step(block.get(), 2, poses(5).data());
        CHECK(second->picture[0] == 2);
        CHECK(std::string(obscura_block_message(block.get())).empty());
    }
    std::vector<std::string> names;
    for (const json& call : calls)
        names.push_back(call.at("call").get<std::string>() + call.value("section", "") +
                        call.value("item", ""));
    CHECK(names == std::vector<std::string>{"scene.load", "scene.setcamera", "scene.setbodyball", "render",
                                            "scene.setbodyball", "render"});
    CHECK(calls[0].at("file") == "demo");
    CHECK(calls[1].at("keys").at("look_at").is_null());
    CHECK(calls[4].at("keys").at("position_m") == json::array({5, 0, 10}));
    CHECK(calls[5].at("width") == width);
    CHECK(calls[5].at("samples") == 4);
}

TEST_CASE("a late picture comes in a later step, and none is asked for twice", "[clients]") {
    std::vector<json> calls;
    std::atomic<int> pictures{1};
    const FakeServer server([&](const FakeConnection& connection) {
        play(connection, calls, [&, sent = 0](std::uint32_t id, const json& head) mutable {
            while (pictures <= sent)
                std::this_thread::sleep_for(1ms);
            answer_picture(connection, id, head.at("time_s").get<float>());
            ++sent;
            return true;
        });
    });
    {
        const Block patient = start(server.address(), 60);
        CHECK(obscura_block_step(patient.get(), 1, poses(0).data())->flags[0] == fresh);
    }
    calls.clear();
    {
        const Block block = start(server.address(), 0.05);
        // The first pictures of this connection: the one that is allowed, then none for two steps.
        CHECK(obscura_block_step(block.get(), 1, poses(0).data())->picture[0] == 1);
        for (int step = 2; step <= 3; ++step) {
            const auto* given = obscura_block_step(block.get(), step, poses(step).data());
            CHECK(given->flags[0] == late);
            CHECK(given->flags[1] == step - 1);
            CHECK(given->picture[0] == 1);
            CHECK(given->truth[11] == 1);
        }
        pictures = 2; // that of step 2 comes; that of step 4 does not
        const auto* outputs = obscura_block_step(block.get(), 4, poses(4).data());
        for (int step = 5; outputs->picture[0] == 1 && step < 1000; ++step) // a busy machine
            outputs = obscura_block_step(block.get(), step, poses(4).data());
        CHECK(outputs->picture[0] == 2);
        CHECK(outputs->flags[0] == late);
        CHECK(outputs->flags[1] >= 2);
        CHECK(outputs->flags[2] == 2);
        CHECK(outputs->flags[3] >= 3);
        pictures = 100;
        for (int step = 0; step < 1000 && outputs->flags[0] != fresh; ++step)
            outputs = obscura_block_step(block.get(), 2000, poses(7).data());
        CHECK(outputs->picture[0] == 2000);
        CHECK(outputs->flags[1] == 0);
    }
    std::vector<int> asked;
    for (const json& call : calls)
        if (call.at("call") == "render" && call.at("time_s") < 2000) asked.push_back(call.at("time_s"));
    REQUIRE(asked.size() >= 3);
    CHECK(asked[0] == 1);
    CHECK(asked[1] == 2); // step 3 asked for nothing
    CHECK(asked[2] >= 4);
}

TEST_CASE("a pose that is refused leaves the block at work", "[clients]") {
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        for (auto request = connection.read(); request.id != 0; request = connection.read())
            if (request.head.at("call") == "render")
                answer_picture(connection, request.id, 1);
            else if (request.head.contains("keys") &&
                     std::isnan(request.head["keys"]["position_m"][0].get<double>()))
                connection.refuse(request.id, {{"code", "bad-scene"}, {"message", "not a finite number"}});
            else
                connection.answer(request.id);
    });
    const Block block = start(server.address(), 60);
    const auto* outputs = obscura_block_step(block.get(), 0, poses(std::nan("")).data());
    CHECK(outputs->flags[0] == refused);
    CHECK(std::string(obscura_block_message(block.get())) == "not a finite number");
    CHECK(obscura_block_step(block.get(), 0, poses(1).data())->flags[0] == fresh);
    CHECK(std::string(obscura_block_message(block.get())).empty());
}

TEST_CASE("a server that goes leaves the last picture", "[clients]") {
    std::vector<json> calls;
    const FakeServer server([&](const FakeConnection& connection) {
        play(connection, calls, [&, sent = 0](std::uint32_t id, const json&) mutable {
            if (sent++ == 2) return false;
            answer_picture(connection, id, 7);
            return true;
        });
    });
    const Block block = start(server.address(), 60);
    for (int step = 0; step < 2; ++step)
        CHECK(obscura_block_step(block.get(), step, poses(step).data())->flags[0] == fresh);
    for (int step = 2; step < 5; ++step) {
        const auto* outputs = obscura_block_step(block.get(), step, poses(step).data());
        CHECK(outputs->flags[0] == gone);
        CHECK(outputs->flags[1] == step - 1);
        CHECK(outputs->picture[0] == 7);
    }
    CHECK_THAT(obscura_block_message(block.get()), ContainsSubstring("the connection is closed"));
}

TEST_CASE("a picture of another size is not taken", "[clients]") {
    const FakeServer server([&](const FakeConnection& connection) {
        std::vector<json> calls;
        play(connection, calls, [&](std::uint32_t id, const json&) {
            answer_picture(connection, id, 7, {1, width, height});
            return true;
        });
    });
    const Block block = start(server.address(), 60);
    const auto* outputs = obscura_block_step(block.get(), 0, poses(0).data());
    CHECK(outputs->flags[0] == refused);
    CHECK(outputs->picture[0] == 0);
    CHECK_THAT(obscura_block_message(block.get()), ContainsSubstring("another form"));
}

TEST_CASE("a block that cannot start says why", "[clients]") {
    char why[512] = "";
    obscura_block_settings settings{"127.0.0.1:1", "demo", "", width, height, 4, 1};
    CHECK(obscura_block_start(&settings, why, sizeof why) == nullptr);
    CHECK_THAT(why, ContainsSubstring("is `obscura serve` running there?"));
    settings.width = 0;
    CHECK(obscura_block_start(&settings, why, sizeof why) == nullptr);
    CHECK_THAT(why, ContainsSubstring("at least 1"));
    const FakeServer server([&](const FakeConnection& connection) {
        connection.greet();
        connection.refuse(connection.read().id, {{"code", "bad-scene"}, {"message", "no such scene"}});
        connection.wait_for_end();
    });
    const std::string address = server.address();
    settings = {address.c_str(), "nothing", "", width, height, 4, 1};
    CHECK(obscura_block_start(&settings, why, sizeof why) == nullptr);
    CHECK(std::string(why) == "no such scene");
    CHECK(obscura_block_objects("") == 1);
    CHECK(obscura_block_objects("a,b") == 3);
}
