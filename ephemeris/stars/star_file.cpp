// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/stars/star_file.hpp"

#include "core/error.hpp"
#include "core/io/file_bytes.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "core/units.hpp"
#include "ephemeris/stars/star_file_layout.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

namespace obscura::ephemeris {

using namespace star_layout;

namespace {

std::uint32_t crc_of(std::span<const std::byte> bytes, std::uint32_t before = 0) {
    return static_cast<std::uint32_t>(
        crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

FacePoint place(const std::byte* star) noexcept {
    const auto unit = [&](std::size_t at) { return (get<std::uint32_t>(star + at) + 0.5) * 0x1p-31 - 1; };
    return {(get<std::uint8_t>(star + record::face) & 7U) % 6, unit(record::u), unit(record::v)};
}

double thousandths(std::int32_t value) noexcept {
    return value * 1e-3;
}

} // namespace

StarFile::StarFile(const std::filesystem::path& file) {
    const FileBytes contents = read_file_bytes(file);
    if (contents.size < header_bytes)
        throw InputError(fmt::format("{}: not a star catalogue file: {} bytes, the header has {}",
                                     file.string(), contents.size, header_bytes));
    memory_ = contents.bytes;
    bytes_ = contents.span();
    read(file.string());
}

StarFile::StarFile(std::span<const std::byte> bytes, const std::string& name) {
    const auto copy = std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end());
    memory_ = {copy, copy->data()};
    bytes_ = *copy;
    read(name);
}

bool StarFile::is_one(const std::filesystem::path& file) {
    if (!is_file_at(file)) return false;
    const InputFile in(std::fopen(file.c_str(), "rbe"));
    std::array<char, magic.size()> start{};
    return in && std::fread(start.data(), 1, start.size(), in.get()) == start.size() &&
           std::string_view(start.data(), start.size()) == magic;
}

void StarFile::read(const std::string& name) {
    const auto refuse = [&](std::size_t at, std::string_view what) {
        throw InputError(fmt::format("{}: byte {}: {}", name, at, what));
    };
    const std::byte* const start = bytes_.data();
    if (bytes_.size() < header_bytes || std::memcmp(start, magic.data(), magic.size()) != 0)
        refuse(0,
               "not a star catalogue file, which begins with \"OBSTARS\" (obscura import stars makes one)");
    const auto expect = [&](std::size_t at, std::uint64_t found, std::uint64_t wanted,
                            std::string_view what) {
        if (found != wanted) refuse(at, fmt::format("{} {}, expected {}", what, found, wanted));
    };
    expect(header::version, get<std::uint32_t>(start + header::version), star_layout::version, "version");
    expect(header::header_bytes, get<std::uint32_t>(start + header::header_bytes), header_bytes,
           "bytes of the header");
    expect(header::record_bytes, get<std::uint32_t>(start + header::record_bytes), record_bytes,
           "bytes of a record");
    const auto edge = get<std::uint32_t>(start + header::edge);
    if (edge < SkyCells::min_edge || edge > SkyCells::max_edge || edge % SkyCells::group_edge != 0)
        refuse(header::edge,
               fmt::format("{} sky cells along an edge, allowed are multiples of {} from {} to {}", edge,
                           SkyCells::group_edge, SkyCells::min_edge, SkyCells::max_edge));
    const auto stars = get<std::uint64_t>(start + header::stars);
    if (stars > std::numeric_limits<std::uint32_t>::max())
        refuse(header::stars, fmt::format("{} stars, allowed are up to 2^32 - 1", stars));
    const std::size_t index_bytes = 4 * (std::size_t{6} * edge * edge + 1);
    const std::size_t wanted = header_bytes + index_bytes + record_bytes * stars;
    expect(header::file_bytes, get<std::uint64_t>(start + header::file_bytes), wanted, "bytes of the file");
    if (bytes_.size() != wanted)
        refuse(bytes_.size(),
               fmt::format("the file has {} bytes, by its header {}: it is truncated or damaged",
                           bytes_.size(), wanted));
    const std::uint32_t crc =
        crc_of(bytes_.subspan(header_bytes, index_bytes), crc_of(bytes_.first(header::crc)));
    if (crc != get<std::uint32_t>(start + header::crc))
        refuse(header::crc, "the checksum of header and index is wrong: the file is damaged");
    size_ = static_cast<std::uint32_t>(stars);
    cells_ = std::make_shared<const SkyCells>(edge);
    std::uint32_t before = 0;
    for (std::uint32_t cell = 0; cell <= cells_->count(); ++cell) {
        const std::uint32_t first = first_of(cell);
        if (first < before || first > size_ || (cell == 0 && first != 0) ||
            (cell == cells_->count() && first != size_))
            refuse(header_bytes + 4 * std::size_t{cell}, fmt::format("sky cell {} has no valid place", cell));
        before = first;
    }
    const auto number = [&](std::size_t at) { return thousandths(get<std::int32_t>(start + at)); };
    brightest_v_ = number(header::brightest);
    faintest_v_ = number(header::faintest);
    if (get<std::int32_t>(start + header::complete) != unknown_completeness)
        complete_v_ = number(header::complete);
    largest_motion_mas_yr_ = get<std::uint32_t>(start + header::motion) * 1e-3;
    largest_parallax_mas_ = get<std::uint32_t>(start + header::parallax) * 1e-3;
    const std::string_view source(reinterpret_cast<const char*>(start + header::source), max_source_bytes);
    source_ = source.substr(0, source.find('\0'));
}

bool StarFile::intact() const {
    return crc_of(bytes_.subspan(bytes_.size() - record_bytes * size_)) ==
           get<std::uint32_t>(bytes_.data() + header::records_crc);
}

const std::byte* StarFile::record(std::uint32_t number) const noexcept {
    return bytes_.data() + header_bytes + 4 * (std::size_t{cells_->count()} + 1) +
           record_bytes * std::size_t{number};
}

std::uint32_t StarFile::first_of(std::uint32_t cell) const noexcept {
    return get<std::uint32_t>(bytes_.data() + header_bytes + 4 * std::size_t{cell});
}

Vec3 StarFile::direction(std::uint32_t number) const noexcept {
    return direction_of(place(record(number)));
}

double StarFile::magnitude_v(std::uint32_t number) const noexcept {
    return thousandths(get<std::int16_t>(record(number) + record::magnitude));
}

CatalogueStar StarFile::star(std::uint32_t number) const noexcept {
    const std::byte* const at = record(number);
    CatalogueStar star;
    star.direction = direction_of(place(at));
    star.motion_ra_mas_yr = thousandths(get<std::int32_t>(at + record::motion_ra));
    star.motion_dec_mas_yr = thousandths(get<std::int32_t>(at + record::motion_dec));
    star.parallax_mas = thousandths(get<std::int32_t>(at + record::parallax));
    star.magnitude_v = thousandths(get<std::int16_t>(at + record::magnitude));
    if (const auto colour = get<std::int16_t>(at + record::colour); colour != unknown_colour)
        star.colour_b_v = thousandths(colour);
    if (const std::uint32_t type = get<std::uint16_t>(at + record::type); type > 0) {
        star.type_number = std::min((type - 1) % luminosity_step, max_type_hundredths) * 0.01;
        star.luminosity = static_cast<Luminosity>(std::min((type - 1) / luminosity_step, 3U));
    } else {
        star.luminosity = static_cast<Luminosity>(
            std::min<std::uint32_t>(get<std::uint8_t>(at + record::untyped_class), 3));
    }
    star.ids = static_cast<StarIds>(std::min<std::uint32_t>(get<std::uint8_t>(at + record::face) >> 4U,
                                                            enum_names(StarIds{}).size() - 1));
    star.id = get<std::uint64_t>(at + record::id);
    return star;
}

double StarFile::min_cosine(const SkyCells::Cone& cone) noexcept {
    return cone.half_angle_rad >= std::numbers::pi ? -2 : std::cos(cone.half_angle_rad) - 1e-12;
}

std::size_t StarFile::find(const SkyCells::Cone& cone, double limiting_v,
                           std::span<std::uint32_t> found) const noexcept {
    std::size_t count = 0;
    for_each(cone, limiting_v, [&](std::uint32_t i) {
        if (count < found.size()) found[count] = i;
        ++count;
    });
    return count;
}

double StarFile::largest_shift_rad(double years, Vec3 observer_au) const noexcept {
    return (largest_motion_mas_yr_ * std::abs(years) + largest_parallax_mas_ * length(observer_au)) *
           milliarcsecond;
}

} // namespace obscura::ephemeris
