// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/map_source.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "core/units.hpp"
#include "tools/import/map/pds4_label.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace obscura::tools {
namespace {

using terrain::ProjectionKind;
/// Bytes of samples that are asked for at once.
constexpr std::uint64_t piece_bytes = std::uint64_t{8} << 20;

/// Whether the file begins as a PDS3 label does, some of which follow on a line of SFDU.
bool begins_as_pds3(const std::filesystem::path& file) {
    const InputFile in = open_input(file);
    std::string text(400, '\0');
    text.resize(std::fread(text.data(), 1, text.size(), in.get()));
    return text.find("PDS_VERSION_ID") != std::string::npos && text.find("PDS4") == std::string::npos;
}

/// The PDS3 label of a file: the file itself, or one of the same name beside it.
std::optional<images::PdsLabel> label_of(const std::filesystem::path& file) {
    if (begins_as_pds3(file)) return images::PdsLabel(file);
    for (const char* extension : {".lbl", ".LBL", ".Lbl"}) {
        std::filesystem::path beside = file;
        beside.replace_extension(extension);
        if (is_file_at(beside) && begins_as_pds3(beside)) return images::PdsLabel(beside);
    }
    return std::nullopt;
}

/// The type that holds the numbers of such samples.
GdalType gdal_type_of(const images::PdsSampleType& type) {
    using Kind = images::PdsSampleType::Kind;
    if (type.is_real() || type.bytes == 8) return type.bytes == 4 ? GdalType::f32 : GdalType::f64;
    const bool negative = type.kind == Kind::signed_integer;
    if (type.bytes == 1) return negative ? GdalType::i8 : GdalType::u8;
    if (type.bytes == 2) return negative ? GdalType::i16 : GdalType::u16;
    return negative ? GdalType::i32 : GdalType::u32;
}

/// The encoding of numbers of that type, byte order apart.
images::PdsSampleType sample_type_of(GdalType type) {
    using Kind = images::PdsSampleType::Kind;
    images::PdsSampleType out;
    out.bytes = bytes_of(type);
    if (type == GdalType::f32 || type == GdalType::f64)
        out.kind = Kind::real;
    else if (type == GdalType::i8 || type == GdalType::i16 || type == GdalType::i32)
        out.kind = Kind::signed_integer;
    return out;
}

template<typename T>
void to_floats(std::span<const std::byte> bytes, const MapNumbers& numbers, double shift,
               std::span<float> out) {
    const bool bounded = std::isfinite(numbers.min_valid) || std::isfinite(numbers.largest_valid);
    const bool plain = !std::is_floating_point_v<T> && numbers.missing.empty() && !bounded;
    for (std::size_t i = 0; i < out.size(); ++i) {
        T raw;
        std::memcpy(&raw, bytes.data() + i * sizeof(T), sizeof(T));
        const auto number = static_cast<double>(raw);
        out[i] = static_cast<float>((plain ? number : numbers.valid(number)) - shift);
    }
}

} // namespace

MapSource::MapSource(GdalProcess& process, const std::filesystem::path& file, const MapSettings& settings,
                     MapRemarks& remarks)
    : process_(process), name_(file.string()) {
    require_regular_file(file);
    open(file);
    for (const std::string& warning : map_.warnings)
        remarks.note(name_ + ": GDAL: " + one_line(warning));
    choose_bands(settings, remarks);
    read_numbers(settings);
    try {
        place_ = georeference(map_, label_ ? &*label_ : nullptr, settings, name_, remarks);
        take_part();
        check_projection(remarks);
        if (!place_.foreign)
            (void)terrain::MapFrame(place_.projection, place_.transform, place_.registration, map_.width,
                                    map_.height);
    } catch (const std::invalid_argument& error) {
        throw InputError(fmt::format("{}: {} (--edges says where its samples are)", name_, error.what()));
    }
}

/// Makes the part of the file that the georeference takes the whole map.
void MapSource::take_part() {
    first_row_ = place_.first_row;
    map_.width = place_.width;
    map_.height = place_.height;
    if (!map_.transform) return;
    auto& t = *map_.transform;
    t[0] += static_cast<double>(first_row_) * t[2];
    t[3] += static_cast<double>(first_row_) * t[5];
}

void MapSource::open(const std::filesystem::path& file) {
    label_ = label_of(file);
    std::optional<images::Pds3Layout> layout;
    if (label_) {
        try {
            layout = images::pds3_layout(*label_);
        } catch (const InputError&) { // GDAL may read it, or else it says why not
        }
    }
    // A label beside data that GDAL cannot open by themselves, or the data of a label.
    const bool label_is_beside = label_ && label_->file() != file;
    std::string why;
    try {
        map_ = process_.open(file);
    } catch (const InputError& error) {
        if (!label_ || !process_.running()) throw;
        why = error.what();
    }
    if (!why.empty() && label_is_beside) {
        try {
            map_ = process_.open(label_->file());
            why.clear();
        } catch (const InputError&) {
            if (!process_.running()) throw;
        }
    }
    // Samples that are not compressed are read where the label says, which GDAL takes otherwise in some
    // labels; it takes ^IMAGE = 'X.IMG' for the label itself.
    if (why.empty() && map_.driver != "PDS") return;
    if (layout)
        open_samples(*layout);
    else if (!why.empty())
        throw InputError(why);
}

void MapSource::open_samples(const images::Pds3Layout& layout) {
    samples_ = std::make_unique<images::Pds3Samples>(layout);
    map_.width = layout.width;
    map_.height = layout.height;
    map_.band_count = static_cast<std::uint32_t>(layout.bands);
    GdalBand band;
    band.type = gdal_type_of(layout.type);
    band.block_width = static_cast<std::uint32_t>(std::min<std::int64_t>(layout.width, 1 << 30));
    band.block_height = 1;
    map_.bands.assign(std::min(map_.band_count, gdal_band_limit), band);
}

void MapSource::choose_bands(const MapSettings& settings, MapRemarks& remarks) {
    const std::uint32_t bands = static_cast<std::uint32_t>(map_.bands.size());
    if (settings.band) {
        if (*settings.band < 1 || *settings.band > bands)
            throw InputError(
                fmt::format("{}: no band {}: it has {} (--band)", name_, *settings.band, map_.band_count));
        bands_ = {*settings.band};
    } else if (settings.kind == terrain::ObtKind::albedo && (bands == 3 || bands == 4)) {
        bands_ = {1, 2, 3};
        rgb_ = true;
    } else {
        bands_ = {1};
        if (bands > 1 && !(bands == 2 && map_.bands[0].masked))
            remarks.warn(fmt::format("{}: the first of {} bands is taken (--band)", name_, map_.band_count));
    }
    for (const std::uint32_t band : bands_) {
        const GdalBand& b = map_.bands[band - 1];
        if (b.palette)
            throw InputError(fmt::format(
                "{}: its samples are numbers of colours in a table: gdal_translate -expand gray (or rgb) makes values of them",
                name_));
        if (b.type != map_.bands[bands_[0] - 1].type)
            throw InputError(name_ + ": its bands are of different types: --band chooses one");
    }
}

bool MapSource::by_rows() const {
    const GdalBand& band = map_.bands[bands_[0] - 1];
    return std::int64_t{band.block_width} >= map_.width;
}

bool MapSource::may_have_holes() const {
    return numbers_.masked || !numbers_.missing.empty() || std::isfinite(numbers_.min_valid) ||
           std::isfinite(numbers_.largest_valid) || numbers_.type == GdalType::f32 ||
           numbers_.type == GdalType::f64;
}

/// ISIS gives numbers at the ends of the range to samples that are missing, or too dark or bright to count.
void MapSource::numbers_of_isis() {
    switch (numbers_.type) {
    case GdalType::u8:
        numbers_.min_valid = 1;
        numbers_.largest_valid = 254;
        break;
    case GdalType::i16:
        numbers_.min_valid = -32752;
        break;
    case GdalType::u16:
        numbers_.min_valid = 3;
        numbers_.largest_valid = 65522;
        break;
    default:
        numbers_.min_valid = -3.402822655089e38;
        break;
    }
    numbers_.missing.clear();
}

void MapSource::read_numbers(const MapSettings& settings) {
    const GdalBand& band = map_.bands[bands_[0] - 1];
    numbers_.type = band.type;
    numbers_.masked = band.masked;
    numbers_.scale = band.scale.value_or(1);
    numbers_.offset = band.offset.value_or(0);
    numbers_.scaled = numbers_.scale != 1 || numbers_.offset != 0;
    numbers_.unit = band.unit;
    const images::PdsSampleType type = samples_ ? samples_->layout().type : sample_type_of(band.type);
    const auto missing = [&](double number) { // one that no sample can be marks none
        const std::optional<double> sample = images::as_sample(type, number);
        numbers_.missing = sample ? std::vector<double>{*sample} : std::vector<double>();
        return sample.has_value();
    };
    if (band.nodata) missing(*band.nodata);
    if (map_.driver == "ISIS3" || map_.driver == "ISIS2") numbers_of_isis();
    // What GDAL says of missing samples is made up where the label says nothing.
    if (label_) static_cast<images::PdsNumbers&>(numbers_) = images::pds3_numbers(*label_, type);
    for (const auto& [key, text] : map_.texts)
        if (key == "label:PDS4") read_pds4_constants(text, name_, map_.width, map_.height, type, numbers_);
    if (settings.scale) numbers_.scale = *settings.scale;
    if (settings.offset) numbers_.offset = *settings.offset;
    if (settings.scale || settings.offset) numbers_.scaled = true;
    if (settings.nodata && !missing(*settings.nodata))
        throw InputError(fmt::format("{}: --nodata {}: none of its samples of type {} can be that", name_,
                                     *settings.nodata, name_of(band.type)));
    if (!numbers_.possible())
        throw InputError(fmt::format("{}: scale {} and offset {} are not possible (--scale, --offset)", name_,
                                     numbers_.scale, numbers_.offset));
}

/// PROJ is asked whether it has the same map; if not, its way is taken.
void MapSource::check_projection(MapRemarks& remarks) {
    if (!place_.by_system || place_.foreign || place_.projection.kind == ProjectionKind::planar) return;
    const terrain::MapFrame frame(place_.projection, place_.transform, terrain::Registration::node,
                                  map_.width, map_.height);
    GdalTransform request{map_.id, false, {}};
    std::vector<terrain::SamplePlace> places;
    for (const double v : {0.02, 0.31, 0.5, 0.97})
        for (const double u : {0.01, 0.27, 0.5, 0.98}) {
            const terrain::SamplePlace at{u * static_cast<double>(map_.width),
                                          v * static_cast<double>(map_.height)};
            const Vec3 p = frame.position(at);
            request.points.push_back({(place_.projection.longitude_rad(p)) / degree - map_.prime_meridian_deg,
                                      place_.projection.latitude_rad(p) / degree});
            places.push_back(at);
        }
    const auto answers = process_.transform(request);
    const auto& t = *map_.transform;
    const double turn = map_.system == GdalSystem::geographic
                            ? 360 / map_.degrees_per_unit
                            : place_.projection.turn_m() / map_.metres_per_unit;
    double worst = 0;
    int compared = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
        double dx = answers[i][0] - (t[0] + t[1] * places[i].x + t[2] * places[i].y);
        const double dy = answers[i][1] - (t[3] + t[4] * places[i].x + t[5] * places[i].y);
        if (!std::isfinite(dx) || !std::isfinite(dy)) continue;
        if (turn > 0) dx = std::remainder(dx, turn);
        worst = std::max({worst, std::abs(dx / t[1]), std::abs(dy / t[5])});
        ++compared;
    }
    // Rounded labels were made whole meanwhile, by less than half a pixel.
    if (compared > 0 && worst > 0.6) {
        place_.foreign = true;
        remarks.note(fmt::format("{}: PROJ has its projection otherwise by {:.3g} pixels", name_, worst));
    }
}

void MapSource::read_samples(std::int64_t band, std::int64_t x, std::int64_t y, int columns, int rows,
                             std::span<float> out) {
    std::vector<double> row(static_cast<std::size_t>(columns));
    for (int r = 0; r < rows; ++r) {
        samples_->read(band, x, y + r, row);
        to_floats<double>(std::as_bytes(std::span(row)), numbers_, shift_,
                          out.subspan(static_cast<std::size_t>(r) * row.size(), row.size()));
    }
}

void MapSource::read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
                     std::span<float> out) {
    y += first_row_;
    if (samples_) return read_samples(bands_[plane] - 1, x, y, columns, rows, out);
    const GdalType type = numbers_.type;
    const std::uint64_t size = bytes_of(type);
    const auto across = static_cast<std::uint32_t>(
        std::min<std::uint64_t>(static_cast<std::uint64_t>(columns), piece_bytes / size));
    const auto down = static_cast<std::uint32_t>(
        std::clamp<std::uint64_t>(piece_bytes / (across * size), 1, static_cast<std::uint64_t>(rows)));
    std::vector<float> piece;
    const auto stride = static_cast<std::size_t>(columns);
    for (std::int64_t r = 0; r < rows; r += down)
        for (std::int64_t c = 0; c < columns; c += across) {
            GdalBlock block;
            block.id = map_.id;
            block.band = bands_[plane];
            block.x = x + c;
            block.y = y + r;
            block.columns = static_cast<std::uint32_t>(std::min<std::int64_t>(across, columns - c));
            block.rows = static_cast<std::uint32_t>(std::min<std::int64_t>(down, rows - r));
            const bool whole = block.columns == static_cast<std::uint32_t>(columns);
            const std::size_t first = static_cast<std::size_t>(r) * stride + static_cast<std::size_t>(c);
            const std::size_t count = std::size_t{block.columns} * block.rows;
            std::span<float> to = out.subspan(first, whole ? count : 0);
            if (!whole) {
                piece.resize(count);
                to = piece;
            }
            const auto bytes = process_.read(block, type);
            switch (type) {
            case GdalType::u8:
                to_floats<std::uint8_t>(bytes, numbers_, shift_, to);
                break;
            case GdalType::i8:
                to_floats<std::int8_t>(bytes, numbers_, shift_, to);
                break;
            case GdalType::u16:
                to_floats<std::uint16_t>(bytes, numbers_, shift_, to);
                break;
            case GdalType::i16:
                to_floats<std::int16_t>(bytes, numbers_, shift_, to);
                break;
            case GdalType::u32:
                to_floats<std::uint32_t>(bytes, numbers_, shift_, to);
                break;
            case GdalType::i32:
                to_floats<std::int32_t>(bytes, numbers_, shift_, to);
                break;
            case GdalType::f32:
                to_floats<float>(bytes, numbers_, shift_, to);
                break;
            case GdalType::f64:
                to_floats<double>(bytes, numbers_, shift_, to);
                break;
            }
            if (numbers_.masked) {
                block.mask = true;
                const auto mask = process_.read(block, type);
                for (std::size_t i = 0; i < count; ++i)
                    if (mask[i] == std::byte{0}) to[i] = std::numeric_limits<float>::quiet_NaN();
            }
            if (!whole)
                for (std::uint32_t k = 0; k < block.rows; ++k)
                    std::copy_n(piece.begin() + static_cast<std::ptrdiff_t>(std::size_t{k} * block.columns),
                                block.columns, out.begin() + static_cast<std::ptrdiff_t>(first + k * stride));
        }
}

} // namespace obscura::tools
