// SPDX-License-Identifier: Apache-2.0
// Response data elements of SCPI: strings and numbers.
#pragma once

#include <string>
#include <string_view>

namespace obscura::instrument {

/// The text in double quotes, those in it doubled; what is not printable ASCII is a question mark.
[[nodiscard]] std::string string_data(std::string_view text);

/// The shortest decimal number that reads as `value`; 9.91E37, the not-a-number of SCPI, if it is none.
[[nodiscard]] std::string number_text(double value);

} // namespace obscura::instrument
