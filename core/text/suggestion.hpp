// SPDX-License-Identifier: Apache-2.0
// "Did you mean" suggestions for misspelt names, by edit distance.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura {

/// The known word that `word` is most likely to mean; nothing when none is close. It points into `known`.
[[nodiscard]] std::optional<std::string_view> closest_word(std::string_view word,
                                                           const std::vector<std::string_view>& known);

/// `did you mean "rate_hz"?`, or `allowed a, b, c` when no known word is close.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string_view>& known);

/// `; did you mean "rate_hz"?`, or nothing when no known word is close: for the end of a message.
[[nodiscard]] std::string did_you_mean(std::string_view word, const std::vector<std::string_view>& known);

/// `allowed a, b, c`, with `; did you mean "b"?` when a known word is close: for words from a list that
/// people want to see whole.
[[nodiscard]] std::string allowed_words(std::string_view word, const std::vector<std::string_view>& known);

} // namespace obscura
