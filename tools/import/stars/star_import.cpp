// SPDX-License-Identifier: Apache-2.0
#include "tools/import/stars/star_import.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "ephemeris/stars/sky_cells.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::uint64_t reported_of_a_cause = 3;
constexpr std::size_t max_catalogue_line_bytes = 65536;

/// Lines of a text file, compressed by gzip or not.
class Lines {
public:
    explicit Lines(const std::filesystem::path& file) : name_(file.string()) {
        require_regular_file(file);
        std::error_code error;
        size_ = static_cast<double>(std::filesystem::file_size(file, error));
        in_.reset(gzopen(file.c_str(), "rb"));
        if (!in_) throw InputError(fmt::format("{}: cannot be read", name_), errno);
        gzbuffer(in_.get(), 1U << 18U);
    }

    /// The next line without its end; false after the last one.
    bool next(std::string& line) {
        ++number_;
        line.clear();
        while (true) {
            char piece[4096];
            if (gzgets(in_.get(), piece, sizeof piece) == nullptr) {
                int code = Z_OK;
                const char* const why = gzerror(in_.get(), &code);
                if (code != Z_OK && code != Z_STREAM_END)
                    throw InputError(fmt::format("{}:{}: cannot be read: {}", name_, number_, why));
                return !line.empty();
            }
            line += piece;
            if (line.ends_with('\n')) {
                line.pop_back();
                return true;
            }
            if (line.size() > max_catalogue_line_bytes)
                throw InputError(
                    fmt::format("{}:{}: a line of more than {} bytes: no star catalogue in text form", name_,
                                number_, max_catalogue_line_bytes));
        }
    }
    [[nodiscard]] std::uint64_t number() const { return number_; }
    [[nodiscard]] double part_read() const {
        return size_ > 0 ? static_cast<double>(gzoffset(in_.get())) / size_ : 1;
    }

private:
    struct Close {
        void operator()(gzFile file) const { gzclose(file); }
    };
    std::string name_;
    double size_ = 0;
    std::unique_ptr<gzFile_s, Close> in_;
    std::uint64_t number_ = 0;
};

/// Layout by the first bytes and lines.
StarFormat recognised(const std::filesystem::path& file) {
    if (is_plain_fits(file)) return StarFormat::astrometry_index;
    Lines lines(file);
    std::string line;
    while (lines.next(line)) {
        const std::string_view text = line;
        if (text.starts_with("KStars Star Data")) return StarFormat::kstars_binary;
        if (text.starts_with('#') || text.find_first_not_of(" \t\r") == std::string_view::npos) continue;
        if (text.starts_with("H|")) return StarFormat::hipparcos;
        const auto bars = std::count(text.begin(), text.end(), '|');
        if (bars >= 25 && bars < 40) return StarFormat::tycho2;
        if (text.find(',') != std::string_view::npos && text.find("ra") != std::string_view::npos &&
            text.find("dec") != std::string_view::npos)
            return StarFormat::csv;
        constexpr std::size_t sign_at = 10;
        if (text.size() > 57 && (text[sign_at] == '+' || text[sign_at] == '-') && text[6] == '.')
            return StarFormat::kstars;
        if (star_number(text) >= 0) return StarFormat::star_map;
        break;
    }
    throw InputError(fmt::format("{}:{}: not recognised as a star catalogue: --format names its layout",
                                 file.string(), lines.number()));
}

std::unique_ptr<StarRowReader> rows_of(StarFormat format, const StarMapScale& map) {
    switch (format) {
    case StarFormat::hipparcos:
        return hipparcos_rows();
    case StarFormat::tycho2:
        return tycho2_rows();
    case StarFormat::kstars:
        return kstars_rows();
    case StarFormat::star_map:
        return star_map_rows(map);
    default:
        return star_csv_rows();
    }
}

} // namespace

StarSink::StarSink(std::string file, double limiting_v, Report report)
    : file_(std::move(file)), limiting_v_(limiting_v), report_(std::move(report)) {}

void StarSink::take(const StarRow& row, std::uint64_t place) {
    switch (row.kind) {
    case StarRow::Kind::skipped:
        return;
    case StarRow::Kind::star:
        if (row.star.magnitude_v > limiting_v_) {
            ++too_faint;
        } else {
            stars.push_back(row.star);
            if (row.class_from_parallax) ++classes_from_parallax;
        }
        return;
    case StarRow::Kind::refused:
        break;
    }
    const std::uint64_t count = ++refused[std::string(row.cause)];
    if (count <= reported_of_a_cause)
        report_(fmt::format("{}:{}: {}{}{}", file_, place, row.cause, row.detail.empty() ? "" : ": ",
                            row.detail));
    else if (count == reported_of_a_cause + 1)
        report_(fmt::format("{}:{}: {}: others follow, which are counted only", file_, place, row.cause));
}

StarFormat read_stars(const std::filesystem::path& file, const StarImportSettings& settings, StarSink& sink,
                      const std::function<void(double)>& progress) {
    const StarFormat format = settings.format == StarFormat::automatic ? recognised(file) : settings.format;
    if (format == StarFormat::kstars_binary) {
        read_kstars_binary(file, sink);
        return format;
    }
    if (format == StarFormat::astrometry_index) {
        read_astrometry_index(file, sink);
        return format;
    }
    const std::unique_ptr<StarRowReader> rows = rows_of(format, settings.map);
    Lines lines(file);
    std::string line;
    while (lines.next(line)) {
        sink.take(rows->read(line, lines.number()), lines.number());
        if (lines.number() % 1024 == 0) progress(lines.part_read());
    }
    return format;
}

std::uint64_t merge_stars(std::vector<ephemeris::CatalogueStar>& stars,
                          const std::vector<ephemeris::CatalogueStar>& more) {
    if (stars.empty()) {
        stars = more;
        return 0;
    }
    constexpr double near_rad = 2 * std::numbers::pi / (180 * 3600);
    constexpr double like_mag = 1.5;
    // Sort by z: stars within the distance are near in it.
    std::vector<std::pair<double, std::size_t>> by_z;
    by_z.reserve(stars.size());
    for (std::size_t i = 0; i < stars.size(); ++i)
        by_z.emplace_back(stars[i].direction.z, i);
    std::sort(by_z.begin(), by_z.end());
    const auto known = [&](const ephemeris::CatalogueStar& star) {
        auto at = std::lower_bound(by_z.begin(), by_z.end(),
                                   std::pair<double, std::size_t>{star.direction.z - near_rad, 0});
        for (; at != by_z.end() && at->first <= star.direction.z + near_rad; ++at) {
            const ephemeris::CatalogueStar& other = stars[at->second];
            if (length_squared(star.direction - other.direction) < near_rad * near_rad &&
                std::abs(star.magnitude_v - other.magnitude_v) < like_mag)
                return true;
        }
        return false;
    };
    std::vector<ephemeris::CatalogueStar> added;
    for (const ephemeris::CatalogueStar& star : more)
        if (!known(star)) added.push_back(star);
    stars.insert(stars.end(), added.begin(), added.end());
    return more.size() - added.size();
}

double likely_complete_v(const std::vector<ephemeris::CatalogueStar>& stars) {
    constexpr double bin_mag = 0.5;
    constexpr double min_growth = 1.2;
    constexpr std::size_t min_stars = 50;
    std::map<int, std::size_t> bins;
    for (const ephemeris::CatalogueStar& star : stars)
        ++bins[static_cast<int>(std::floor(star.magnitude_v / bin_mag))];
    double complete = std::numeric_limits<double>::quiet_NaN();
    for (const auto& [bin, count] : bins) {
        const auto before = bins.find(bin - 1);
        if (before == bins.end() || before->second < min_stars) continue;
        if (static_cast<double>(count) < min_growth * static_cast<double>(before->second)) break;
        complete = (bin + 1) * bin_mag;
    }
    return complete;
}

} // namespace obscura::tools
