// SPDX-License-Identifier: Apache-2.0
// Readers of star catalogues: each layout, bad rows, merging, and Hipparcos against kstars where the data
// are.
#include "core/error.hpp"
#include "ephemeris/stars/luminosity_class.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/import/stars/star_import.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace star_import_test {

using namespace obscura;
using namespace obscura::tools;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double arc_second = degree / 3600;

struct Read {
    std::vector<ephemeris::CatalogueStar> stars;
    std::vector<std::string> reports;
    std::map<std::string, std::uint64_t, std::less<>> refused;
    StarFormat format{};
    std::uint64_t classes_from_parallax = 0;
};

Read read_file(const std::filesystem::path& file, const StarImportSettings& settings = {}) {
    Read read;
    StarSink sink(file.filename().string(), settings.limiting_v,
                  [&](const std::string& line) { read.reports.push_back(line); });
    read.format = read_stars(file, settings, sink, [](double) {});
    read.stars = sink.stars;
    read.refused = sink.refused;
    read.classes_from_parallax = sink.classes_from_parallax;
    return read;
}

Read read_text(std::string_view text, const StarImportSettings& settings = {}) {
    const test::TempFolder folder;
    return read_file(folder.write("stars.txt", text), settings);
}

/// Distance of a star from a place in degrees, in arc seconds.
double distance_as(const ephemeris::CatalogueStar& star, double ra_deg, double dec_deg) {
    return length(star.direction - ephemeris::direction_of(ra_deg * degree, dec_deg * degree)) / arc_second;
}

std::string little_endian(std::uint64_t value, int bytes) {
    std::string out;
    for (int i = 0; i < bytes; ++i, value >>= 8)
        out += static_cast<char>(value & 0xFF);
    return out;
}

} // namespace

TEST_CASE("kstars' text gives place, motion, parallax, magnitude, colour and type", "[stars]") {
    const Read read = read_text(
        "# Star catalog\n"
        "064508.92 -164258.0 -000546.0-001223.100379.2 -1.4400.01A0 1            , alp CMa, Sirius\n"
        "204125.91 +451649.2 +000001.6+000001.600001.0 01.2500.09A2 0            , alp Cyg, Deneb\n");
    CHECK(read.format == StarFormat::kstars);
    REQUIRE(read.stars.size() == 2);
    CHECK(distance_as(read.stars[0], 101.28716667, -16.71611111) < 0.01);
    CHECK(read.stars[0].motion_ra_mas_yr == -546.0);
    CHECK(read.stars[0].motion_dec_mas_yr == -1223.1);
    CHECK(read.stars[0].parallax_mas == 379.2);
    CHECK(read.stars[0].magnitude_v == -1.44);
    CHECK(read.stars[0].colour_b_v == 0.01);
    CHECK(read.stars[0].type_number == 2.0);
    CHECK(read.stars[0].id == 2); // its line
    CHECK(distance_as(read.stars[1], 310.35795833, 45.28033333) < 0.01);
}

TEST_CASE("Hipparcos is brought from J1991.25 to J2000", "[stars]") {
    // Barnard's star, HIP 87937, cut after the fields that are read. J2000 place: SIMBAD, 17 57 48.49803
    // +04 41 36.2072.
    std::string row = "H|       87937| |17 57 48.97|+04 40 05.8| 9.54| |H|269.45402305|+04.66828815| | "
                      "549.01| -797.84|10326.93|";
    for (int field = 14; field < 77; ++field)
        row += field == 37 ? " 1.570|" : field == 76 ? "sdM4        |" : "  |";
    const Read read = read_text(row + "S \n");
    CHECK(read.format == StarFormat::hipparcos);
    REQUIRE(read.stars.size() == 1);
    CHECK(distance_as(read.stars[0], 269.45207512, 4.69339089) < 0.05);
    CHECK(read.stars[0].colour_b_v == 1.57);
    CHECK(read.stars[0].parallax_mas == 549.01);
    CHECK(read.stars[0].ids == ephemeris::StarIds::hipparcos);
    CHECK(read.stars[0].id == 87937);
}

TEST_CASE("Tycho-2 gives V and B-V, also without a mean place or BT", "[stars]") {
    // The first rows of catalog.dat, CDS I/259, and two made from them.
    const std::string rest = "|12.146|0.158|999| |         |  2.31754222|  2.23186444|1.67|1.54| 88.0|100.8| "
                             "|-0.2\n";
    const Read read = read_text("0001 00008 1| |  2.31750494|  2.23184345|  -16.3|   -9.0| 68| 73| 1.7| "
                                "1.8|1958.89|1951.94| 4|1.0|1.0|"
                                "0.9|1.0|12.146|0.158" +
                                rest +
                                "0001 00013 1|X|            |            |       |       |   |   |    |    | "
                                "      |       |  |   |   |  "
                                " |   |      |     " +
                                rest + "0001 00017 1| |  nan|  2.23184345|  -16.3|   -9.0| 68\n" +
                                // 1e70 and 100000 are no numbers of a star.
                                "1e70 00013 1|X|            |            |       |       |   |   |    |    | "
                                "      |       |  |   |   |  "
                                " |   |      |     " +
                                rest +
                                "0001 100000 1|X|            |            |       |       |   |   |    |   "
                                " | "
                                "      |       |  |   |   |  "
                                " |   |      |     " +
                                rest);
    CHECK(read.format == StarFormat::tycho2);
    REQUIRE(read.stars.size() == 2);
    CHECK(distance_as(read.stars[0], 2.31750494, 2.23184345) < 1e-6);
    CHECK(read.stars[0].motion_ra_mas_yr == -16.3);
    CHECK_THAT(read.stars[0].magnitude_v, WithinAbs(12.146, 1e-12)); // BT = VT in this row
    CHECK(read.stars[0].id == ephemeris::tycho_id(1, 8, 1));
    CHECK(distance_as(read.stars[1], 2.31754222, 2.23186444) < 1e-6);
    CHECK(std::isnan(read.stars[1].colour_b_v));
    REQUIRE(read.reports.size() == 3);
    CHECK(read.reports[0] == "stars.txt:3: too few fields");
    CHECK(read.reports[1] == "stars.txt:4: TYC number not possible");
    CHECK(read.reports[2] == "stars.txt:5: TYC number not possible");
}

TEST_CASE("an extract of Gaia's archive gives V and B-V at J2000", "[stars]") {
    // A star as the Sun: BP-RP 0.82, G - V -0.15, B-V 0.65; and rows that are refused.
    const Read read =
        read_text("source_id,ra,dec,parallax,pmra,pmdec,phot_g_mean_mag,bp_rp,ref_epoch\n"
                  "4472832130942575872,269.4485,4.7394,546.98,-801.55,10362.4,8.19,2.83,2016.0\n"
                  "1,10,20,,,,9.85,0.82,2016\n"
                  "2,NaN,20,1,1,1,9,0.8,2016\n"
                  "3,400,20,1,1,1,9,0.8,2016\n"
                  "4,10,-90.5,1,1,1,9,0.8,2016\n"
                  "5,10,20,1,1,1,null,0.8,2016\n"
                  "6,10,20,1,1,99999,9,0.8,2016\n"
                  "7,10,20\n");
    CHECK(read.format == StarFormat::csv);
    REQUIRE(read.stars.size() == 2);
    // Barnard's star moved by 16 years of its motion; V 9.51 (SIMBAD).
    CHECK(read.stars[0].ids == ephemeris::StarIds::gaia);
    CHECK(read.stars[0].id == 4472832130942575872U);
    CHECK_THAT(distance_as(read.stars[0], 269.4485, 4.7394), WithinAbs(16 * 10.3935, 0.01));
    CHECK_THAT(read.stars[0].magnitude_v, WithinAbs(9.51, 0.1));
    CHECK_THAT(read.stars[1].magnitude_v, WithinAbs(10.0, 0.04));
    CHECK_THAT(read.stars[1].colour_b_v, WithinAbs(0.65, 0.06));
    CHECK(read.stars[1].parallax_mas == 0);
    const std::vector<std::string> reports{
        "stars.txt:4: no position, or one that is not possible: \"NaN\" \"20\"",
        "stars.txt:5: no position, or one that is not possible: \"400\" \"20\"",
        "stars.txt:6: no position, or one that is not possible: \"10\" \"-90.5\"",
        "stars.txt:7: no magnitude",
        "stars.txt:8: proper motion not possible: 1, 99999 mas/yr",
        "stars.txt:9: another number of fields than in the heading: 3 instead of 9",
    };
    CHECK(read.reports == reports);
}

TEST_CASE("a star map gives magnitudes by the irradiance of V = 0", "[stars]") {
    StarImportSettings settings;
    settings.map = {1, 3e-8};
    const Read read = read_text("3\n0.6 0 0.8 0 3e-10 0 0\n0 0 1 1 nan 1 1\n0 0 2 1 1 1 1\n", settings);
    CHECK(read.format == StarFormat::star_map);
    REQUIRE(read.stars.size() == 1);
    CHECK_THAT(read.stars[0].magnitude_v, WithinAbs(5, 1e-12));
    CHECK_THAT(read.stars[0].direction.z, WithinAbs(0.8, 1e-15));
    REQUIRE(read.reports.size() == 2);
    CHECK(read.reports[0] == "stars.txt:3: not seven finite numbers");
    CHECK(read.reports[1] == "stars.txt:4: direction is not a unit vector: length 2");
}

TEST_CASE("kstars' binary tables are read by their field list", "[stars]") {
    const auto field = [](std::string name, int bytes, std::uint64_t scale) {
        name.resize(10);
        return name + static_cast<char>(bytes) + '\x05' + little_endian(scale, 4);
    };
    std::string text = "KStars Star Data v1.0.";
    text.resize(124);
    text += "SK\x01" + little_endian(5, 2);
    // The layout of deepstars.dat.
    text += field("RA", 4, 1000000) + field("Dec", 4, 100000) + field("dRA", 2, 10) + field("B", 2, 1000) +
            field("V", 2, 1000);
    text += little_endian(1, 4) + little_endian(0, 12 - 4) + little_endian(2, 4) + little_endian(0, 5);
    const std::string record =
        little_endian(12500000, 4) + little_endian(static_cast<std::uint64_t>(-4500000), 4) +
        little_endian(static_cast<std::uint64_t>(-55), 2) + little_endian(11200, 2) + little_endian(10500, 2);
    const std::string bad = little_endian(25000000, 4) + record.substr(4);
    const test::TempFolder folder;
    const Read read = read_file(folder.write("deep.dat", text + record + bad));
    CHECK(read.format == StarFormat::kstars_binary);
    REQUIRE(read.stars.size() == 1);
    CHECK(distance_as(read.stars[0], 187.5, -45) < 1e-6);
    CHECK_THAT(read.stars[0].motion_ra_mas_yr, WithinAbs(-5.5, 1e-12));
    CHECK_THAT(read.stars[0].magnitude_v, WithinAbs(10.5, 1e-12));
    CHECK_THAT(read.stars[0].colour_b_v, WithinAbs(0.7, 1e-12));
    REQUIRE(read.reports.size() == 1);
    CHECK_THAT(read.reports[0], Contains("deep.dat:2: no position"));
    const std::string whole = text + record + bad;
    for (std::size_t size = 130; size < whole.size(); ++size)
        CHECK_THROWS_AS(read_file(folder.write("cut.dat", std::string_view(whole).substr(0, size))),
                        InputError);
}

TEST_CASE("a file that is no catalogue is refused by file and line", "[stars]") {
    CHECK_THROWS_WITH(read_text("# heading\nwhatever this is\n"), Contains("stars.txt:2: not recognised"));
    CHECK_THROWS_AS(read_text(""), InputError);
    CHECK_THROWS_AS(read_text(std::string(100000, 'x')), InputError);
    CHECK_THROWS_AS(read_file("/nonexistent/stars"), InputError);
}

TEST_CASE("stars that an earlier catalogue has are not added again", "[stars]") {
    const auto star = [](double ra_deg, double dec_deg, double v) {
        ephemeris::CatalogueStar made;
        made.direction = ephemeris::direction_of(ra_deg * degree, dec_deg * degree);
        made.magnitude_v = v;
        return made;
    };
    std::vector stars{star(10, 89.9999, 5), star(200, -30, 7)};
    const std::uint64_t known = merge_stars(stars, {star(10, 89.9999 + 1.5 / 3600, 5.5), // the same
                                                    star(200, -30, 9),                   // a companion
                                                    star(200 + 3 / 3600.0, -30, 7),      // 2.6" off
                                                    star(20, 0, 6)});
    CHECK(known == 1);
    CHECK(stars.size() == 5);
}

TEST_CASE("a parallax gives the luminosity class that a type lacks", "[stars]") {
    using enum ephemeris::Luminosity;
    const auto found = [](double type, double b_v, double v, double parallax_mas,
                          double error_mas = ephemeris::CatalogueStar::unknown) {
        ephemeris::CatalogueStar star;
        star.type_number = type;
        star.colour_b_v = b_v;
        star.magnitude_v = v;
        star.parallax_mas = parallax_mas;
        return luminosity_from_parallax(star, error_mas);
    };
    constexpr double none = ephemeris::CatalogueStar::unknown;
    // The Sun and K0III, M_V 4.83 and 0.7, at 10 pc and 50 pc, by the type and by B-V.
    CHECK(found(4.2, none, 4.83, 100) == dwarf);
    CHECK(found(none, 0.65, 8.32, 20) == dwarf);
    CHECK(found(5.0, none, 0.7, 100) == giant);
    CHECK(found(none, 1.0, 4.19, 20) == giant);
    // Canopus: A9II by spectrum, M_V -5.5 at 10.55 mas (van Leeuwen 2007).
    CHECK(found(3.0, 0.16, -0.62, 10.55) == supergiant);
    // Too small for its error, negative, zero; no type and no colour.
    CHECK(found(5.0, none, 8, 4.9) == unknown);
    CHECK(found(5.0, none, 8, 20, 4.1) == unknown);
    CHECK(found(5.0, none, 8, 20, 3.9) == dwarf);
    CHECK(found(5.0, none, 8, 0, 0) == unknown);
    CHECK(found(5.0, none, 8, -20, 1) == unknown);
    CHECK(found(none, none, 4, 100) == unknown);
}

TEST_CASE("readers take luminosity classes from parallaxes with the errors of the catalogue", "[stars]") {
    using enum ephemeris::Luminosity;
    // Barnard's star, M4V; Gaia's red clump and a parallax that is not significant.
    const Read gaia = read_text("source_id,ra,dec,parallax,parallax_error,pmra,pmdec,phot_g_mean_mag,bp_rp\n"
                                "1,269.4485,4.7394,546.98,0.04,0,0,8.19,2.83\n"
                                "2,10,20,2,0.02,0,0,9.3,1.2\n"
                                "3,20,20,2,0.5,0,0,9.3,1.2\n");
    REQUIRE(gaia.stars.size() == 3);
    CHECK(gaia.stars[0].luminosity == dwarf);
    CHECK(gaia.stars[1].luminosity == giant); // M_V 1
    CHECK(gaia.stars[2].luminosity == unknown);
    CHECK(gaia.classes_from_parallax == 2);
    // kstars: K? of V >= 8 have Tycho's parallaxes.
    const Read kstars = read_text("010000.00 +200000.0 +000000.0+000000.000040.0 08.6001.10K? 0\n"
                                  "020000.00 +200000.0 +000000.0+000000.000060.0 08.6001.10K? 0\n"
                                  "030000.00 +200000.0 +000000.0+000000.000040.0 07.6001.10K5 0\n");
    REQUIRE(kstars.stars.size() == 3);
    CHECK(kstars.stars[0].luminosity == unknown);
    CHECK(kstars.stars[1].luminosity == dwarf);
    CHECK(kstars.stars[2].luminosity == dwarf);
}

TEST_CASE("stars of kstars have the luminosity class of their published spectra", "[stars]") {
    using enum ephemeris::Luminosity;
    const auto kstars = test::data_file("stars/kstars_stars.dat.gz");
    if (!kstars) return;
    const Read read = read_file(*kstars);
    // Types: Bright Star Catalogue, 5th ed.; places in kstars.
    struct Known {
        const char* name;
        double ra_deg, dec_deg;
        ephemeris::Luminosity luminosity;
    };
    for (const auto& [name, ra_deg, dec_deg, luminosity] :
         std::initializer_list<Known>{{"tau Cet, G8V", 26.01704, -15.93747, dwarf},
                                      {"eps Eri, K2V", 53.23267, -9.45825, dwarf},
                                      {"sig Dra, K0V", 293.08996, 69.66117, dwarf},
                                      {"eps Ind, K5V", 330.84025, -56.78597, dwarf},
                                      {"omi2 Eri, K1V", 63.81800, -7.65286, dwarf},
                                      {"alp1 Cen, G2V", 219.90208, -60.83397, dwarf},
                                      {"Groombridge 1618, K7V", 152.84225, 49.45425, dwarf},
                                      {"Arcturus, K1III", 213.91529, 19.18242, giant},
                                      {"Aldebaran, K5III", 68.98017, 16.50928, giant},
                                      {"Pollux, K0III", 116.32896, 28.02619, giant},
                                      {"Hamal, K2III", 31.79338, 23.46242, giant},
                                      {"Menkent, K0III", 211.67058, -36.36994, giant},
                                      {"Gacrux, M4III", 187.79154, -57.11319, giant},
                                      {"eps Vir, G8III", 195.54417, 10.95917, giant},
                                      {"Betelgeuse, M1-2Ia-Iab", 88.79296, 7.40706, supergiant},
                                      {"Antares, M1.5Iab-b", 247.35192, -26.43200, supergiant}}) {
        const auto nearest = std::min_element(read.stars.begin(), read.stars.end(),
                                              [&, ra = ra_deg, dec = dec_deg](const auto& a, const auto& b) {
                                                  return distance_as(a, ra, dec) < distance_as(b, ra, dec);
                                              });
        INFO(name << ", V " << nearest->magnitude_v);
        CHECK(distance_as(*nearest, ra_deg, dec_deg) < 2);
        CHECK(nearest->luminosity == luminosity);
    }
    CAPTURE(read.classes_from_parallax);
    CHECK(read.classes_from_parallax > 20'000);
}

TEST_CASE("parallaxes give the classes of Hipparcos' spectral types from G5 on", "[stars]") {
    const auto hipparcos = test::data_file("stars/hip_main_v7.dat.gz");
    if (!hipparcos) return;
    // Types V and III as published, against M_V alone. The errors of parallax are the reader's; here 1 mas.
    for (const bool by_type : {true, false}) {
        std::size_t dwarfs = 0, right_dwarfs = 0, giants = 0, right_giants = 0;
        for (ephemeris::CatalogueStar star : read_file(*hipparcos).stars) {
            if (!(star.type_number >= 4.45) || star.parallax_mas < 5 || std::isnan(star.colour_b_v)) continue;
            const auto published = star.luminosity;
            if (!by_type) star.type_number = ephemeris::CatalogueStar::unknown;
            const bool right = luminosity_from_parallax(star) == published;
            if (published == ephemeris::Luminosity::dwarf) ++dwarfs, right_dwarfs += right ? 1 : 0;
            if (published == ephemeris::Luminosity::giant) ++giants, right_giants += right ? 1 : 0;
        }
        CAPTURE(by_type, dwarfs, right_dwarfs, giants, right_giants);
        CHECK(giants > 2000);
        CHECK(static_cast<double>(right_giants) > 0.99 * static_cast<double>(giants));
        // Subgiants (IV) count as dwarfs, which half of them are nearer to.
        CHECK(dwarfs > 200);
        CHECK(static_cast<double>(right_dwarfs) > 0.5 * static_cast<double>(dwarfs));
    }
}

TEST_CASE("Hipparcos and kstars agree on the stars of both", "[stars]") {
    const auto hipparcos = test::data_file("stars/hip_main_v7.dat.gz");
    const auto kstars = test::data_file("stars/kstars_stars.dat.gz");
    if (!hipparcos || !kstars) return;
    const Read a = read_file(*hipparcos);
    const Read b = read_file(*kstars);
    CHECK(a.stars.size() == 9928);
    CHECK(a.refused.size() == 1);
    CHECK(b.stars.size() == 125982);
    std::vector<std::pair<double, const ephemeris::CatalogueStar*>> by_z;
    for (const auto& star : b.stars)
        by_z.emplace_back(star.direction.z, &star);
    std::sort(by_z.begin(), by_z.end());
    // Fast stars would be off by 8.75 years of their motion, 1.75" and more, were the epochs mixed up.
    std::size_t fast = 0, near = 0, like = 0;
    for (const auto& star : a.stars) {
        if (std::hypot(star.motion_ra_mas_yr, star.motion_dec_mas_yr) < 200) continue;
        ++fast;
        const double reach = 0.5 * arc_second;
        for (auto at = std::lower_bound(
                 by_z.begin(), by_z.end(),
                 std::pair<double, const ephemeris::CatalogueStar*>(star.direction.z - reach, nullptr));
             at != by_z.end() && at->first < star.direction.z + reach; ++at)
            if (length(at->second->direction - star.direction) < reach) {
                ++near;
                if (std::abs(at->second->magnitude_v - star.magnitude_v) < 0.1) ++like;
                break;
            }
    }
    CAPTURE(fast, near, like);
    CHECK(fast > 500);
    CHECK(static_cast<double>(near) > 0.95 * static_cast<double>(fast));
    CHECK(static_cast<double>(like) > 0.95 * static_cast<double>(near));
}

} // namespace star_import_test
