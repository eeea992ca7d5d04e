// SPDX-License-Identifier: Apache-2.0
// The table of the published client's commands, and arguments as that client sends them.
#include "service/compatible/arguments.hpp"
#include "service/failure.hpp"
#include "tests/support/catch.hpp"

#include <limits>
#include <set>
#include <string>
#include <vector>

namespace arguments_test {

using namespace obscura::service;
using namespace obscura::service::compatible;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::Message;

namespace {

const Command& command(const char* name) {
    const Command* const found = find_command(name);
    REQUIRE(found != nullptr);
    return *found;
}

} // namespace

TEST_CASE("the table has the 154 commands of the client, each once and explained", "[service]") {
    std::set<std::string_view> names;
    for (const Command& row : commands()) {
        INFO(row.name);
        CHECK(names.insert(row.name).second);
        CHECK(row.help.ends_with('.'));
        CHECK((row.results.empty() || row.awaited == Awaited::yes));
        CHECK(find_command(row.name) == &row);
    }
    CHECK(names.size() == 154);
    CHECK(find_command("") == nullptr);
    CHECK(find_command("setobjectposition") == nullptr);
}

TEST_CASE("a row tells the arguments, and whether the client waits", "[service]") {
    CHECK(signature(command("setFocus")) == "setFocus(focus_plane_Z: number, pupil_radius: number)");
    CHECK(signature(command("syncDir")) == "syncDir(dirname: text, files: list, compressionLevel: integer, "
                                           "targets: list (may be left out)) -> files2update");
    CHECK(command("setPSF").awaited == Awaited::yes);
    CHECK(command("render").awaited == Awaited::no);
    CHECK(command("sendImageTo").awaited == Awaited::never);
    CHECK(command("close").awaited == Awaited::never);
}

TEST_CASE("whole numbers are taken of any type of number", "[service]") {
    for (const Value& value :
         {Value(std::int32_t{640}), Value(std::uint32_t{640}), Value(std::uint64_t{640}), Value(640.0)}) {
        const Fields message{{"width", value}, {"height", value}};
        CHECK(Arguments(command("setImageSize"), message).integer("width", 1, 1000) == 640);
    }
    const Fields message{{"fov_x", std::int32_t{40}}, {"fov_y", true}};
    const Arguments arguments(command("setCameraFOVDeg"), message);
    CHECK(arguments.number("fov_x") == 40);
    CHECK(arguments.number("fov_y") == 1);
}

TEST_CASE("a mistake names call, argument and what is allowed", "[service]") {
    const auto refused = [](const char* name, Fields message, const char* what) {
        CHECK_THROWS_MATCHES(Arguments(command(name), message), Failure, Message(what));
    };
    refused("setImageSize", {{"width", 640}}, "setImageSize: height: is missing, allowed a whole number");
    refused("setImageSize", {{"width", 640.5}, {"height", 480}},
            "setImageSize: width: is of another type, allowed a whole number");
    refused("setImageSize", {{"width", std::numeric_limits<double>::quiet_NaN()}, {"height", 480}},
            "setImageSize: width: is of another type, allowed a whole number");
    refused("exists", {{"object_name", 7}}, "exists: object_name: is of another type, allowed a string");
    refused("setObjectPosition", {{"object_name", "a"}, {"pos", List{1.0, "x", 2.0}}},
            "setObjectPosition: pos: is of another type, allowed a list of numbers");
    const Fields fov{{"fov_x", 190}, {"fov_y", std::numeric_limits<double>::infinity()}};
    const Arguments arguments(command("setCameraFOVDeg"), fov);
    CHECK_THROWS_MATCHES(arguments.number("fov_x", 0, 179), Failure,
                         Message("setCameraFOVDeg: fov_x: 190 is out of range, allowed 0 to 179"));
    CHECK_THROWS_AS(arguments.number("fov_y"), Failure);
    const Fields place{{"object_name", std::string("a\0b", 3)}, {"pos", List{1, 2}}};
    const Arguments placed(command("setObjectPosition"), place);
    CHECK_THROWS_MATCHES(placed.vector("pos", 3), Failure,
                         Message("setObjectPosition: pos: 2 numbers, allowed 3"));
    CHECK_THROWS_AS(placed.text("object_name"), Failure);
}

TEST_CASE("further arguments are left alone, and optional ones may be missing", "[service]") {
    const Fields message{
        {"", "syncDir"}, {"dirname", "d"}, {"files", List{}}, {"compressionLevel", 1}, {"x", 1}};
    const Arguments arguments(command("syncDir"), message);
    CHECK_FALSE(arguments.has("targets"));
    CHECK(arguments.text("dirname") == "d");
}

} // namespace arguments_test
