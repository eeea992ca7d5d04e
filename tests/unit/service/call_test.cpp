// SPDX-License-Identifier: Apache-2.0
// The table of calls: fields are read and checked by their rows, and described by them.
#include "core/error.hpp"
#include "service/call.hpp"
#include "tests/support/catch.hpp"

#include <atomic>
#include <optional>
#include <string>

namespace call_test {

using namespace obscura;
using namespace obscura::service;
using nlohmann::json;

namespace {

struct Move {
    double speed = 2;
    std::int32_t steps = 1;
    std::string name;
    json keys;

    Fields fields() {
        return {{config::key("speed", &speed).unit("m/s").range(0, 10).help("Speed of the move"),
                 config::key("steps", &steps).range(1, 100).help("Number of steps"),
                 config::key("name", &name).required().help("Name of the body")},
                {{"keys", "map", "Keys of the body", &keys}}};
    }
};

class Quiet final : public Work {
public:
    [[nodiscard]] const std::atomic<bool>& cancelled() const noexcept override { return cancelled_; }
    void progress(std::uint64_t /*done*/, std::uint64_t /*total*/) override {}

private:
    std::atomic<bool> cancelled_{false};
};

Calls table() {
    Calls calls{
        call<Move>("body.move", Permission::scene, "Moves a body.", [](const Move& move, Work& /*work*/) {
            Answer answer;
            answer.head["text"] =
                move.name + " " + std::to_string(move.steps) + " " + std::to_string(move.speed);
            answer.head["keys"] = move.keys;
            return answer;
        })};
    calls[0].results = {{"text", "string", "", "What was asked for"}};
    return calls;
}

Failure failure_of(const json& request) {
    const Calls calls = table();
    try {
        (void)bind(find_call(calls, request["call"].get<std::string>()), request);
    } catch (const Failure& failure) {
        return failure;
    }
    FAIL("no failure");
    return {FailureCode::internal, ""};
}

} // namespace

TEST_CASE("a call gets its fields, and the defaults of those that are missing", "[service]") {
    const Calls calls = table();
    Quiet work;
    const auto run = [&](const json& request) { return bind(calls[0], request).run(work).head; };
    CHECK(run({{"call", "body.move"}, {"name", "probe"}})["text"] == "probe 1 2.000000");
    // The arguments of one request do not become the defaults of the next one.
    CHECK(run({{"call", "body.move"}, {"name", "x"}, {"steps", 5}, {"speed", 3}})["text"] == "x 5 3.000000");
    CHECK(run({{"call", "body.move"}, {"name", "y"}, {"keys", {{"a", nullptr}}}})["text"] == "y 1 2.000000");
    CHECK(run({{"call", "body.move"}, {"name", "y"}, {"keys", {{"a", nullptr}}}})["keys"] ==
          json{{"a", nullptr}});
}

TEST_CASE("a wrong field is refused with its name and what is allowed", "[service]") {
    const Failure range = failure_of({{"call", "body.move"}, {"name", "x"}, {"speed", 11}});
    CHECK(range.code == FailureCode::bad_argument);
    CHECK(std::string(range.what()) == "body.move: speed: 11 is out of range, allowed 0 to 10 m/s");
    CHECK(range.field == "speed");
    CHECK(range.allowed == "0 to 10 m/s");
    CHECK(std::string(failure_of({{"call", "body.move"}, {"name", "x"}, {"sped", 1}}).what()) ==
          "body.move: sped: unknown key, did you mean \"speed\"?");
    CHECK(std::string(failure_of({{"call", "body.move"}}).what()) ==
          "body.move: the key \"name\" is missing");
    CHECK(failure_of({{"call", "body.move"}, {"name", "x"}, {"speed", nullptr}}).field == "speed");
    CHECK(std::string(failure_of({{"call", "body.move"}, {"name", 4}}).what()) ==
          "body.move: name: is an integer, allowed a string");
}

TEST_CASE("an unknown call is refused with the names that there are", "[service]") {
    const Failure failure = failure_of({{"call", "body.mov"}});
    CHECK(failure.code == FailureCode::unknown_call);
    CHECK(std::string(failure.what()) == "no call \"body.mov\", did you mean \"body.move\"?");
    CHECK(failure.allowed == "body.move");
}

TEST_CASE("a call is described by its row", "[service]") {
    const json row = describe(table())[0];
    CHECK(row["name"] == "body.move");
    CHECK(row["permission"] == "scene");
    CHECK(row["fields"][0] == json{{"name", "speed"},
                                   {"type", "number"},
                                   {"unit", "m/s"},
                                   {"allowed", "0 to 10 m/s"},
                                   {"default", "2.0"},
                                   {"help", "Speed of the move"}});
    CHECK(row["fields"][2]["required"] == true);
    CHECK(row["fields"][3] == json{{"name", "keys"}, {"type", "map"}, {"help", "Keys of the body"}});
    CHECK(row["results"][0]["name"] == "text");
}

TEST_CASE("values go from heads to files and back", "[service]") {
    const json value{{"a", {1, 2.5, true, "x"}}, {"b", {{"c", -1}}}};
    CHECK(json_of(value_of(value, "v")) == value);
    CHECK_THROWS_AS(value_of({{"b", {{"c", nullptr}}}}, "v"), Failure);
}

} // namespace call_test
