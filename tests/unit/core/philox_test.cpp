// SPDX-License-Identifier: Apache-2.0
#include "core/philox.hpp"
#include "tests/support/catch.hpp"

namespace philox_test {

using namespace obscura;

using Words = std::array<std::uint32_t, 4>;

// Random123, tests/kat_vectors: philox 4x32 10.
TEST_CASE("Philox 4x32-10 gives the published known answers") {
    CHECK(philox4x32({0, 0, 0, 0}, {0, 0}) == Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
    CHECK(philox4x32({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}) ==
          Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
    CHECK(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
          Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST_CASE("uniform numbers stay inside the open interval") {
    CHECK(uniform_float(0) > 0.0F);
    CHECK(uniform_float(0xffffffff) < 1.0F);
    CHECK(uniform_double(0) > 0.0);
    CHECK(uniform_double(0xffffffff) < 1.0);
}

} // namespace philox_test
