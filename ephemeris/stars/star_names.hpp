// SPDX-License-Identifier: Apache-2.0
// Names of bright stars by position.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace obscura::ephemeris {

/// Names of a star; empty: it has none.
struct StarName {
    std::string designation; ///< Bayer or Flamsteed: "alp CMa"
    std::string proper;      ///< "Sirius"

    /// The proper name, else the designation.
    [[nodiscard]] const std::string& shortest() const { return proper.empty() ? designation : proper; }
};

/// Names of the stars of the shipped table config/star-names/bright.csv. Immutable; thread-safe.
class StarNames {
public:
    /// Without the table, as in a program that is not installed whole, no star has a name. Throws ConfigError
    /// if the table is damaged.
    StarNames();

    /// The star within 36 arc seconds of a J2000 position.
    [[nodiscard]] StarName at(double right_ascension_rad, double declination_rad) const;

private:
    struct Entry {
        double declination_deg = 0, right_ascension_deg = 0;
        StarName name;
    };
    std::vector<Entry> entries_; ///< by declination
};

} // namespace obscura::ephemeris
