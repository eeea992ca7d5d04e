// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/io/address_range.hpp"
#include "tests/support/catch.hpp"

namespace address_range_test {

using namespace obscura;

TEST_CASE("a list of addresses and ranges contains what lies in one of them", "[core]") {
    const auto ranges = parse_address_ranges(" 10.0.0.1,10.1.0.0/16 ,");
    CHECK(ranges.size() == 2);
    CHECK(any_contains(ranges, 0x0A000001));
    CHECK_FALSE(any_contains(ranges, 0x0A000002));
    CHECK(any_contains(ranges, 0x0A01FFFF));
    CHECK_FALSE(any_contains(ranges, 0x0A020000));
    CHECK_FALSE(any_contains({}, 0x7F000001));
    CHECK(any_contains(parse_address_ranges("192.168.7.9/0"), 0xFFFFFFFF));
    CHECK(any_contains(parse_address_ranges("192.168.7.4/31"), 0xC0A80705));
    CHECK_FALSE(any_contains(parse_address_ranges("192.168.7.4/31"), 0xC0A80706));
}

TEST_CASE("what is no address or range is refused", "[core]") {
    CHECK(parse_address_ranges("").empty());
    for (const char* const text :
         {"192.168.7", "192.168.7.0/33", "192.168.7.0/", "192.168.7.0/2x", "host", "::1"})
        CHECK_THROWS_AS(parse_address_range(text), ConfigError);
}

} // namespace address_range_test
