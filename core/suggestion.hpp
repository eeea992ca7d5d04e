// "Did you mean": the likeliest of some known words for one that is not known.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace obscura {

/// `did you mean "rate_hz"?`, or `allowed a, b, c` when nothing is near.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string_view>& known);

} // namespace obscura
