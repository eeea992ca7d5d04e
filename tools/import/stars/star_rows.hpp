// SPDX-License-Identifier: Apache-2.0
// Rows of star catalogues in text form: one reader for each layout.
#pragma once

#include "ephemeris/stars/star.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace obscura::tools {

/// What became of one row.
struct StarRow {
    enum class Kind : std::uint8_t {
        star,
        skipped, ///< a comment, a heading or an empty line
        refused,
    };
    Kind kind = Kind::star;
    ephemeris::CatalogueStar star{};
    bool class_from_parallax = false; ///< star: its luminosity class is that of its absolute magnitude
    std::string_view cause{};         ///< refused: the same for all rows of that cause
    std::string detail{};             ///< refused: the value at fault

    [[nodiscard]] static StarRow skip() { return {Kind::skipped}; }
    [[nodiscard]] static StarRow refuse(std::string_view cause, std::string detail = {}) {
        return {Kind::refused, {}, false, cause, std::move(detail)};
    }
};

/// Reader of one layout. Thread-bound.
class StarRowReader {
public:
    virtual ~StarRowReader() = default;
    /// `number`: of the line, from 1.
    [[nodiscard]] virtual StarRow read(std::string_view line, std::uint64_t number) = 0;
};

/// Text star maps give irradiances: what makes magnitudes of them.
struct StarMapScale {
    int channel = -1;     ///< of e0 to e3; -1: the mean of the first three
    double zero_w_m2 = 0; ///< irradiance of V = 0
};

/// Table with a heading: that of shipped catalogues (ra_deg, dec_deg, v_mag, b_v, spectral_type) or an
/// extract of Gaia's archive (ra, dec, pmra, pmdec, parallax, phot_g_mean_mag, bp_rp), columns in any order.
[[nodiscard]] std::unique_ptr<StarRowReader> star_csv_rows();
/// hip_main.dat of ESA SP-1200 (1997), CDS I/239: fields between bars.
[[nodiscard]] std::unique_ptr<StarRowReader> hipparcos_rows();
/// catalog.dat of Tycho-2, CDS I/259: fields between bars.
[[nodiscard]] std::unique_ptr<StarRowReader> tycho2_rows();
/// stars.dat of kstars: fixed columns.
[[nodiscard]] std::unique_ptr<StarRowReader> kstars_rows();
/// Star map: a count, then "x y z e0 e1 e2 e3": J2000 unit vector and irradiances in W/m2.
[[nodiscard]] std::unique_ptr<StarRowReader> star_map_rows(const StarMapScale& scale);

/// The number in a field, without blanks around it; NaN for an empty one, "null", "nan" or what is no number.
[[nodiscard]] double star_number(std::string_view field);
/// Refuses a star with a number that is not finite or not possible; else returns it as a row. A star without
/// luminosity class gets that of luminosity_from_parallax(), which `parallax_error_mas` is for.
[[nodiscard]] StarRow checked(const ephemeris::CatalogueStar& star,
                              double parallax_error_mas = ephemeris::CatalogueStar::unknown);
/// Sets the place from degrees. False if they are not those of a place: NaN, or outside 0..360 and -90..90.
[[nodiscard]] bool set_place(double right_ascension_deg, double declination_deg,
                             ephemeris::CatalogueStar& star);
/// Moves a star whose place is that of the Julian year `year` to J2000.0.
void move_to_j2000(double year, ephemeris::CatalogueStar& star);
/// Sets the spectral type from its text, as far as it is one.
void set_type(std::string_view text, ephemeris::CatalogueStar& star);

/// Standard deviation of a parallax of kstars, of which it gives none, from the text of the spectral type.
/// Stars of V >= 8 have types without subclass ("K?") and Tycho's parallaxes: of those too far away to have
/// one that can be measured (types B, and K moving less than 10 mas/yr) 68 % are below 7 mas at V 8.0 to 8.3
/// and 11 mas at 8.6 to 9. The others have those of Hipparcos: NaN, see luminosity_from_parallax().
[[nodiscard]] double kstars_parallax_error_mas(std::string_view type);

/// Johnson V and B-V from Tycho's BT and VT: ESA SP-1200 (1997), vol. 1, eq. 1.3.20.
struct JohnsonColours {
    double v = ephemeris::CatalogueStar::unknown, b_v = ephemeris::CatalogueStar::unknown;
};
[[nodiscard]] JohnsonColours johnson_from_tycho(double bt, double vt);
/// From Gaia's G and BP-RP: Riello et al., A&A 649, A3 (2021), table C.2: V with a scatter of 0.03 mag; B-V
/// through BT-VT. Colours are clamped to the range of each relation.
[[nodiscard]] JohnsonColours johnson_from_gaia(double g, double bp_rp);

} // namespace obscura::tools
