// SPDX-License-Identifier: Apache-2.0
// What tiles of giant textures are made with: against the definitions, and on any number of threads.
#include "obt_support.hpp"
#include "terrain/obt/obt_reduction.hpp"
#include "terrain/obt/obt_samples.hpp"
#include "terrain/obt/worker_team.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <random>

namespace obt_kernels_test {

using namespace obscura;
using namespace obscura::terrain;
using namespace obscura::terrain::obt;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();

/// A level between two of a block, at a place of the finer one.
double interpolated(const SampleBlock& coarse, Registration registration, std::int64_t x, std::int64_t y) {
    const auto place = [&](std::int64_t index) {
        return registration == Registration::node ? 0.5 * static_cast<double>(index)
                                                  : 0.5 * static_cast<double>(index) - 0.25;
    };
    const double left = std::floor(place(x)), top = std::floor(place(y));
    const double t = place(x) - left, u = place(y) - top;
    const auto at = [&](double column, double row) {
        return static_cast<double>(coarse.at(
            std::clamp<std::int64_t>(static_cast<std::int64_t>(column), coarse.x,
                                     coarse.x + coarse.columns - 1),
            std::clamp<std::int64_t>(static_cast<std::int64_t>(row), coarse.y, coarse.y + coarse.rows - 1)));
    };
    const auto column = [&](double c) { return at(c, top) * (1 - u) + (u > 0 ? at(c, top + 1) * u : 0); };
    return column(left) * (1 - t) + (t > 0 ? column(left + 1) * t : 0);
}

} // namespace

TEST_CASE("The largest difference between levels is that of a search") {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> uniform(-100, 100);
    for (const Registration registration : {Registration::pixel, Registration::node})
        for (const bool holes : {false, true})
            for (int k = 0; k < 40; ++k) {
                SampleBlock fine{0, 2 * (k % 3), 0, 30 + k % 7, 21 + k % 5, {}}, coarse;
                fine.samples.resize(static_cast<std::size_t>(fine.columns * fine.rows));
                for (float& v : fine.samples)
                    v = holes && random() % 20 == 0 ? none : uniform(random);
                const std::int64_t width = fine.x + fine.columns, height = fine.rows;
                reduce(fine, registration, width, height, coarse);
                const std::int64_t x0 = fine.x + 2 * (k % 2), y0 = k % 4, x1 = width - k % 3, y1 = height;
                double wanted = 0;
                for (std::int64_t y = y0; y < y1; ++y)
                    for (std::int64_t x = x0; x < x1; ++x) {
                        const double there = interpolated(coarse, registration, x, y);
                        const double difference = std::abs(there - static_cast<double>(fine.at(x, y)));
                        if (difference > wanted) wanted = difference;
                    }
                INFO("case " << k << ", holes " << holes);
                CHECK(largest_difference(fine, coarse, registration, x0, y0, x1, y1) ==
                      Approx(wanted).epsilon(1e-12));
            }
}

TEST_CASE("Numbers take the nearest code, halves away from zero, and never that of missing samples") {
    std::mt19937 random(7);
    for (const SampleType type : {SampleType::u8, SampleType::i16, SampleType::u16}) {
        ObtMetadata m = planar_metadata(type, 256, 256);
        const int least = type == SampleType::i16 ? -32768 : 0;
        const int largest = type == SampleType::u8 ? 255 : type == SampleType::i16 ? 32767 : 65535;
        for (const bool missing : {false, true}) {
            m.nodata.reset();
            if (missing) m.nodata = least + 3;
            std::vector<float> numbers(tile_count);
            for (std::size_t i = 0; i < numbers.size(); ++i)
                numbers[i] =
                    static_cast<float>(least) + 4 +
                    static_cast<float>(random() % static_cast<unsigned>(2 * (largest - least - 4))) / 2;
            const float edges[] = {0.49999997F, 1.5F, 2.5F, 3.49999976F, static_cast<float>(largest) + 0.4F};
            std::copy(std::begin(edges), std::end(edges), numbers.begin() + 100);
            if (missing) numbers[200] = none;
            numbers[0] = static_cast<float>(least) + 4;
            TileFacts facts{static_cast<double>(numbers[0]), static_cast<double>(largest), 0};
            EncodedTile tile;
            encode(m, {0, 1, 0, 0}, numbers, facts, "test.obt", tile);
            std::vector<float> back(tile_count);
            decode_numbers(m, tile.entry, tile.bytes.data(), 0, tile_count, back.data());
            for (std::size_t i = 0; i < numbers.size(); ++i) {
                float wanted = std::round(numbers[i]);
                if (missing && wanted == static_cast<float>(least) + 3) wanted += 1;
                if (std::isnan(numbers[i]))
                    REQUIRE(std::isnan(back[i]));
                else
                    REQUIRE(back[i] == wanted);
            }
        }
        std::vector<float> beyond(tile_count, 7);
        beyond[5 * stored_tile_edge + 9] = static_cast<float>(largest) + 0.6F;
        EncodedTile tile;
        CHECK_THROWS_WITH(encode(m, {0, 0, 1, 0}, beyond, {7, 7, 0}, "test.obt", tile),
                          ContainsSubstring("column 263, row 3 of level 0"));
    }
}

TEST_CASE("A texture has the same bytes whatever number of threads makes its tiles") {
    const TempFolder folder;
    ObtMetadata lattice = planar_metadata(SampleType::u16, 1500, 900);
    lattice.lattice = true;
    lattice.finest_exponent = -6;
    lattice.coarsest_exponent = -2;
    for (const ObtMetadata& m : {planar_metadata(SampleType::i16, 1500, 900), lattice}) {
        std::string first;
        for (const unsigned threads : {1U, 2U, 7U}) {
            // Steep in places: tiles of the lattice that hold f32, whose order is theirs in the file.
            FunctionSource source([](std::uint32_t plane, std::int64_t x, std::int64_t y) {
                return std::floor((x % 700 < 300 ? 20000.F : 100.F) * noise_at(plane, x, y));
            });
            ObtWriteOptions options;
            options.threads = threads;
            const auto report = write_obt(folder.path() / "t.obt", m, source, options);
            if (m.lattice) CHECK(report.wide > 4);
            std::ifstream in(folder.path() / "t.obt", std::ios::binary);
            const std::string bytes{std::istreambuf_iterator<char>(in), {}};
            if (first.empty()) first = bytes;
            CHECK(bytes == first);
        }
    }
}

TEST_CASE("Of several failures, that of the first piece of work is reported, and all before it are done") {
    struct Nothing {};
    WorkerTeam<Nothing> team(5, 8);
    for (int k = 0; k < 50; ++k) {
        std::vector<int> done(1000, 0);
        CHECK_THROWS_WITH(team.run(done.size(),
                                   [&](std::size_t i, Nothing&) {
                                       done[i] = 1;
                                       if (i >= 300 && i % 50 == 0)
                                           throw std::runtime_error(std::to_string(i));
                                   }),
                          "300");
        CHECK(std::count(done.begin(), done.begin() + 300, 1) == 300);
    }
}

} // namespace obt_kernels_test
