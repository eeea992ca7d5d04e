// SPDX-License-Identifier: Apache-2.0
// "Did you mean" suggestions for misspelt names, by edit distance.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace obscura {

/// `did you mean "rate_hz"?`, or `allowed a, b, c` when no known word is close.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string_view>& known);

} // namespace obscura
