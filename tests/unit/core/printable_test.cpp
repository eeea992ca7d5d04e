// SPDX-License-Identifier: Apache-2.0
// Quoted text: what a terminal would obey is escaped, long text is cut between characters.
#include "core/text/printable.hpp"
#include "tests/support/catch.hpp"

#include <string>

namespace printable_test {

using namespace obscura;

TEST_CASE("control characters and bytes that are no UTF-8 are escaped") {
    CHECK(printable("plain, \xC3\xB6 and \xF0\x9F\x9B\xB0") == "plain, \xC3\xB6 and \xF0\x9F\x9B\xB0");
    CHECK(printable("\x1B]0;title\x07\x1B[31m") == "\\x1B]0;title\\x07\\x1B[31m");
    CHECK(printable("a\tb\r\nc\x7F") == "a b  c\\x7F");
    CHECK(printable("\xC2\x9B"
                    "31m") == "\\xC2\\x9B"
                              "31m"); // control sequence introducer of ISO 6429
    CHECK(printable("\xFF\xC3") == "\\xFF\\xC3");
    CHECK(printable(std::string_view("a\0b", 3)) == "a\\x00b");
}

TEST_CASE("long text is cut behind a whole character") {
    CHECK(printable("12345", 5) == "12345");
    CHECK(printable("123456", 5) == "12345...");
    CHECK(printable("1234\xC3\xB6", 5) == "1234...");
}

TEST_CASE("a message keeps its lines, each of limited length") {
    CHECK(for_terminal("one\ntwo\x1B\n") == "one\ntwo\\x1B\n");
    const std::string text = for_terminal(std::string(5000, 'x') + "\nend");
    CHECK(text == std::string(max_message_bytes, 'x') + "...\nend");
}

} // namespace printable_test
