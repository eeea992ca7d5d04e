// SPDX-License-Identifier: Apache-2.0
#include "core/text/suggestion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace obscura {
namespace {

/// Edit distance of `a` and `b`: insertions, deletions, replacements, swaps of neighbours.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i)
        d[i][0] = i;
    std::iota(d[0].begin(), d[0].end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i)
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replaced});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
}

} // namespace

std::optional<std::string_view> closest_word(std::string_view word,
                                             const std::vector<std::string_view>& known) {
    if (word.size() > 64) word = word.substr(0, 64);
    std::string_view best;
    std::size_t best_score = 1000;
    for (const std::string_view candidate : known) {
        std::size_t score = edit_distance(word, candidate);
        // "rate" for "rate_hz": the unit is missing.
        if (word.size() >= 3 && candidate.substr(0, word.size() + 1) == std::string(word) + "_") score = 1;
        if (score < best_score) best = candidate, best_score = score;
    }
    // Each letter is one edit from each other letter: a name of one letter is never a misspelt one.
    const std::size_t max_score = word.size() < 2 ? 0 : std::max<std::size_t>(1, word.size() / 3);
    if (best_score > max_score) return std::nullopt;
    return best;
}

std::string suggestion(std::string_view word, const std::vector<std::string_view>& known) {
    if (const auto best = closest_word(word, known)) return fmt::format("did you mean \"{}\"?", *best);
    return fmt::format("allowed {}", known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", ")));
}

std::string did_you_mean(std::string_view word, const std::vector<std::string_view>& known) {
    const auto best = closest_word(word, known);
    return best ? fmt::format("; did you mean \"{}\"?", *best) : "";
}

std::string allowed_words(std::string_view word, const std::vector<std::string_view>& known) {
    return fmt::format("allowed {}{}", known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", ")),
                       did_you_mean(word, known));
}

} // namespace obscura
