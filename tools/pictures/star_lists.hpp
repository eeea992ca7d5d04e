// SPDX-License-Identifier: Apache-2.0
// Lists of stars with image or sky positions and brightnesses: reading, matching, rms and zero point.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Star of a list.
struct ListedStar {
    double x = 0, y = 0;       ///< px; or right ascension and declination, rad
    std::optional<double> mag; ///< magnitude, or -2.5 log10 of a flux
    std::size_t line = 0;      ///< of the file
};

/// Stars of a CSV table with the columns x_px, y_px (or x, y), or ra_deg, dec_deg.
struct StarList {
    bool on_sky = false;    ///< right ascension and declination
    std::string brightness; ///< column of the magnitude or flux; empty: none
    std::vector<ListedStar> stars;
};

/// Which rows and columns of a list are read.
struct StarListChoice {
    std::string brightness;        ///< column; empty: the first of those that are known
    std::vector<std::string> rows; ///< COLUMN=VALUE: only such rows, if the table has the column
};

/// Whether the file is a table with such columns; false if it cannot be read.
[[nodiscard]] bool is_star_list(const std::filesystem::path& file);
/// Throws InputError `file:line: what is wrong`. A column whose name begins with "mag" or ends with "mag",
/// "V" or "magnitude_v" has magnitudes; any other one has fluxes, of which those not above 0 count as
/// unknown.
[[nodiscard]] StarList read_star_list(const std::filesystem::path& file, const StarListChoice& choice);

/// Two stars taken for the same.
struct StarPair {
    std::size_t reference, star;      ///< indices in their lists
    double right = 0, down = 0;       ///< from the reference, px; on the sky east and north, arc seconds
    std::optional<double> mag_offset; ///< magnitude of the star less that of the reference
};

/// Agreement of two lists.
struct StarAgreement {
    std::vector<StarPair> pairs;            ///< in the order of the reference
    double shift_right = 0, shift_down = 0; ///< mean
    double rms = 0;                         ///< of the distances
    double rms_shifted = 0;                 ///< of the distances after the mean shift
    double largest = 0;                     ///< distance
    std::size_t with_mag = 0;               ///< pairs with two magnitudes
    double zero_point = 0;                  ///< mean of their offsets, mag
    double zero_point_rms = 0;              ///< of their offsets about it
};

/// Matches the lists: the nearest pairs first, each star once, not farther apart than `radius` (px or arc
/// seconds). Throws InputError if one list is on the sky and the other is not.
[[nodiscard]] StarAgreement compare_star_lists(const StarList& reference, const StarList& list,
                                               double radius);

} // namespace obscura::tools
