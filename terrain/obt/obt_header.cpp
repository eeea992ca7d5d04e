// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "terrain/obt/crc32c.hpp"
#include "terrain/obt/obt_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

namespace obscura::terrain::obt {
namespace {

/// Offsets in the header.
namespace at {
constexpr std::size_t version = 8, bytes = 12, flags = 16, kind = 20, type = 21, registration = 22,
                      projection = 23, height_meaning = 24, latitudes = 25, planes = 26, tile = 28,
                      margin = 32, levels = 36, width = 40, height = 48, transform = 56, equatorial = 104,
                      polar = 112, centre_longitude = 120, true_scale = 128, semi_axes = 136, scale = 160,
                      offset = 168, exponents = 176, nodata = 180, data = 184, file_bytes = 192,
                      shard_bytes = 200, toml_bytes = 208, toml_crc = 212, uuid = 216, unit = 240,
                      title = 272, licence = 400, source = 528, planes_table = 1280, crc = 4092;
}
constexpr std::size_t plane_bytes = 48;

enum Flag : std::uint32_t { complete = 1, lattice = 2, rgb = 4, has_nodata = 8, has_statistics = 16 };

void put_text(std::byte* to, std::string_view text) {
    std::transform(text.begin(), text.end(), to, [](char c) { return static_cast<std::byte>(c); });
}

std::string get_text(const std::byte* from, std::size_t most) {
    std::string text;
    for (std::size_t i = 0; i < most && from[i] != std::byte{0}; ++i)
        text += static_cast<char>(from[i]);
    return text;
}

std::string toml_string(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        out += c;
    }
    return out + "\"";
}

/// An integral part must not look like an integer to TOML.
std::string real(double value) {
    std::string text = fmt::format("{}", value);
    if (text.find_first_of(".en") == std::string::npos) text += ".0";
    return text;
}

std::string toml_of(const ObtMetadata& m, const HeaderPlaces& places) {
    std::string out = "\n"
                      "# The 4096 bytes before this text, for people. "
                      "Programs read those: see docs/textures.md of Obscura.\n";
    const auto line = [&](std::string_view key, const std::string& value) {
        out += fmt::format("{} = {}\n", key, value);
    };
    line("uuid", toml_string(uuid_text(m.uuid)));
    line("title", toml_string(m.title));
    line("licence", toml_string(m.licence));
    line("source", toml_string(m.source));
    line("kind", toml_string(name_of(m.kind)));
    line("unit", toml_string(m.unit));
    line("type", toml_string(name_of(m.type)));
    if (m.lattice) line("step_exponents", fmt::format("[{}, {}]", m.finest_exponent, m.coarsest_exponent));
    line("scale", real(m.scale));
    line("offset", real(m.offset));
    if (m.nodata) line("nodata", fmt::format("{}", *m.nodata));
    line("planes", fmt::format("{}", m.planes));
    line("rgb", m.rgb ? "true" : "false");
    line("width", fmt::format("{}", m.width));
    line("height", fmt::format("{}", m.height));
    line("levels", fmt::format("{}", obt_levels(m.width, m.height)));
    line("tile", fmt::format("{}", tile_samples));
    line("margin", fmt::format("{}", margin));
    line("bytes", fmt::format("{}", places.file_bytes));
    line("shard_bytes", fmt::format("{}", places.shard_bytes));
    line("registration", toml_string(name_of(m.registration)));
    std::string numbers;
    for (const double v : m.transform)
        numbers += (numbers.empty() ? "" : ", ") + real(v);
    line("transform", "[" + numbers + "]");
    line("projection", toml_string(name_of(m.projection.kind)));
    line("latitudes", toml_string(name_of(m.projection.latitudes)));
    line("equatorial_radius_m", real(m.projection.equatorial_radius_m));
    line("polar_radius_m", real(m.projection.polar_radius_m));
    line("centre_longitude_rad", real(m.projection.centre_longitude_rad));
    line("true_scale_latitude_rad", real(m.projection.true_scale_latitude_rad));
    line("semi_axes_m",
         fmt::format("[{}, {}, {}]", real(m.semi_axes_m.x), real(m.semi_axes_m.y), real(m.semi_axes_m.z)));
    line("height_meaning", toml_string(name_of(m.height_meaning)));
    for (const ObtPlaneStatistics& s : m.statistics)
        out += fmt::format("[[plane]]\nleast = {}\nlargest = {}\nmean = {}\nholes = {}\n", real(s.least),
                           real(s.largest), real(s.mean), s.holes);
    return out;
}

template<NamedEnum Enum>
Enum get_enum(std::span<const std::byte> header, std::size_t where, std::string_view what,
              const std::string& name) {
    const auto value = static_cast<Enum>(get<std::uint8_t>(header.data() + where));
    if (name_of(value).empty())
        throw InputError(fmt::format("{}: header: {} number {} at byte {} is not known", name, what,
                                     static_cast<int>(value), where));
    return value;
}

} // namespace

std::vector<std::byte> header_of(const ObtMetadata& m, const HeaderPlaces& places) {
    std::vector<std::byte> out(data_start);
    std::byte* const h = out.data();
    put_text(h, magic);
    put(h + at::version, version);
    put(h + at::bytes, static_cast<std::uint32_t>(header_bytes));
    put(h + at::flags, (places.complete ? complete : 0U) | (m.lattice ? lattice : 0U) | (m.rgb ? rgb : 0U) |
                           (m.nodata ? has_nodata : 0U) | (m.statistics.empty() ? 0U : has_statistics));
    put(h + at::kind, static_cast<std::uint8_t>(m.kind));
    put(h + at::type, static_cast<std::uint8_t>(m.type));
    put(h + at::registration, static_cast<std::uint8_t>(m.registration));
    put(h + at::projection, static_cast<std::uint8_t>(m.projection.kind));
    put(h + at::height_meaning, static_cast<std::uint8_t>(m.height_meaning));
    put(h + at::latitudes, static_cast<std::uint8_t>(m.projection.latitudes));
    put(h + at::planes, static_cast<std::uint16_t>(m.planes));
    put(h + at::tile, static_cast<std::uint32_t>(tile_samples));
    put(h + at::margin, static_cast<std::uint32_t>(margin));
    put(h + at::levels, static_cast<std::uint32_t>(obt_levels(m.width, m.height)));
    put(h + at::width, static_cast<std::uint64_t>(m.width));
    put(h + at::height, static_cast<std::uint64_t>(m.height));
    for (std::size_t i = 0; i < m.transform.size(); ++i)
        put(h + at::transform + 8 * i, m.transform[i]);
    put(h + at::equatorial, m.projection.equatorial_radius_m);
    put(h + at::polar, m.projection.polar_radius_m);
    put(h + at::centre_longitude, m.projection.centre_longitude_rad);
    put(h + at::true_scale, m.projection.true_scale_latitude_rad);
    put(h + at::semi_axes, m.semi_axes_m.x);
    put(h + at::semi_axes + 8, m.semi_axes_m.y);
    put(h + at::semi_axes + 16, m.semi_axes_m.z);
    put(h + at::scale, m.scale);
    put(h + at::offset, m.offset);
    put(h + at::exponents, static_cast<std::int8_t>(m.finest_exponent));
    put(h + at::exponents + 1, static_cast<std::int8_t>(m.coarsest_exponent));
    put(h + at::nodata, m.nodata.value_or(0));
    put(h + at::data, data_start);
    put(h + at::file_bytes, places.file_bytes);
    put(h + at::shard_bytes, places.shard_bytes);
    for (std::size_t i = 0; i < m.uuid.size(); ++i)
        h[at::uuid + i] = std::byte{m.uuid[i]};
    put_text(h + at::unit, m.unit);
    put_text(h + at::title, m.title);
    put_text(h + at::licence, m.licence);
    put_text(h + at::source, m.source);
    for (std::size_t p = 0; p < places.roots.size(); ++p) {
        std::byte* const to = h + at::planes_table + p * plane_bytes;
        put(to, places.roots[p].place);
        put(to + 8, places.roots[p].crc);
        if (p >= m.statistics.size()) continue;
        put(to + 16, m.statistics[p].least);
        put(to + 24, m.statistics[p].largest);
        put(to + 32, m.statistics[p].mean);
        put(to + 40, static_cast<std::uint32_t>(m.statistics[p].holes ? 1 : 0));
    }
    std::string toml = toml_of(m, places);
    toml.resize(std::min(toml.size(), toml_bytes));
    put_text(h + header_bytes, toml);
    put(h + at::toml_bytes, static_cast<std::uint32_t>(toml.size()));
    put(h + at::toml_crc, crc32c({h + header_bytes, toml.size()}));
    put(h + at::crc, crc32c({h, at::crc}));
    return out;
}

void read_header(std::span<const std::byte> header, const std::string& name, ObtMetadata& m,
                 HeaderPlaces& places) {
    const auto refuse = [&](const std::string& why) { throw InputError(name + ": " + why); };
    const std::byte* const h = header.data();
    if (header.size() < magic.size() || get_text(h, magic.size()) != magic)
        refuse("not a giant texture: it does not begin with OBSTEX");
    if (header.size() < data_start)
        refuse(fmt::format("ends after {} bytes, in its header of {}", header.size(), data_start));
    if (const auto v = get<std::uint32_t>(h + at::version); v != version)
        refuse(fmt::format("version {} of the format: allowed is {}", v, version));
    if (crc32c(header.first(at::crc)) != get<std::uint32_t>(h + at::crc))
        refuse("header: checksum at byte 4092 does not match: the file is damaged");
    if (get<std::uint32_t>(h + at::bytes) != header_bytes ||
        get<std::uint32_t>(h + at::tile) != tile_samples || get<std::uint32_t>(h + at::margin) != margin ||
        get<std::uint64_t>(h + at::data) != data_start)
        refuse("header: sizes of header and tiles: allowed are 4096 bytes, 256 samples and a margin of 2");
    const auto flags = get<std::uint32_t>(h + at::flags);
    m = {};
    m.kind = get_enum<ObtKind>(header, at::kind, "kind", name);
    m.type = get_enum<SampleType>(header, at::type, "sample type", name);
    m.registration = get_enum<Registration>(header, at::registration, "registration", name);
    m.height_meaning = get_enum<HeightMeaning>(header, at::height_meaning, "height meaning", name);
    m.projection.kind = get_enum<ProjectionKind>(header, at::projection, "projection", name);
    m.projection.latitudes = get_enum<Latitudes>(header, at::latitudes, "latitudes", name);
    m.lattice = (flags & lattice) != 0;
    m.rgb = (flags & rgb) != 0;
    m.planes = get<std::uint16_t>(h + at::planes);
    // Above the limit: negative.
    m.width = static_cast<std::int64_t>(get<std::uint64_t>(h + at::width));
    m.height = static_cast<std::int64_t>(get<std::uint64_t>(h + at::height));
    for (std::size_t i = 0; i < m.transform.size(); ++i)
        m.transform[i] = get<double>(h + at::transform + 8 * i);
    m.projection.equatorial_radius_m = get<double>(h + at::equatorial);
    m.projection.polar_radius_m = get<double>(h + at::polar);
    m.projection.centre_longitude_rad = get<double>(h + at::centre_longitude);
    m.projection.true_scale_latitude_rad = get<double>(h + at::true_scale);
    m.semi_axes_m = {get<double>(h + at::semi_axes), get<double>(h + at::semi_axes + 8),
                     get<double>(h + at::semi_axes + 16)};
    m.scale = get<double>(h + at::scale);
    m.offset = get<double>(h + at::offset);
    m.finest_exponent = get<std::int8_t>(h + at::exponents);
    m.coarsest_exponent = get<std::int8_t>(h + at::exponents + 1);
    if ((flags & has_nodata) != 0) m.nodata = get<std::int32_t>(h + at::nodata);
    for (std::size_t i = 0; i < m.uuid.size(); ++i)
        m.uuid[i] = std::to_integer<std::uint8_t>(h[at::uuid + i]);
    m.unit = get_text(h + at::unit, 32);
    m.title = get_text(h + at::title, 128);
    m.licence = get_text(h + at::licence, 128);
    m.source = get_text(h + at::source, 512);
    places.complete = (flags & complete) != 0;
    places.file_bytes = get<std::uint64_t>(h + at::file_bytes);
    places.shard_bytes = get<std::uint64_t>(h + at::shard_bytes);
    places.roots.clear();
    for (std::uint32_t p = 0; p < std::min(m.planes, max_obt_planes); ++p) {
        const std::byte* const from = h + at::planes_table + p * plane_bytes;
        places.roots.push_back({get<std::uint64_t>(from), get<std::uint32_t>(from + 8)});
        if ((flags & has_statistics) != 0)
            m.statistics.push_back({get<double>(from + 16), get<double>(from + 24), get<double>(from + 32),
                                    get<std::uint32_t>(from + 40) != 0});
    }
    validate(m, name);
    if (get<std::uint32_t>(h + at::levels) != static_cast<std::uint32_t>(obt_levels(m.width, m.height)))
        refuse(fmt::format("header: {} levels of {} x {} samples: they have {}",
                           get<std::uint32_t>(h + at::levels), m.width, m.height,
                           obt_levels(m.width, m.height)));
    const Layout layout(m, name);
    if (places.shard_bytes < page || places.shard_bytes % page != 0 || places.file_bytes > 2 * max_bytes)
        refuse(fmt::format("header: {} bytes in parts of {}: allowed are at most 2^61 in whole pages of 4096",
                           places.file_bytes, places.shard_bytes));
}

} // namespace obscura::terrain::obt
