// SPDX-License-Identifier: Apache-2.0
// Numbers in text files, as programs in C, Fortran, MATLAB and spreadsheets write them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace obscura {

/// A finite decimal number that is all of `text`: "1.5", "+1.5", "-1.5e3", "1.5D+03". Independent of the
/// locale. Empty: it is none. Real-time safe.
[[nodiscard]] std::optional<double> decimal_number(std::string_view text) noexcept;
/// Whether all of `text` is a number that decimal_number() does not take because it is not finite: "nan",
/// "inf", "1e400". For messages.
[[nodiscard]] bool is_number_not_finite(std::string_view text) noexcept;
/// A whole number of 64 bits that is all of `text`, with or without a sign.
[[nodiscard]] std::optional<std::int64_t> whole_number(std::string_view text) noexcept;

} // namespace obscura
