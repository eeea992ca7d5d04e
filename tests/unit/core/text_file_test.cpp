// SPDX-License-Identifier: Apache-2.0
// Texts from other systems, and numbers as other programs write them.
#include "core/io/text_file.hpp"
#include "core/text/number.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <clocale>
#include <cmath>
#include <cstdlib>

namespace text_file_test {

using namespace obscura;
using Catch::Matchers::ContainsSubstring;

namespace {

/// The text made plain, or why it cannot be.
std::string plain(std::string text) {
    const std::string why = make_plain_text(text);
    return why.empty() ? text : "refused: " + why;
}

} // namespace

TEST_CASE("A text of any system has the same lines") {
    const std::string lines = "a\n\nb\n";
    CHECK(plain("a\n\nb\n") == lines);
    CHECK(plain("a\r\n\r\nb\r\n") == lines);
    CHECK(plain("a\r\rb\r") == lines);
    CHECK(plain("\xEF\xBB\xBF"
                "a\n\nb\n") == lines);
    CHECK(plain(lines + std::string(3, '\0')) == lines);
    CHECK(plain(lines + "\x1A") == lines);
    CHECK(plain("") == "");
    CHECK(plain("\xEF\xBB\xBF") == "");
    CHECK_THAT(plain(std::string("a\0b", 3)), ContainsSubstring("zero byte at 1"));
    CHECK_THAT(plain(std::string("\xFF\xFE"
                                 "a\0",
                                 4)),
               ContainsSubstring("UTF-16"));
    CHECK_THAT(plain(std::string("\xFE\xFF\0a", 4)), ContainsSubstring("UTF-16"));
}

TEST_CASE("A text file is read whole, or refused with the reason") {
    const test::TempFolder folder;
    std::string text;
    CHECK(read_plain_text(folder.write("a.csv", "\xEF\xBB\xBF"
                                                "1\r\n2"),
                          100, text)
              .empty());
    CHECK(text == "1\n2");
    CHECK_THAT(read_plain_text(folder.path() / "none", 100, text), ContainsSubstring("No such file"));
    CHECK(read_plain_text(folder.path(), 100, text) == "not a regular file");
    CHECK(read_plain_text(folder.write("big", std::string(11, 'x')), 10, text) == "larger than 10 bytes");
}

TEST_CASE("Numbers of C, Fortran and spreadsheets agree with strtod") {
    for (const char* const word : {"1", "+1", "-1", "+100.0", "-0.5", ".5", "+.5", "5.", "1e3", "+1.5E-3",
                                   "-2e+07", "0", "-0", "1e-320", "123456789012345678901234567890"}) {
        CAPTURE(word);
        const auto value = decimal_number(word);
        REQUIRE(value.has_value());
        CHECK(*value == std::strtod(word, nullptr));
    }
    CHECK(decimal_number("1.5D+03") == 1500);
    CHECK(decimal_number("-1.5d-3") == -1.5e-3);
    CHECK(decimal_number("1e-400") == 0);
    for (const char* const word :
         {"",    "+",  "-",  "++1",  "+-1", "--1", "D3",    "1D",    "1e",    "1,5",
          "1;2", " 1", "1 ", "0x10", "inf", "nan", "1e400", "1.2.3", "1D3D4", "one"}) {
        CAPTURE(word);
        CHECK_FALSE(decimal_number(word).has_value());
    }
    for (const char* const word : {"nan", "inf", "-inf", "1e400", "-1e999"})
        CHECK(is_number_not_finite(word));
    for (const char* const word : {"1", "x", "1e-400x", "", "infinit"})
        CHECK_FALSE(is_number_not_finite(word));
    CHECK(whole_number("+12") == 12);
    CHECK(whole_number("-12") == -12);
    for (const char* const word : {"", "+", "+-1", "1.0", "1e3", "9223372036854775808", "12 "})
        CHECK_FALSE(whole_number(word).has_value());
}

} // namespace text_file_test
