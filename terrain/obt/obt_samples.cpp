// SPDX-License-Identifier: Apache-2.0
#include "terrain/obt/obt_samples.hpp"

#include "core/error.hpp"
#include "terrain/obt/crc32c.hpp"
#include "terrain/obt/half.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace obscura::terrain::obt {
namespace {

constexpr float no_data = std::numeric_limits<float>::quiet_NaN();

bool is_float(SampleType type) {
    return type == SampleType::f16 || type == SampleType::f32;
}

struct CodeRange {
    int least, largest;
};
CodeRange codes_of(SampleType type) {
    if (type == SampleType::u8) return {0, 255};
    if (type == SampleType::i16) return {-32768, 32767};
    return {0, 65535};
}

/// Whether base and codes of the range exist with steps of 2^exponent; the base.
std::optional<std::int32_t> base_of(double least, double largest, int exponent) {
    const double first = std::floor(std::ldexp(least, -exponent));
    const double last = std::ceil(std::ldexp(largest, -exponent));
    if (!(std::abs(first) < 0x1p30) || !(last - first <= lattice_nodata - 1)) return std::nullopt;
    return static_cast<std::int32_t>(first);
}

/// Bounds by the smallest step that has them.
void set_bounds(double least, double largest, Entry& entry) {
    int exponent = 0;
    const double most = std::max({std::abs(least), std::abs(largest), 0x1p-90});
    (void)std::frexp(std::max((largest - least) / lattice_nodata, most * 0x1p-30), &exponent);
    for (exponent = std::max(exponent - 1, -126); !base_of(least, largest, exponent); ++exponent) {
    }
    entry.exponent = static_cast<std::int8_t>(exponent);
    entry.base = *base_of(least, largest, exponent);
    const auto code = [&](double number) { return number - entry.base; };
    entry.least = static_cast<std::uint16_t>(code(std::floor(std::ldexp(least, -exponent))));
    entry.largest = static_cast<std::uint16_t>(code(std::ceil(std::ldexp(largest, -exponent))));
}

[[noreturn]] void refuse_sample(const TileName& tile, std::size_t sample, const std::string& name,
                                const std::string& why) {
    const auto place = [&](std::int64_t index, std::size_t at) {
        return index * tile_samples + static_cast<std::int64_t>(at) - margin;
    };
    throw InputError(fmt::format("{}: column {}, row {} of level {}, plane {}: {}", name,
                                 place(tile.i, sample % stored_tile_edge),
                                 place(tile.j, sample / stored_tile_edge), tile.level, tile.plane, why));
}

template<typename Convert>
void decode(const ObtMetadata& m, const Entry& entry, const std::byte* samples, std::size_t first,
            std::size_t count, float* out, const Convert& convert) noexcept {
    const auto fill = [&](auto number_at) {
        for (std::size_t k = 0; k < count; ++k)
            out[k] = number_at(first + k);
    };
    const auto finite = [&](float number) {
        return std::isfinite(number) ? convert(double{number}) : no_data;
    };
    if (entry.stored == Stored::constant) {
        const float value = is_float(m.type) ? finite(std::bit_cast<float>(entry.base))
                                             : convert(static_cast<double>(entry.base) * entry.step());
        std::fill(out, out + count, value);
    } else if (!entry.has_slot()) {
        std::fill(out, out + count, no_data);
    } else if (entry.stored == Stored::wide || m.type == SampleType::f32) {
        fill([&](std::size_t i) { return finite(get<float>(samples + 4 * i)); });
    } else if (m.type == SampleType::f16) {
        fill([&](std::size_t i) { return finite(float_of_half(get<std::uint16_t>(samples + 2 * i))); });
    } else if (m.lattice) {
        const double step = entry.step(), base = entry.base;
        const int hole = entry.holes ? lattice_nodata : -1;
        fill([&](std::size_t i) {
            const int code = get<std::uint16_t>(samples + 2 * i);
            return code == hole ? no_data : convert((base + code) * step);
        });
    } else {
        const int hole = m.nodata.value_or(1 << 20);
        const auto value = [&](int code) { return code == hole ? no_data : convert(code); };
        if (m.type == SampleType::u8)
            fill([&](std::size_t i) { return value(std::to_integer<int>(samples[i])); });
        else if (m.type == SampleType::i16)
            fill([&](std::size_t i) { return value(get<std::int16_t>(samples + 2 * i)); });
        else
            fill([&](std::size_t i) { return value(get<std::uint16_t>(samples + 2 * i)); });
    }
}

/// Encodes whole numbers where each one rounds to a code that is allowed and not that of missing samples;
/// false: some do not.
template<typename Code>
bool encode_plain_codes(std::span<const float> numbers, CodeRange range, int nodata, std::byte* out) {
    const auto least = static_cast<float>(range.least), largest = static_cast<float>(range.largest);
    unsigned odd = 0;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const float v = numbers[i];
        const bool near = v > least - 1 && v < largest + 1; // not if there is no number
        const float number = near ? v : 0;
        // As std::round: to the nearest one, halves away from 0.
        const int whole = static_cast<int>(number);
        const float rest = number - static_cast<float>(whole);
        const int code = whole + (rest >= 0.5F ? 1 : 0) - (rest <= -0.5F ? 1 : 0);
        odd |= static_cast<unsigned>(!near) | static_cast<unsigned>(code == nodata) |
               static_cast<unsigned>(code < range.least) | static_cast<unsigned>(code > range.largest);
        put(out + sizeof(Code) * i, static_cast<Code>(code));
    }
    return odd == 0;
}

/// Encodes whole numbers (u8, i16, u16).
void encode_codes(const ObtMetadata& m, const TileName& tile, std::span<const float> numbers,
                  const std::string& name, EncodedTile& out) {
    const CodeRange range = codes_of(m.type);
    const int hole = m.nodata.value_or(1 << 20);
    if (m.type == SampleType::u8 ? encode_plain_codes<std::uint8_t>(numbers, range, hole, out.bytes.data())
                                 : encode_plain_codes<std::uint16_t>(numbers, range, hole, out.bytes.data()))
        return;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        int code = 0;
        if (std::isnan(numbers[i])) {
            if (!m.nodata)
                refuse_sample(tile, i, name, "no data: allowed with a number for missing samples only");
            code = *m.nodata;
        } else {
            const float rounded = std::round(numbers[i]);
            if (!(rounded >= static_cast<float>(range.least) && rounded <= static_cast<float>(range.largest)))
                refuse_sample(
                    tile, i, name,
                    fmt::format("{}: allowed are {} to {}", numbers[i], range.least, range.largest));
            code = static_cast<int>(rounded);
            if (code == m.nodata) {
                // The mean of valid samples may round to it.
                if (tile.level == 0)
                    refuse_sample(tile, i, name, fmt::format("{}: the number of missing samples", code));
                code += code < range.largest ? 1 : -1;
            }
        }
        if (m.type == SampleType::u8)
            out.bytes[i] = static_cast<std::byte>(code);
        else
            put(out.bytes.data() + 2 * i, static_cast<std::uint16_t>(code));
    }
}

} // namespace

void TileFacts::add(const TileFacts& other) {
    least = std::min(least, other.least);
    largest = std::max(largest, other.largest);
    error = std::max(error, other.error);
}

std::size_t sample_bytes(const ObtMetadata& metadata, const Entry& entry) {
    return tile_count * (entry.stored == Stored::wide ? sizeof(float) : terrain::bytes_of(metadata.type));
}

std::uint32_t crc_of(const Entry& entry, std::span<const std::byte> samples) {
    const EntryBytes bytes = bytes_of(entry);
    return crc32c(samples, crc32c(std::span(bytes).first(entry_crc)));
}

namespace {

/// Numbers of a tile, and what is known of them before they are encoded.
struct TileNumbers {
    std::span<const float> numbers;
    double least, largest; ///< as the type can state them
    bool constant;
};

/// Samples of the types f32 and f16.
void encode_floats(const ObtMetadata& m, const TileNumbers& tile, EncodedTile& out) {
    const auto& [numbers, least, largest, constant] = tile;
    Entry& entry = out.entry;
    set_bounds(least, largest, entry);
    if (constant) {
        entry.stored = Stored::constant;
        entry.exponent = 0;
        entry.least = entry.largest = 0;
        entry.base = std::bit_cast<std::int32_t>(static_cast<float>(least));
    } else {
        entry.stored = Stored::samples;
        out.bytes.resize(sample_bytes(m, entry));
        for (std::size_t i = 0; i < numbers.size(); ++i)
            if (m.type == SampleType::f32)
                put(out.bytes.data() + 4 * i, numbers[i]);
            else
                put(out.bytes.data() + 2 * i, half_of_float(numbers[i]));
    }
}

/// Codes on a lattice whose step is as fine as the range of the tile allows; wide where none does. Moves the
/// bounds onto the lattice.
void encode_lattice(const ObtMetadata& m, const TileFacts& facts, TileNumbers& tile, EncodedTile& out) {
    auto& [numbers, least, largest, constant] = tile;
    Entry& entry = out.entry;
    std::optional<std::int32_t> base;
    int exponent = m.finest_exponent;
    while (!(base = base_of(least, largest, exponent)) && exponent < m.coarsest_exponent)
        ++exponent;
    if (!base) {
        entry.stored = Stored::wide;
        set_bounds(least, largest, entry);
        out.bytes.resize(sample_bytes(m, entry));
        for (std::size_t i = 0; i < numbers.size(); ++i)
            put(out.bytes.data() + 4 * i, numbers[i]);
    } else {
        entry.exponent = static_cast<std::int8_t>(exponent);
        entry.base = *base;
        const double scale = std::ldexp(1.0, -exponent);
        const auto code_of = [&](double v) {
            return static_cast<std::uint16_t>(
                std::clamp(std::nearbyint(v * scale) - *base, 0.0, lattice_nodata - 1.0));
        };
        least = (static_cast<double>(*base) + code_of(least)) * entry.step();
        largest = (static_cast<double>(*base) + code_of(largest)) * entry.step();
        entry.least = static_cast<std::uint16_t>(std::floor(facts.least * scale) - *base);
        entry.largest = static_cast<std::uint16_t>(std::ceil(facts.largest * scale) - *base);
        if (constant) {
            entry.stored = Stored::constant;
            entry.base = *base + code_of(facts.least);
            entry.least = entry.largest = 0;
        } else {
            entry.stored = Stored::samples;
            out.bytes.resize(sample_bytes(m, entry));
            for (std::size_t i = 0; i < numbers.size(); ++i)
                put(out.bytes.data() + 2 * i,
                    std::isnan(numbers[i]) ? lattice_nodata : code_of(static_cast<double>(numbers[i])));
        }
    }
}

/// Whole numbers as they are.
void encode_integers(const ObtMetadata& m, const TileName& name, const TileNumbers& tile,
                     const std::string& file, EncodedTile& out) {
    const auto& [numbers, least, largest, constant] = tile;
    Entry& entry = out.entry;
    entry.stored = Stored::samples;
    out.bytes.resize(sample_bytes(m, entry));
    encode_codes(m, name, numbers, file, out);
    entry.base = codes_of(m.type).least;
    entry.least = static_cast<std::uint16_t>(least - entry.base);
    entry.largest = static_cast<std::uint16_t>(largest - entry.base);
    if (constant) {
        entry.stored = Stored::constant;
        entry.base = static_cast<std::int32_t>(least);
        entry.least = entry.largest = 0;
        out.bytes.clear();
    }
}

} // namespace

void encode(const ObtMetadata& m, const TileName& tile, std::span<const float> numbers,
            const TileFacts& below, const std::string& name, EncodedTile& out) {
    Entry& entry = out.entry;
    entry = {};
    out.bytes.clear();
    const bool missing = std::all_of(numbers.begin(), numbers.end(), [](float v) { return std::isnan(v); });
    TileFacts facts = below;
    if (!below.any()) // samples in the margin at most
        for (const float v : numbers)
            if (!std::isnan(v)) facts.add({double{v}, double{v}, 0});
    if (missing && !facts.any()) {
        if (!is_float(m.type) && !m.lattice && !m.nodata)
            refuse_sample(tile, 0, name, "no data: allowed with a number for missing samples only");
        entry.stored = Stored::missing;
        return;
    }
    // One pass without branches tells whether any sample is not finite.
    constexpr std::uint32_t exponent_bits = 0x7F800000;
    std::uint32_t not_finite = 0;
    for (const float v : numbers)
        not_finite |= (std::bit_cast<std::uint32_t>(v) & exponent_bits) == exponent_bits ? 1U : 0U;
    if (not_finite != 0)
        for (std::size_t i = 0; i < numbers.size(); ++i)
            if (std::isinf(numbers[i])) refuse_sample(tile, i, name, "infinite: allowed are finite numbers");
    double least = facts.least, largest = facts.largest;
    entry.error = std::nextafter(static_cast<float>(facts.error), std::numeric_limits<float>::max());
    if (facts.error == 0) entry.error = 0;
    const auto as_half = [](double v) {
        return static_cast<double>(float_of_half(half_of_float(static_cast<float>(v))));
    };
    if (m.type == SampleType::f16) {
        least = as_half(least);
        largest = as_half(largest);
        if (!std::isfinite(least) || !std::isfinite(largest))
            refuse_sample(tile, 0, name,
                          fmt::format("f16 numbers in {} to {}: allowed are -65504 to 65504", facts.least,
                                      facts.largest));
    } else if (!is_float(m.type) && !m.lattice) {
        least = std::round(least);
        largest = std::round(largest);
    }
    entry.holes = not_finite != 0;
    const bool constant =
        !entry.holes && facts.least == facts.largest && static_cast<float>(facts.least) == numbers[0] &&
        std::all_of(numbers.begin(), numbers.end(), [&](float v) { return v == numbers[0]; });

    TileNumbers values{numbers, least, largest, constant};
    if (is_float(m.type))
        encode_floats(m, values, out);
    else if (m.lattice)
        encode_lattice(m, facts, values, out);
    else
        encode_integers(m, tile, values, name, out);
    out.least = values.least;
    out.largest = values.largest;
}

void decode_numbers(const ObtMetadata& metadata, const Entry& entry, const std::byte* samples,
                    std::size_t first, std::size_t count, float* out) noexcept {
    decode(metadata, entry, samples, first, count, out, [](double v) { return static_cast<float>(v); });
}

void decode_values(const ObtMetadata& metadata, const Entry& entry, const std::byte* samples,
                   std::size_t first, std::size_t count, float* out) noexcept {
    if (metadata.scale == 1 && metadata.offset == 0)
        decode_numbers(metadata, entry, samples, first, count, out);
    else
        decode(metadata, entry, samples, first, count, out,
               [&](double v) { return static_cast<float>(metadata.offset + metadata.scale * v); });
}

TileFacts facts_of(const ObtMetadata& metadata, const Entry& entry) {
    if (entry.stored == Stored::absent || entry.stored == Stored::missing) return {};
    if (entry.stored == Stored::constant && is_float(metadata.type)) {
        const double v = static_cast<double>(std::bit_cast<float>(entry.base));
        return {v, v, entry.error};
    }
    return {entry.min_number(), entry.largest_number(), entry.error};
}

} // namespace obscura::terrain::obt
