// SPDX-License-Identifier: Apache-2.0
// Star catalogues in binary layouts: kstars' tables, and the star tables of astrometry.net's index files.
#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "tools/import/stars/star_import.hpp"

#include <fitsio.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

namespace obscura::tools {
namespace {

using ephemeris::CatalogueStar;

[[noreturn]] void refuse_catalogue(const std::filesystem::path& file, std::uint64_t at,
                                   std::string_view what) {
    throw InputError(fmt::format("{}: byte {}: {}", file.string(), at, what));
}

/// The whole file, or `bytes` of it from `from`.
std::vector<unsigned char> bytes_of_record(const std::filesystem::path& file, std::uint64_t from,
                                           std::optional<std::uint64_t> bytes) {
    const InputFile in = open_input(file);
    std::error_code error;
    const std::uint64_t size = std::filesystem::file_size(file, error);
    if (error || from > size || (bytes && *bytes > size - from))
        refuse_catalogue(file, size, "the file is truncated");
    std::vector<unsigned char> out(bytes.value_or(size - from));
    if (std::fseek(in.get(), static_cast<long>(from), SEEK_SET) != 0 ||
        std::fread(out.data(), 1, out.size(), in.get()) != out.size())
        refuse_catalogue(file, from, "cannot be read");
    return out;
}

std::uint64_t little_endian(std::span<const unsigned char> bytes) {
    std::uint64_t value = 0;
    for (std::size_t i = bytes.size(); i-- > 0;)
        value = value << 8U | bytes[i];
    return value;
}

std::int64_t sign_extended(std::uint64_t value, std::size_t bytes) {
    const std::uint64_t sign = std::uint64_t{1} << (8 * bytes - 1);
    return static_cast<std::int64_t>((value ^ sign) - sign);
}

/// Layout of kstars' binary tables (kstars/data/tools in its sources): 124 bytes of text, "SK" in little
/// endian or "KS" in big endian, a version byte, the number of fields; for each field its name (10 bytes),
/// size, type and scale; the number of trixels; for each trixel its number, offset and count of records; then
/// magnitude limit, level and largest count of a trixel; then the records.
class KstarsTable {
public:
    explicit KstarsTable(const std::filesystem::path& file)
        : file_(file), bytes_(bytes_of_record(file, 0, {})) {
        constexpr std::size_t text_bytes = 124;
        at_ = text_bytes;
        const auto marker = take(2);
        constexpr std::uint64_t little = 'S' | 'K' << 8;
        if (marker != little)
            refuse_catalogue(file_, text_bytes, "the byte order is not little endian (\"SK\")");
        constexpr std::uint64_t known_version = 1;
        if (const auto version = take(1); version != known_version)
            refuse_catalogue(file_, at_ - 1, fmt::format("version {}, expected {}", version, known_version));
        const auto fields = take(2);
        for (std::uint64_t i = 0; i < fields; ++i)
            take_field();
        const auto trixels = take(4);
        constexpr std::size_t entry_bytes = 12, trailer_bytes = 5;
        if (trixels > (bytes_.size() - at_) / entry_bytes)
            refuse_catalogue(file_, at_, "the file is truncated");
        records_ = 0;
        for (std::uint64_t i = 0; i < trixels; ++i) {
            at_ += 8; // number and offset: the records follow in this order
            records_ += take(4);
        }
        at_ += trailer_bytes;
        if (at_ > bytes_.size() || record_bytes_ == 0 || records_ != (bytes_.size() - at_) / record_bytes_ ||
            (bytes_.size() - at_) % record_bytes_ != 0)
            refuse_catalogue(file_, at_,
                             fmt::format("{} records of {} bytes are announced, {} bytes follow", records_,
                                         record_bytes_, bytes_.size() - std::min(at_, bytes_.size())));
    }

    [[nodiscard]] std::uint64_t records() const { return records_; }
    /// Value of a field of a record; NaN: there is no such field.
    [[nodiscard]] double value(std::uint64_t record, std::string_view name) const {
        const Field* const field = find(name);
        if (field == nullptr) return CatalogueStar::unknown;
        const auto raw = little_endian(std::span(bytes_).subspan(place(record, *field), field->bytes));
        return static_cast<double>(sign_extended(raw, field->bytes)) / field->scale;
    }
    [[nodiscard]] std::string_view text(std::uint64_t record, std::string_view name) const {
        const Field* const field = find(name);
        if (field == nullptr) return {};
        return {reinterpret_cast<const char*>(bytes_.data()) + place(record, *field), field->bytes};
    }

private:
    struct Field {
        std::string name;
        std::size_t offset = 0, bytes = 0;
        double scale = 1;
    };

    std::uint64_t take(std::size_t count) {
        if (count > bytes_.size() - std::min(at_, bytes_.size()))
            refuse_catalogue(file_, at_, "the file is truncated");
        const auto value = little_endian(std::span(bytes_).subspan(at_, count));
        at_ += count;
        return value;
    }
    void take_field() {
        constexpr std::size_t name_bytes = 10;
        Field field;
        for (std::size_t i = 0; i < name_bytes; ++i)
            if (const auto c = static_cast<char>(take(1)); c != '\0') field.name += c;
        field.bytes = take(1);
        if (field.bytes < 1 || field.bytes > 8)
            refuse_catalogue(file_, at_ - 1,
                             fmt::format("a field of {} bytes, allowed are 1 to 8", field.bytes));
        take(1); // type
        field.scale = static_cast<double>(sign_extended(take(4), 4));
        if (!(field.scale > 0)) field.scale = 1;
        field.offset = record_bytes_;
        record_bytes_ += field.bytes;
        fields_.push_back(std::move(field));
    }
    [[nodiscard]] const Field* find(std::string_view name) const {
        const auto found =
            std::find_if(fields_.begin(), fields_.end(), [&](const Field& f) { return f.name == name; });
        return found == fields_.end() ? nullptr : &*found;
    }
    [[nodiscard]] std::size_t place(std::uint64_t record, const Field& field) const {
        return at_ + record * record_bytes_ + field.offset;
    }

    const std::filesystem::path& file_;
    std::vector<unsigned char> bytes_;
    std::vector<Field> fields_;
    std::size_t record_bytes_ = 0;
    std::uint64_t records_ = 0;
    std::size_t at_ = 0; ///< at last the first record
};

double finite_or_zero(double value) {
    return std::isnan(value) ? 0 : value;
}

/// FITS file of which tables are found by the name of their only column.
class FitsTables {
public:
    explicit FitsTables(const std::filesystem::path& file) : file_(file) {
        int status = is_plain_fits(file) ? 0 : FILE_NOT_OPENED;
        fits_open_diskfile(&fits_, file.c_str(), READONLY, &status);
        if (status != 0) {
            fits_clear_errmsg();
            throw InputError(fmt::format("{}: not readable as FITS", file.string()));
        }
    }
    ~FitsTables() {
        int ignored = 0;
        fits_close_file(fits_, &ignored);
        fits_clear_errmsg();
    }
    FitsTables(const FitsTables&) = delete;
    FitsTables& operator=(const FitsTables&) = delete;

    /// Data of the table with a column of that name, rows of `row_bytes`.
    [[nodiscard]] std::vector<unsigned char> table(const char* column, std::uint64_t row_bytes) const {
        int status = 0;
        int count = 0;
        fits_get_num_hdus(fits_, &count, &status);
        for (int i = 2; i <= count && status == 0; ++i) {
            int type = 0;
            fits_movabs_hdu(fits_, i, &type, &status);
            char name[FLEN_VALUE] = {};
            int missing = 0;
            fits_read_key(fits_, TSTRING, "TTYPE1", name, nullptr, &missing);
            if (status != 0 || missing != 0 || std::string_view(name) != column) continue;
            LONGLONG width = 0, rows = 0, header = 0, data = 0, end = 0;
            fits_read_key(fits_, TLONGLONG, "NAXIS1", &width, nullptr, &status);
            fits_read_key(fits_, TLONGLONG, "NAXIS2", &rows, nullptr, &status);
            fits_get_hduaddrll(fits_, &header, &data, &end, &status);
            constexpr LONGLONG max_rows = 200'000'000;
            if (status != 0 || rows < 0 || rows > max_rows || data < 0 ||
                width != static_cast<LONGLONG>(row_bytes))
                break;
            return bytes_of_record(file_, static_cast<std::uint64_t>(data),
                                   static_cast<std::uint64_t>(rows) * row_bytes);
        }
        throw InputError(fmt::format(
            "{}: no table with a column {} of {} bytes: not an index file of astrometry.net with magnitudes",
            file_.string(), column, row_bytes));
    }
    [[nodiscard]] std::string key(const char* name) const {
        int status = 0;
        int type = 0;
        char value[FLEN_VALUE] = {};
        fits_movabs_hdu(fits_, 1, &type, &status);
        fits_read_key(fits_, TSTRING, name, value, nullptr, &status);
        return status == 0 ? value : "";
    }

private:
    const std::filesystem::path& file_;
    fitsfile* fits_ = nullptr;
};

} // namespace

void read_kstars_binary(const std::filesystem::path& file, StarSink& sink) {
    const KstarsTable table(file);
    for (std::uint64_t i = 0; i < table.records(); ++i) {
        CatalogueStar star;
        const double ra_h = table.value(i, "RA");
        const double dec = table.value(i, "Dec");
        if (!set_place(ra_h * 15, dec, star)) {
            sink.take(StarRow::refuse("no position, or one that is not possible",
                                      fmt::format("{} h, {} deg", ra_h, dec)),
                      i + 1);
            continue;
        }
        star.motion_ra_mas_yr = finite_or_zero(table.value(i, "dRA"));
        star.motion_dec_mas_yr = finite_or_zero(table.value(i, "dDec"));
        star.parallax_mas = finite_or_zero(table.value(i, "parallax"));
        star.magnitude_v = table.value(i, "mag");
        star.colour_b_v = table.value(i, "bv_index");
        if (const double v = table.value(i, "V"); !std::isnan(v)) { // deep tables have B and V
            star.magnitude_v = v;
            star.colour_b_v = table.value(i, "B") - v;
        }
        const std::string_view type = table.text(i, "spec_type");
        set_type(type, star);
        star.id = i + 1;
        if (const double hd = table.value(i, "HD"); hd > 0) {
            star.ids = ephemeris::StarIds::henry_draper;
            star.id = static_cast<std::uint64_t>(std::llround(hd));
        }
        sink.take(checked(star, kstars_parallax_error_mas(type)), i + 1);
    }
}

void read_astrometry_index(const std::filesystem::path& file, StarSink& sink) {
    const FitsTables fits(file);
    // In the order of the bytes of the number 0x01020304.
    const std::string order = fits.key("ENDIAN");
    const bool little = order.starts_with("04:03");
    if (!little && !order.starts_with("01:02"))
        throw InputError(fmt::format("{}: no byte order (key ENDIAN): not an index file of astrometry.net",
                                     file.string()));
    const auto integer = [&](std::span<const unsigned char> bytes) {
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < bytes.size(); ++i)
            value = value << 8U | bytes[little ? bytes.size() - 1 - i : i];
        return value;
    };
    constexpr std::size_t range_values = 7, coordinates = 3;
    const auto range = fits.table("kdtree_range_stars", 8);
    const auto places = fits.table("kdtree_data_stars", 4 * coordinates);
    const auto magnitudes = fits.table("MAG_VT", 4);
    if (range.size() != 8 * range_values || places.size() / (4 * coordinates) != magnitudes.size() / 4)
        throw InputError(fmt::format("{}: its tables have different lengths", file.string()));
    const auto limit = [&](std::size_t i) {
        return std::bit_cast<double>(integer(std::span(range).subspan(8 * i, 8)));
    };
    const double scale = limit(2 * coordinates);
    for (std::size_t i = 0; i < magnitudes.size() / 4; ++i) {
        std::array<double, coordinates> p{};
        for (std::size_t c = 0; c < coordinates; ++c)
            p[c] =
                limit(c) +
                static_cast<double>(integer(std::span(places).subspan(4 * (coordinates * i + c), 4))) / scale;
        // Magnitudes are FITS's own: big endian.
        std::uint32_t bits = 0;
        for (std::size_t b = 0; b < 4; ++b)
            bits = bits << 8U | magnitudes[4 * i + b];
        CatalogueStar star;
        star.direction = {p[0], p[1], p[2]};
        const double norm = length(star.direction);
        constexpr double rounding = 1e-6;
        if (!(std::abs(norm - 1) < rounding)) {
            sink.take(StarRow::refuse("direction is not a unit vector", fmt::format("length {}", norm)),
                      i + 1);
            continue;
        }
        star.direction = star.direction / norm;
        const double vt = std::bit_cast<float>(bits);
        star.magnitude_v = johnson_from_tycho(CatalogueStar::unknown, vt).v;
        star.id = i + 1;
        sink.take(std::isfinite(vt) ? checked(star) : StarRow::refuse("no magnitude"), i + 1);
    }
}

} // namespace obscura::tools
