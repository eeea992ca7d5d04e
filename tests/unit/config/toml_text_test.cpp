// SPDX-License-Identifier: Apache-2.0
// Written TOML reads back to the same tree.
#include "config/toml_text.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <string>

namespace toml_text_test {

using namespace obscura::config;

namespace {

bool same(const Value& a, const Value& b) {
    if (a.kind != b.kind || a.items.size() != b.items.size() || a.members.size() != b.members.size())
        return false;
    for (std::size_t i = 0; i < a.items.size(); ++i)
        if (!same(a.items[i], b.items[i])) return false;
    // Members may change places: tables stand behind the keys beside them.
    for (const Member& member : a.members)
        if (b.find(member.key) == nullptr || !same(member.value, b.find(member.key)->value)) return false;
    switch (a.kind) {
    case Value::Kind::boolean:
        return a.boolean == b.boolean;
    case Value::Kind::integer:
        return a.integer == b.integer;
    case Value::Kind::real:
        return a.real == b.real && std::signbit(a.real) == std::signbit(b.real);
    case Value::Kind::string:
        return a.string == b.string;
    default:
        return true;
    }
}

} // namespace

TEST_CASE("a tree that is written and read is the same tree", "[config]") {
    const Value tree = parse_text(R"(
name = "quotes \" and \\, a line\nand \u00fc"
"odd key" = 1
empty = []
mixed = [1, 2.0, "x", true, [[1e-300, -0.0], []], { a = 1, b = [ { c = 2 } ] }]
numbers = [149597870700.123, 1e22, 5e-324, 0.1, -9223372036854775808, inf]
[sun]
direction = [-1.0, 0, 0.5]
[sun.inner]
x = 1
[[body]]
name = "a"
faces = [[[0, 0, 1], [0, 1, 0]]]
[body.height]
file = "x"
[[body.albedo]]
file = "y"
[[body.albedo]]
file = "z"
[[body]]
[[body]]
name = "b"
[empty_table]
)",
                                  "test");
    const std::string text = toml_text(tree);
    INFO(text);
    CHECK(same(parse_text(text, "written"), tree));
    CHECK(toml_text(parse_text(text, "written")) == text);
}

TEST_CASE("a number is written with the digits that it needs", "[config]") {
    CHECK(number_text(0.1) == "0.1");
    CHECK(number_text(3) == "3.0");
    CHECK(number_text(1e22) == "1e+22");
}

} // namespace toml_text_test
