// SPDX-License-Identifier: Apache-2.0
// Giant textures written and read again: all sample types, levels against plain means, layout by brute force.
#include "core/error.hpp"
#include "obt_support.hpp"
#include "terrain/obt/crc32c.hpp"
#include "terrain/obt/half.hpp"
#include "terrain/obt/obt_file.hpp"
#include "terrain/obt/obt_tile_writer.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <string_view>
#include <vector>

namespace obt_test {

using namespace obscura;
using namespace obscura::terrain;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;

namespace {

float hills(std::uint32_t plane, std::int64_t x, std::int64_t y) {
    const auto u = static_cast<double>(x), v = static_cast<double>(y);
    return static_cast<float>(900 * std::sin(u / 91 + plane) * std::cos(v / 57) +
                              40 * std::sin(u / 3.1 - v / 4.7)) +
           noise_at(plane, x, y);
}

std::vector<float> level_of(const ObtFile& file, int level, std::uint32_t plane = 0) {
    const auto w = static_cast<int>(file.width(level)), h = static_cast<int>(file.height(level));
    std::vector<float> out(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
    file.read(plane, level, 0, 0, w, h, out);
    return out;
}

/// Mean of the finest samples that a sample of a pixel-registered level stands for.
double box_mean(const FunctionSource::Function& f, std::uint32_t plane, int level, std::int64_t i,
                std::int64_t j, std::int64_t width, std::int64_t height) {
    double sum = 0, count = 0;
    for (std::int64_t y = j << level; y < std::min(height, (j + 1) << level); ++y)
        for (std::int64_t x = i << level; x < std::min(width, (i + 1) << level); ++x) {
            const float v = f(plane, x, y);
            if (std::isnan(v)) continue;
            sum += static_cast<double>(v);
            ++count;
        }
    return sum / count;
}

} // namespace

TEST_CASE("CRC-32C has the check value of RFC 3720, by instruction and by tables") {
    std::vector<std::byte> text;
    for (const char c : std::string_view("123456789"))
        text.push_back(static_cast<std::byte>(c));
    CHECK(crc32c(text) == 0xE3069283);
    CHECK(crc32c_by_tables(text) == 0xE3069283);
    const std::vector<std::byte> zeros(32);
    CHECK(crc32c(zeros) == 0x8A9136AA);
    std::vector<std::byte> random;
    for (int i = 0; i < 1001; ++i)
        random.push_back(static_cast<std::byte>(noise_at(0, i, 7) * 256));
    for (std::size_t cut = 0; cut < 20; ++cut) {
        const auto all = std::span(random).subspan(cut);
        CHECK(crc32c(all) == crc32c_by_tables(all));
        CHECK(crc32c(all.subspan(cut), crc32c(all.first(cut))) == crc32c(all));
    }
}

TEST_CASE("All halves survive float, and floats take the nearest half") {
    for (std::uint32_t h = 0; h < 65536; ++h) {
        const float f = float_of_half(static_cast<std::uint16_t>(h));
        if (std::isnan(f)) continue;
        REQUIRE(half_of_float(f) == h);
        if ((h & 0x7FFFU) >= 0x7BFF) continue;
        // Halfway to the next: to the even one.
        const float next = float_of_half(static_cast<std::uint16_t>(h + 1));
        const float middle = 0.5F * (f + next);
        REQUIRE(half_of_float(middle) == ((h & 1U) != 0 ? h + 1 : h));
        REQUIRE(half_of_float(std::nextafter(middle, f)) == h);
        REQUIRE(half_of_float(std::nextafter(middle, next)) == h + 1);
    }
    CHECK(float_of_half(0x3C00) == 1);
    CHECK(float_of_half(0xC000) == -2);
    CHECK(half_of_float(65504) == 0x7BFF);
    CHECK(half_of_float(65520) == 0x7C00);
}

TEST_CASE("Slots of tiles follow on each other, coarse levels first, in Morton order") {
    ObtMetadata m = planar_metadata(SampleType::u16, 5000, 1700, 2);
    m.kind = ObtKind::parameter;
    const obt::Layout layout(m, "test");
    std::uint64_t place = obt::data_start;
    for (int level = layout.levels() - 1; level >= 0; --level) {
        std::map<std::uint64_t, std::pair<std::int64_t, std::int64_t>> order;
        for (std::int64_t j = 0; j < layout.tiles_down(level); ++j)
            for (std::int64_t i = 0; i < layout.tiles_across(level); ++i) {
                std::uint64_t code = 0;
                for (unsigned bit = 0; bit < 16; ++bit)
                    code |= static_cast<std::uint64_t>(i >> bit & 1) << (2 * bit) |
                            static_cast<std::uint64_t>(j >> bit & 1) << (2 * bit + 1);
                order[code] = {i, j};
            }
        for (const auto& [code, at] : order)
            for (std::uint32_t plane = 0; plane < 2; ++plane) {
                REQUIRE(layout.slot_place({plane, level, at.first, at.second}) == place);
                place += layout.slot_bytes();
            }
    }
    CHECK(layout.block_place({0, 0, 0, 0}) == place);
}

TEST_CASE("Whole numbers come back as they were written, with levels that are their means") {
    const TempFolder folder;
    const auto type = GENERATE(SampleType::u8, SampleType::i16, SampleType::u16);
    const double range = type == SampleType::u8 ? 256 : 65536, least = type == SampleType::i16 ? -32768 : 0;
    const auto f = [&](std::uint32_t plane, std::int64_t x, std::int64_t y) {
        return static_cast<float>(std::floor(static_cast<double>(noise_at(plane, x, y)) * range + least));
    };
    FunctionSource source(f);
    ObtMetadata m = planar_metadata(type, 1301, 777, 3);
    m.scale = 0.5;
    m.offset = -7;
    m.title = "A \"test\"";
    const auto file = folder.path() / "a.obt";
    const ObtWriteReport report = write_obt(file, m, source);
    CHECK(report.finished);
    CHECK(report.tiles == 3U * (6 * 4 + 3 * 2 + 2 * 1 + 1));
    CHECK_FALSE(std::filesystem::exists(file.string() + ".part"));
    const ObtFile read(file);
    CHECK(read.metadata() == report.metadata);
    CHECK(read.metadata().title == m.title);
    CHECK(read.levels() == 4);
    for (std::uint32_t plane = 0; plane < 3; ++plane) {
        const std::vector<float> finest = level_of(read, 0, plane);
        float lowest = finest[0], highest = finest[0];
        for (std::int64_t y = 0; y < 777; ++y)
            for (std::int64_t x = 0; x < 1301; ++x) {
                const float v = finest[static_cast<std::size_t>(y * 1301 + x)];
                REQUIRE(v == 0.5F * f(plane, x, y) - 7);
                lowest = std::min(lowest, v);
                highest = std::max(highest, v);
            }
        const ObtPlaneStatistics s = read.statistics(plane);
        CHECK(s.least == static_cast<double>(lowest));
        CHECK(s.largest == static_cast<double>(highest));
        const double mean = box_mean(f, plane, 12, 0, 0, 1301, 777);
        CHECK_THAT(s.mean, WithinAbs(0.5 * mean - 7, 0.01 * range / 256));
        for (int level = 1; level < 4; ++level) {
            const std::vector<float> coarse = level_of(read, level, plane);
            for (std::int64_t j = 0; j < read.height(level); j += 13)
                for (std::int64_t i = read.width(level) - 1; i >= 0; i -= 11)
                    REQUIRE_THAT(
                        static_cast<double>(coarse[static_cast<std::size_t>(j * read.width(level) + i)]),
                        WithinAbs(0.5 * box_mean(f, plane, level, i, j, 1301, 777) - 7, 0.2501));
        }
    }
    CHECK(read.check().damaged == 0);
    CHECK(read.check().tiles == report.tiles);
}

TEST_CASE("f32 samples come back bit for bit and missing ones as NaN") {
    const TempFolder folder;
    const auto f = [](std::uint32_t plane, std::int64_t x, std::int64_t y) {
        return x > 200 && x < 700 && y > 100 && y < 650 ? std::numeric_limits<float>::quiet_NaN()
                                                        : hills(plane, x, y);
    };
    FunctionSource source(f);
    const auto file = folder.path() / "a.obt";
    const ObtWriteReport report = write_obt(file, planar_metadata(SampleType::f32, 900, 801), source);
    const ObtFile read(file);
    const std::vector<float> finest = level_of(read, 0);
    double lowest = 1e9, highest = -1e9;
    for (std::int64_t y = 0; y < 801; ++y)
        for (std::int64_t x = 0; x < 900; ++x) {
            const float v = finest[static_cast<std::size_t>(y * 900 + x)], expected = f(0, x, y);
            REQUIRE((v == expected || (std::isnan(v) && std::isnan(expected))));
            if (std::isnan(v)) continue;
            lowest = std::min(lowest, static_cast<double>(v));
            highest = std::max(highest, static_cast<double>(v));
        }
    CHECK(read.statistics(0).least == lowest);
    CHECK(read.statistics(0).largest == highest);
    const std::vector<float> coarse = level_of(read, 1);
    for (std::int64_t j = 0; j < read.height(1); ++j)
        for (std::int64_t i = 0; i < read.width(1); ++i) {
            const double mean = box_mean(f, 0, 1, i, j, 900, 801);
            const auto v = static_cast<double>(coarse[static_cast<std::size_t>(j * read.width(1) + i)]);
            if (std::isnan(mean))
                REQUIRE(std::isnan(v));
            else
                REQUIRE_THAT(v, WithinAbs(mean, 1e-4));
        }
    CHECK(read.entry({0, 0, 1, 1}).stored == obt::Stored::missing);
    CHECK(report.constant == 1);
    // Any part of the raster, over borders of tiles.
    std::vector<float> part(70 * 333);
    read.read(0, 229, 411, 70, 333, part);
    for (int y = 0; y < 333; ++y)
        for (int x = 0; x < 70; ++x) {
            const float expected = f(0, 229 + x, 411 + y), v = part[static_cast<std::size_t>(y * 70 + x)];
            REQUIRE((v == expected || (std::isnan(v) && std::isnan(expected))));
        }
    CHECK_THROWS_AS(read.read(0, 899, 0, 2, 1, part), std::out_of_range);
    CHECK(read.check().damaged == 0);
}

TEST_CASE("Halves are within half a unit of their last place") {
    const TempFolder folder;
    FunctionSource source(hills);
    const auto file = folder.path() / "a.obt";
    (void)write_obt(file, planar_metadata(SampleType::f16, 500, 300), source);
    const ObtFile read(file);
    const std::vector<float> finest = level_of(read, 0);
    for (std::int64_t y = 0; y < 300; ++y)
        for (std::int64_t x = 0; x < 500; ++x) {
            const float v = hills(0, x, y);
            REQUIRE(std::abs(finest[static_cast<std::size_t>(y * 500 + x)] - v) <= std::abs(v) * 0x1p-11F);
        }
    CHECK(read.check().damaged == 0);
}

TEST_CASE("Lattices of heights take the finest step that spans a tile, and f32 beyond the coarsest") {
    const TempFolder folder;
    // Smooth on the left, a cliff of 9 km in the middle, one of 200 km on the right.
    const auto f = [](std::uint32_t plane, std::int64_t x, std::int64_t y) {
        return hills(plane, x, y) + (x % 512 > 256 ? static_cast<float>(x / 512) * 9000 : 0) +
               (x > 1300 ? 200000.F * noise_at(1, x, y) : 0);
    };
    FunctionSource source(f);
    ObtMetadata m = planar_metadata(SampleType::u16, 1500, 600);
    m.lattice = true;
    m.offset = 1737400;
    const auto file = folder.path() / "a.obt";
    const ObtWriteReport report = write_obt(file, m, source);
    CHECK(report.wide > 0);
    const ObtFile read(file);
    CHECK(read.entry({0, 0, 0, 0}).exponent == -4);
    CHECK(read.entry({0, 0, 5, 0}).stored == obt::Stored::wide);
    std::vector<float> numbers(obt::tile_count);
    bool coarser = false;
    for (int level = 0; level < read.levels(); ++level)
        for (std::int64_t j = 0; j < read.layout().tiles_down(level); ++j)
            for (std::int64_t i = 0; i < read.layout().tiles_across(level); ++i) {
                const obt::TileName name{0, level, i, j};
                const ObtTile tile = read.tile(name);
                const obt::TileFacts facts = read.bounds(name);
                obt::decode_numbers(read.metadata(), tile.entry, tile.samples.data(), 0, obt::tile_count,
                                    numbers.data());
                const bool wide = tile.entry.stored == obt::Stored::wide;
                coarser = coarser || (!wide && tile.entry.exponent > -4);
                // All finest samples below a tile are within its bounds, and level 0 within half a step.
                for (std::int64_t y = (j * 256) << level;
                     y < std::min<std::int64_t>(600, ((j + 1) * 256) << level); ++y)
                    for (std::int64_t x = (i * 256) << level;
                         x < std::min<std::int64_t>(1500, ((i + 1) * 256) << level); ++x) {
                        const auto v = static_cast<double>(f(0, x, y));
                        REQUIRE(v + m.offset >= facts.least);
                        REQUIRE(v + m.offset <= facts.largest);
                        if (level > 0) continue;
                        const auto got = static_cast<double>(
                            numbers[static_cast<std::size_t>((y - j * 256 + 2) * 260 + x - i * 256 + 2)]);
                        REQUIRE(std::abs(got - v) <= (wide ? 0 : 0.5 * tile.entry.step()));
                    }
            }
    CHECK(coarser);
    CHECK(read.check().damaged == 0);
}

TEST_CASE("The error of a tile is not less than its distance from the finest samples") {
    const TempFolder folder;
    FunctionSource source(hills);
    const auto file = folder.path() / "a.obt";
    (void)write_obt(file, planar_metadata(SampleType::f32, 1024, 512), source);
    const ObtFile read(file);
    CHECK(read.entry({0, 0, 1, 1}).error == 0);
    for (int level = 1; level < read.levels(); ++level) {
        const std::vector<float> coarse = level_of(read, level);
        const auto w = read.width(level), h = read.height(level);
        double largest = 0;
        for (std::int64_t y = 256; y < 300; ++y)
            for (std::int64_t x = 300; x < 500; ++x) {
                const double u = (static_cast<double>(x) + 0.5) / (1 << level) - 0.5;
                const double v = (static_cast<double>(y) + 0.5) / (1 << level) - 0.5;
                const auto i = static_cast<std::int64_t>(u), j = static_cast<std::int64_t>(v);
                const auto at = [&](std::int64_t a, std::int64_t b) {
                    return static_cast<double>(
                        coarse[static_cast<std::size_t>(std::min(b, h - 1) * w + std::min(a, w - 1))]);
                };
                const double fx = u - static_cast<double>(i), fy = v - static_cast<double>(j);
                const double value = (1 - fy) * ((1 - fx) * at(i, j) + fx * at(i + 1, j)) +
                                     fy * ((1 - fx) * at(i, j + 1) + fx * at(i + 1, j + 1));
                largest = std::max(largest, std::abs(value - static_cast<double>(hills(0, x, y))));
            }
        double stated = 0;
        for (std::int64_t i = 0; i < read.layout().tiles_across(level); ++i)
            for (std::int64_t j = 0; j < read.layout().tiles_down(level); ++j)
                stated = std::max(stated, static_cast<double>(read.entry({0, level, i, j}).error));
        CHECK(largest > 0);
        CHECK(stated >= largest);
    }
}

TEST_CASE("Node-registered levels weigh their neighbours 1 2 1") {
    const TempFolder folder;
    FunctionSource source(hills);
    ObtMetadata m = planar_metadata(SampleType::f32, 601, 401);
    m.registration = Registration::node;
    const auto file = folder.path() / "a.obt";
    (void)write_obt(file, m, source);
    const ObtFile read(file);
    CHECK(read.width(1) == 301);
    const std::vector<float> coarse = level_of(read, 1);
    for (std::int64_t j = 1; j < 200; ++j)
        for (std::int64_t i = 1; i < 300; ++i) {
            double sum = 0;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx)
                    sum += (2 - std::abs(dx)) * (2 - std::abs(dy)) *
                           static_cast<double>(hills(0, 2 * i + dx, 2 * j + dy));
            REQUIRE_THAT(static_cast<double>(coarse[static_cast<std::size_t>(j * 301 + i)]),
                         WithinAbs(sum / 16, 1e-4));
        }
}

TEST_CASE("Margins repeat the samples of the neighbours, on all levels") {
    const TempFolder folder;
    FunctionSource source(hills);
    const auto file = folder.path() / "a.obt";
    // More than one block of the builder, and more than one pass.
    const ObtWriteReport report = write_obt(file, planar_metadata(SampleType::f32, 9000, 300), source);
    const ObtFile read(file);
    CHECK(report.finished);
    CHECK(read.levels() == 7);
    std::vector<float> numbers(obt::tile_count);
    for (int level = 0; level < read.levels(); ++level) {
        const std::vector<float> whole = level_of(read, level);
        const std::int64_t w = read.width(level), h = read.height(level);
        for (std::int64_t j = 0; j < read.layout().tiles_down(level); ++j)
            for (std::int64_t i = 0; i < read.layout().tiles_across(level); ++i) {
                const ObtTile tile = read.tile({0, level, i, j});
                obt::decode_numbers(read.metadata(), tile.entry, tile.samples.data(), 0, obt::tile_count,
                                    numbers.data());
                for (std::int64_t y = 0; y < 260; ++y)
                    for (std::int64_t x = 0; x < 260; ++x) {
                        const std::int64_t at_x = std::clamp<std::int64_t>(i * 256 + x - 2, 0, w - 1);
                        const std::int64_t at_y = std::clamp<std::int64_t>(j * 256 + y - 2, 0, h - 1);
                        REQUIRE(numbers[static_cast<std::size_t>(y * 260 + x)] ==
                                whole[static_cast<std::size_t>(at_y * w + at_x)]);
                    }
            }
        if (level == 0) continue;
        for (std::int64_t x = 0; x < w; x += 7)
            REQUIRE_THAT(static_cast<double>(whole[static_cast<std::size_t>(x)]),
                         WithinAbs(box_mean(hills, 0, level, x, 0, 9000, 300), 1e-3));
    }
}

TEST_CASE("A raster of one number takes no slot") {
    const TempFolder folder;
    const auto type = GENERATE(SampleType::u8, SampleType::u16, SampleType::f32);
    FunctionSource source([](auto, auto, auto) { return 17.F; });
    ObtMetadata m = planar_metadata(type, 3000, 3000);
    m.lattice = type == SampleType::u16;
    const auto file = folder.path() / "a.obt";
    const ObtWriteReport report = write_obt(file, m, source);
    CHECK(report.tiles == 0);
    const ObtFile read(file);
    const std::vector<float> level = level_of(read, 2);
    CHECK(std::all_of(level.begin(), level.end(), [](float v) { return v == 17; }));
    CHECK(read.least() == 17);
    CHECK(read.statistics(0).mean == 17);
}

TEST_CASE("Absent tiles take the coarser level, interpolated") {
    const TempFolder folder;
    const auto file = folder.path() / "a.obt";
    ObtTileWriter writer(file, planar_metadata(SampleType::f32, 1024, 1024), std::uint64_t{1} << 40, false);
    std::vector<float> numbers(obt::tile_count);
    for (std::size_t k = 0; k < numbers.size(); ++k)
        numbers[k] = static_cast<float>(k % 260) - 2; // the column
    writer.write({0, 2, 0, 0}, numbers, {0, 255, 0});
    std::fill(numbers.begin(), numbers.end(), 5000.F);
    writer.write({0, 0, 1, 1}, numbers, {5000, 5000, 0});
    (void)writer.finish();
    const ObtFile read(file);
    const std::vector<float> finest = level_of(read, 0);
    CHECK(finest[300 * 1024 + 300] == 5000);
    for (std::int64_t x = 6; x < 1018; ++x)
        REQUIRE_THAT(static_cast<double>(finest[static_cast<std::size_t>(700 * 1024 + x)]),
                     WithinAbs((static_cast<double>(x) + 0.5) / 4 - 0.5, 1e-4));
    CHECK(read.bounds({0, 0, 0, 0}).any() == false);
}

} // namespace obt_test
