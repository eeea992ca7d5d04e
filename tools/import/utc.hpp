// UTC as spacecraft headers give it, and the dynamical time that rotation models use.
#pragma once

#include <optional>
#include <string_view>

namespace obscura::tools {

/// Days from J2000 (2000-01-01T12:00:00 TDB) to `utc` ("2001-02-08T17:24:42.25", from 1972 on, leap seconds
/// up to 2017), in TDB taken as TT: right to 2 ms. Nothing when the text is not such a time.
[[nodiscard]] std::optional<double> tdb_days_from_j2000(std::string_view utc);

} // namespace obscura::tools
