// SPDX-License-Identifier: Apache-2.0
// Catch2 2 (Debian 12) and 3 (Debian 13) behind one include. Use Catch::Matchers (WithinAbs, WithinRel), not
// Approx.
#pragma once

#if __has_include(<catch2/catch_test_macros.hpp>)
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/generators/catch_generators_range.hpp>
#include <catch2/matchers/catch_matchers.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#else
#include <catch2/catch.hpp>
// The name that Catch2 3 gives it.
namespace Catch::Matchers {
inline StdString::ContainsMatcher ContainsSubstring(const std::string& part) {
    return Contains(part);
}
} // namespace Catch::Matchers
#endif
