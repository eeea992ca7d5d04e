// SPDX-License-Identifier: Apache-2.0
// Verb `obscura import stars`: star catalogue file from catalogues in other layouts.
#include "core/error.hpp"
#include "core/spectral_band.hpp"
#include "core/text/printable.hpp"
#include "ephemeris/stars/star_file.hpp"
#include "host/interrupt.hpp"
#include "images/writers/raw.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "tools/check/report.hpp"
#include "tools/import/stars/star_import.hpp"
#include "tools/scene/progress.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

namespace obscura::tools {
namespace {

class ImportStars final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "makes a star catalogue file from catalogues of stars";
        line.description =
            "Reads catalogues of stars and writes one compact file, sorted by parts of the sky, for the key catalogue of a scene's table [stars]. "
            "Of several catalogues the first that has a star is taken: stars of a later one within 2 arc seconds and 1.5 mag of an earlier star are left out. "
            "Layouts: csv (heading ra_deg,dec_deg,v_mag,b_v,spectral_type, or an extract of Gaia's archive with ra, dec, pmra, pmdec, parallax, phot_g_mean_mag, bp_rp), hipparcos (hip_main.dat), tycho2 (catalog.dat), kstars (stars.dat), kstars-binary (namedstars.dat, unnamedstars.dat, deepstars.dat), map (a count, then x y z e0 e1 e2 e3 in W/m2), astrometry-index (index files of astrometry.net made from Tycho-2: positions and VT). "
            "Text may be compressed by gzip. "
            "Positions are brought to J2000.0 and magnitudes to Johnson's V and B-V. "
            "A star whose spectral type has no luminosity class gets that of its absolute magnitude, where its parallax is at least 5 standard deviations (1 mas each where the catalogue gives none). "
            "A row without position or magnitude, or with a number that is not possible, is reported and left out.";
        line.positional("FILE", &files_, "Catalogues to read, the best first");
        line.option("-o,--output", &output_, "FILE", "Star catalogue file to write").required = true;
        const std::vector<std::string_view> formats = names_of_enum<StarFormat>();
        line.option("--format", &format_, "LAYOUT", "Layout of all FILEs; auto: by the content of each")
            .choices.assign(formats.begin(), formats.end());
        line.number("--limiting-magnitude", &settings_.limiting_v, "V", "Leave out stars fainter than this",
                    -30, 40);
        line.number("--map-channel", &settings_.map.channel, "N",
                    "For maps: channel e0 to e3 that gives the magnitude; -1: the mean of the first three",
                    -1, 3);
        line.number("--map-zero", &settings_.map.zero_w_m2, "W_M2",
                    "For maps: irradiance of a star of V = 0 in that channel; 0: Vega's from 400 to 700 nm",
                    0, 1);
        line.option("--source", &source_, "TEXT",
                    "What the stars are from, for the file's header (default: names of the catalogues)");
        line.flag("--strict", strict_, "Exit with status 66 if a row is refused, and write nothing");
        line.flag("--json", json_, "Print one JSON object instead of a table");
        line.examples = {
            "obscura import stars /usr/share/kstars/stars.dat -o v9.obstars",
            "obscura import stars hip_main.dat tycho2/catalog.dat -o tycho.obstars --limiting-magnitude 11",
            "obscura import stars /usr/share/kstars/stars.dat \\",
            "    /usr/share/astrometry/index-tycho2-07.littleendian.fits -o v11.obstars",
        };
    }

    int run() override {
        settings_.format = enum_named<StarFormat>(format_).value_or(StarFormat::automatic);
        if (settings_.map.zero_w_m2 == 0) {
            scene::Star vega;
            vega.colour_b_v = 0;
            settings_.map.zero_w_m2 = renderer::star_irradiance_w_m2(vega, SpectralBand{400e-9, 700e-9});
        }
        std::vector<ephemeris::CatalogueStar> stars;
        std::uint64_t refused = 0;
        std::string names;
        for (std::size_t i = 0; i < files_.size(); ++i) {
            const std::filesystem::path file(files_[i]);
            StarSink sink(file.string(), settings_.limiting_v,
                          [](const std::string& line) { print_message(line); });
            StarFormat format{};
            {
                constexpr std::uint64_t steps = 1000;
                Progress progress("import stars: " + file.filename().string(), steps);
                format = read_stars(file, settings_, sink, [&](double part) {
                    if (host::interrupted()) throw Error(exit_failure, "obscura import stars: interrupted");
                    progress.done(static_cast<std::uint64_t>(part * steps));
                });
            }
            const std::uint64_t known = merge_stars(stars, sink.stars);
            std::uint64_t bad = 0;
            for (const auto& [cause, count] : sink.refused)
                bad += count;
            refused += bad;
            names += (i == 0 ? "" : ", ") + file.filename().string();
            const std::string key = fmt::format("file{}_", i + 1);
            const std::string label = file.filename().string();
            report_.add(key + "name", label, name_of(format));
            report_.add(key + "stars", label + ", stars", static_cast<std::int64_t>(sink.stars.size()));
            report_.add(key + "known", label + ", of these known before", static_cast<std::int64_t>(known));
            report_.add(key + "too_faint", label + ", fainter than the limit",
                        static_cast<std::int64_t>(sink.too_faint));
            report_.add(key + "classes_from_parallax", label + ", luminosity classes from parallaxes",
                        static_cast<std::int64_t>(sink.classes_from_parallax));
            report_.add(key + "refused", label + ", rows refused", static_cast<std::int64_t>(bad));
        }
        if (stars.empty()) throw InputError(fmt::format("{}: no stars in it", fmt::join(files_, ", ")));
        if (strict_ && refused > 0)
            throw InputError(fmt::format("{}: {} rows are refused: nothing is written (--strict)",
                                         fmt::join(files_, ", "), refused));
        const double complete = likely_complete_v(stars);
        const auto bytes =
            ephemeris::star_file_bytes(stars, source_.empty() ? names : source_,
                                       std::isnan(complete) ? std::nullopt : std::optional(complete));
        images::write_text(output_, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        const ephemeris::StarFile written{std::filesystem::path(output_)};
        if (written.size() != stars.size() || !written.intact())
            throw OutputError(fmt::format("{}: what was written is not what was read back", output_));
        report_.add("output", "written", std::string_view(output_));
        report_.add("stars", "stars", static_cast<std::int64_t>(written.size()));
        report_.add("bytes", "bytes", static_cast<std::int64_t>(written.bytes()));
        report_.add("brightest_v", "brightest V", written.brightest_v(), "mag", 2);
        report_.add("faintest_v", "faintest V", written.faintest_v(), "mag", 2);
        report_.add("complete_v", "likely complete to V", written.complete_v(), "mag", 1);
        report_.print(json_);
        return exit_ok;
    }

private:
    std::vector<std::string> files_;
    std::string output_, source_, format_ = "auto";
    StarImportSettings settings_;
    bool strict_ = false, json_ = false;
    Report report_;
};

} // namespace

std::unique_ptr<Verb> make_import_stars() {
    return std::make_unique<ImportStars>();
}

} // namespace obscura::tools
