// SPDX-License-Identifier: Apache-2.0
// Sections: reading with all mistakes collected, printing, documenting.
#include "config/section.hpp"
#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <sys/stat.h>

#include <filesystem>
#include <string>
#include <vector>

namespace section_test {

using namespace obscura;
using config::key;

namespace {

enum class Fruit : std::uint8_t { apple, pear };
constexpr auto enum_names(Fruit /*type*/) {
    return std::array{EnumName{Fruit::apple, "apple"}, EnumName{Fruit::pear, "pear"}};
}

struct Bowl {
    std::int32_t count = 3;
    Fruit fruit = Fruit::apple;
};
struct Basket {
    double weight_kg = 2;
    std::string label = "A";
    Bowl bowl;
    std::vector<Bowl> spare;
};

config::Section bowl_section(Bowl& bowl) {
    config::Section section;
    section.help = "A bowl.";
    section.keys = {key("count", &bowl.count).range(0, 9).required().help("Pieces of fruit in the bowl"),
                    key("fruit", &bowl.fruit).help("Kind of fruit")};
    section.check = [&bowl](const config::ReadTable& table) {
        if (bowl.fruit == Fruit::pear && bowl.count > 5) table.refuse("count", "too many pears");
    };
    return section;
}

config::Section section_of(Basket& basket) {
    config::Section inner;
    inner.name = "bowl";
    inner.keys = {key("fruit", &basket.bowl.fruit).reloadable().help("Kind of fruit")};
    config::Section section;
    section.name = "basket";
    section.keys = {key("weight_kg", &basket.weight_kg).unit("kg").range(0, 50).help("Weight of the basket"),
                    key("label", &basket.label).help("Label of the basket")};
    section.tables = {std::move(inner)};
    section.lists = {config::list("spare", "Further bowls.", basket.spare, bowl_section)};
    return section;
}

std::string mistakes_of(const std::string& text, Basket& basket) {
    const config::Value root = config::parse_text(text, "b.toml");
    config::Mistakes mistakes;
    config::read_member(root, {"b.toml", ""}, section_of(basket), mistakes);
    try {
        mistakes.throw_if_any();
    } catch (const ConfigError& error) {
        return error.what();
    }
    return {};
}

} // namespace

TEST_CASE("a section reads its keys, tables and lists", "[config]") {
    Basket basket;
    CHECK(
        mistakes_of(
            "[basket]\nweight_kg = 3\nbowl.fruit = \"pear\"\n[[basket.spare]]\ncount = 1\n[[basket.spare]]\n"
            "count = 5\nfruit = \"pear\"\n",
            basket) == "");
    CHECK(basket.weight_kg == 3);
    CHECK(basket.label == "A");
    CHECK(basket.bowl.fruit == Fruit::pear);
    REQUIRE(basket.spare.size() == 2);
    CHECK(basket.spare[0].fruit == Fruit::apple);
    CHECK(basket.spare[1].count == 5);
}

TEST_CASE("all mistakes of a file are reported, a line each", "[config]") {
    Basket basket;
    CHECK(
        mistakes_of(
            "[basket]\nweight_kg = 99\nlabal = \"x\"\nbowl = { fruit = \"plum\" }\n[[basket.spare]]\nfruit = "
            "\"pear\"\n[[basket.spare]]\ncount = 7\nfruit = \"pear\"\n",
            basket) == "b.toml:2:13: basket.weight_kg: 99 is out of range, allowed 0 to 50 kg\n"
                       "b.toml:3:1: basket.labal: unknown key, did you mean \"label\"?\n"
                       "b.toml:4:18: basket.bowl.fruit: \"plum\" is not known, allowed apple, pear\n"
                       "b.toml:5:1: basket.spare[0]: the key \"count\" is missing\n"
                       "b.toml:8:9: basket.spare[1].count: too many pears");
    CHECK(basket.weight_kg == 2); // what cannot be read leaves the default alone
    CHECK(mistakes_of("basket = 1\n", basket) == "b.toml:1:10: basket: is an integer, allowed a table");
    CHECK(mistakes_of("[basket]\nspare = 3\n", basket) ==
          "b.toml:2:1: basket.spare: allowed tables [[basket.spare]]");
}

TEST_CASE("mistakes that were thrown on the way are reported once, a line each", "[config]") {
    config::Mistakes mistakes;
    mistakes.add("a");
    mistakes.add("b");
    CHECK_FALSE(mistakes.collect([&] { mistakes.throw_if_any(); }));
    CHECK_FALSE(mistakes.collect([] { throw ConfigError("b\nc"); }));
    CHECK(mistakes.count() == 3);
    try {
        mistakes.throw_if_any();
        FAIL("nothing was thrown");
    } catch (const ConfigError& error) {
        CHECK(std::string(error.what()) == "a\nb\nc");
    }
}

TEST_CASE("a printed section reads back as it was", "[config]") {
    Basket basket{7, "B", {}, {{1, Fruit::pear}, {2, Fruit::apple}}};
    const std::string text = config::print_section(section_of(basket), "");
    CHECK(text == "\n[basket]\n# Weight of the basket (0 to 50 kg)\nweight_kg = 7.0\n# Label of the "
                  "basket\nlabel = \"B\"\n"
                  "\n[[basket.spare]]\n# Pieces of fruit in the bowl (0 to 9)\ncount = 1\n# Kind of fruit "
                  "(apple | pear)\n"
                  "fruit = \"pear\"\n"
                  "\n[[basket.spare]]\n# Pieces of fruit in the bowl (0 to 9)\ncount = 2\n# Kind of fruit "
                  "(apple | pear)\n"
                  "fruit = \"apple\"\n"
                  "\n[basket.bowl]\n# Kind of fruit (apple | pear)\nfruit = \"apple\"\n");
    Basket again;
    CHECK(mistakes_of(text, again) == "");
    CHECK(config::print_section(section_of(again), "") == text);
}

TEST_CASE("tables that a configuration does not have are printed as comments", "[config]") {
    Basket basket;
    config::Section section = section_of(basket);
    section.tables.front().printed = false;
    section.tables.push_back(section.tables.front());
    section.tables.back().name = "saucer";
    const std::string text = config::print_section(section, "");
    CHECK(text == "\n[basket]\n# Weight of the basket (0 to 50 kg)\nweight_kg = 2.0\n# Label of the "
                  "basket\nlabel = \"A\"\n"
                  "\n# Absent. Further bowls.\n# [[basket.spare]]\n# # Pieces of fruit in the bowl (0 to 9)\n"
                  "# count = 3\n# # Kind of fruit (apple | pear)\n# fruit = \"apple\"\n"
                  "\n# Absent. \n# [basket.bowl]\n# # Kind of fruit (apple | pear)\n# fruit = \"apple\"\n"
                  "\n# Absent; has the same keys: [basket.saucer]\n");
    // Without "# " the lines of a block are TOML.
    std::string block = text.substr(text.find("# [[basket.spare]]"));
    block.erase(block.find("\n# Absent"));
    for (std::size_t at = 0; (at = block.find("# ", at)) != std::string::npos; at = block.find('\n', at))
        block.erase(at, 2);
    Basket again;
    CHECK(mistakes_of(block, again) == "");
    CHECK(again.spare.size() == 1);
}

TEST_CASE("a table for later checks names its keys at their positions", "[config]") {
    const config::Value root = config::parse_text("[basket]\nlabel = \"B\"\n", "b.toml");
    config::Mistakes mistakes;
    const config::Where where{"b.toml", ""};
    const config::ReadTable table = config::table_for_checks(root, where, "basket", mistakes);
    CHECK(table.position_text() == "b.toml:1:2");
    table.refuse("label", "taken");
    table.refuse("weight_kg", "too light");
    const config::ReadTable absent = config::table_for_checks(root, where, "bowl", mistakes);
    CHECK(absent.position_text() == "b.toml");
    absent.refuse("count", "empty");
    CHECK_THROWS_WITH(mistakes.throw_if_any(), "b.toml:2:9: basket.label: taken\n"
                                               "b.toml:1:2: basket.weight_kg: too light\n"
                                               "b.toml: bowl.count: empty");
}

TEST_CASE("the reference has every table and list with its defaults", "[config]") {
    Basket basket;
    const std::vector<config::DocumentedTable> tables = config::document(section_of(basket), "");
    REQUIRE(tables.size() == 3);
    CHECK(tables[0].heading == "[basket]");
    CHECK(tables[1].heading == "[basket.bowl]");
    CHECK(tables[2].heading == "[[basket.spare]]");
    CHECK(tables[2].help == "Further bowls.");
    CHECK(config::value_text(tables[2].keys.at(0)) == "3");
    CHECK(config::type_text(tables[0].keys.at(0)) == "number");
}

TEST_CASE("reloadable keys are found by their dotted path", "[config]") {
    Basket basket;
    config::Section root;
    root.tables = {section_of(basket)};
    CHECK(config::is_reloadable(root, "basket.bowl.fruit"));
    CHECK_FALSE(config::is_reloadable(root, "basket.label"));
    CHECK_FALSE(config::is_reloadable(root, "basket.bowl.colour"));
    CHECK_FALSE(config::is_reloadable(root, "other.fruit"));
}

TEST_CASE("structs that a program filled are held to the ranges of their keys", "[config]") {
    Basket basket;
    CHECK(config::explain_out_of_range(section_of(basket).keys).empty());
    basket.weight_kg = -1;
    CHECK(config::explain_out_of_range(section_of(basket).keys) == "weight_kg: -1, allowed 0 to 50 kg");
    basket.weight_kg = std::numeric_limits<double>::quiet_NaN();
    CHECK(config::explain_out_of_range(section_of(basket).keys) == "weight_kg: nan, allowed 0 to 50 kg");
}

TEST_CASE("keys of many parts are refused before they nest tables as deep") {
    const auto refusal = [](const std::string& text) -> std::string {
        try {
            (void)config::parse_text(text, "b.toml");
        } catch (const ConfigError& error) {
            return error.what();
        }
        return {};
    };
    std::string dotted = "a";
    for (int i = 0; i < 200'000; ++i)
        dotted += ".a";
    const std::string refused = "not valid TOML: a key has more than 16 parts";
    CHECK(refusal(dotted + " = 1\n") == "b.toml:1:32: " + refused);
    CHECK(refusal("\n[" + dotted + "]\n") == "b.toml:2:33: " + refused);
    CHECK(refusal("x = {" + dotted + " = 1}\n") == "b.toml:1:37: " + refused);
    CHECK(refusal("s = \"\\\" # \"\n'q' . \"q\" . a.a.a.a.a.a.a.a.a.a.a.a.a.a.a = 1\n").find(refused) !=
          std::string::npos);
    CHECK(refusal("a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p = 1\n").empty());
    // Dots that are no key's.
    CHECK(refusal("# " + dotted + "\nl = 'x\\'\ns = \"" + dotted + " \\\" " + dotted + "\"\n").empty());
    CHECK(refusal("m = \"\"\"\n" + dotted + " \"\" \\\"\"\" " + dotted + "\"\"\"\"\"\nl = '''" + dotted +
                  "\n'''\'\n")
              .empty());
    std::string numbers = "1.5";
    for (int i = 0; i < 100; ++i)
        numbers += ", 1.5";
    CHECK(refusal("n = [" + numbers + "]\n[\"" + dotted + "\"]\nt = {a.b = 1.5, c.d = 2.5}\n").empty());
}

TEST_CASE("a pipe in place of a file is refused at once") {
    const test::TempFolder folder;
    const std::filesystem::path pipe = folder.path() / "pipe";
    REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
    std::string text;
    CHECK(config::read_text(pipe, text) == "not a regular file");
}

TEST_CASE("a printed key may stand as a table, also where values have their provenance") {
    std::string word, table;
    config::Section section;
    section.name = "chip";
    section.annotated = true;
    section.keys = {key("label", &word).or_table([&table] { return table; }).help("Label of the chip")};
    section.check = [&table](const config::ReadTable& read) {
        const config::Member* const member = read.table()->find("label");
        if (member != nullptr && member->value.find("model") != nullptr) table = "{ model = 1, value = 3 }";
    };
    const config::Value root = config::parse_text("[chip]\nlabel = { model = 1, value = 3 }\n", "chips");
    config::Mistakes mistakes;
    read_member(root, {"chips", ""}, section, mistakes);
    mistakes.throw_if_any();
    CHECK(word.empty());
    CHECK(print_section(section, "").find("\nlabel = { model = 1, value = 3 }\n") != std::string::npos);
    table.clear();
    CHECK(print_section(section, "").find("\nlabel = \"\"\n") != std::string::npos);
}

} // namespace section_test
