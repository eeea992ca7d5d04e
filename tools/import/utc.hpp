// SPDX-License-Identifier: Apache-2.0
// Conversion of UTC text to TDB days from J2000, the time argument of IAU rotation models.
#pragma once

#include <optional>
#include <string_view>

namespace obscura::tools {

/// Days from J2000 (2000-01-01T12:00:00 TDB) to `utc` ("2001-02-08T17:24:42.25", from 1972 on, leap seconds
/// up to 2017). TDB is approximated by TT: the error is below 2 ms. Returns nullopt for any other text.
[[nodiscard]] std::optional<double> tdb_days_from_j2000(std::string_view utc);

} // namespace obscura::tools
