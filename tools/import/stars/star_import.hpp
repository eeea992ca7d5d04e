// SPDX-License-Identifier: Apache-2.0
// Import of stars: recognises the layouts of catalogues, reads them and merges them.
#pragma once

#include "core/text/enum_names.hpp"
#include "ephemeris/stars/star.hpp"
#include "tools/import/stars/star_rows.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Layout of a catalogue of stars.
enum class StarFormat : std::uint8_t {
    automatic, ///< by the content
    csv,
    hipparcos,
    tycho2,
    kstars,
    kstars_binary,
    star_map,
    astrometry_index,
};
constexpr auto enum_names(StarFormat /*type*/) {
    return std::array{EnumName{StarFormat::automatic, "auto"},
                      EnumName{StarFormat::csv, "csv"},
                      EnumName{StarFormat::hipparcos, "hipparcos"},
                      EnumName{StarFormat::tycho2, "tycho2"},
                      EnumName{StarFormat::kstars, "kstars"},
                      EnumName{StarFormat::kstars_binary, "kstars-binary"},
                      EnumName{StarFormat::star_map, "map"},
                      EnumName{StarFormat::astrometry_index, "astrometry-index"}};
}

/// Collector of the rows of one file.
class StarSink {
public:
    using Report = std::function<void(const std::string& line)>;

    /// `report` gets one line for each of the first refusals of every cause; `limiting_v`: fainter stars are
    /// left out.
    StarSink(std::string file, double limiting_v, Report report);

    /// Takes a row; `place`: number of its line or record, from 1.
    void take(const StarRow& row, std::uint64_t place);

    [[nodiscard]] const std::string& file() const { return file_; }

    std::vector<ephemeris::CatalogueStar> stars;
    std::uint64_t too_faint = 0;
    std::uint64_t classes_from_parallax = 0;                   ///< of `stars`, by luminosity_from_parallax()
    std::map<std::string, std::uint64_t, std::less<>> refused; ///< by their cause

private:
    std::string file_;
    double limiting_v_;
    Report report_;
};

/// What to read and how.
struct StarImportSettings {
    StarFormat format = StarFormat::automatic;
    double limiting_v = 40;
    StarMapScale map{};
};

/// Reads `file`, plain text or compressed by gzip. `progress(part)`: called with the part of the file that is
/// read, 0 to 1. Returns the layout. Throws InputError.
StarFormat read_stars(const std::filesystem::path& file, const StarImportSettings& settings, StarSink& sink,
                      const std::function<void(double)>& progress);

/// Readers of the binary layouts, of whole files. Throw InputError `file: byte N: what is wrong`.
void read_kstars_binary(const std::filesystem::path& file, StarSink& sink);
void read_astrometry_index(const std::filesystem::path& file, StarSink& sink);

/// Adds the stars of `more` that are not among `stars` already: within 2 arc seconds and 1.5 mag of one at
/// J2000.0. Returns how many were.
std::uint64_t merge_stars(std::vector<ephemeris::CatalogueStar>& stars,
                          const std::vector<ephemeris::CatalogueStar>& more);

/// Magnitude to which a catalogue is likely complete: the faint end of the last half-magnitude bin that holds
/// at least 1.2 times the stars of the bin before; the sky's counts grow by 1.5 to 1.8. NaN if the stars are
/// too few to say.
[[nodiscard]] double likely_complete_v(const std::vector<ephemeris::CatalogueStar>& stars);

} // namespace obscura::tools
