// SPDX-License-Identifier: Apache-2.0
// Kernels made from casacore's DE405 and by the writer of DAF files, as the kernel reader sees them.
#include "core/error.hpp"
#include "ephemeris/kernels/daf.hpp"
#include "ephemeris/kernels/daf_writer.hpp"
#include "ephemeris/kernels/ephemeris.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/de405_states.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/import/ephemeris/casacore_ephemeris.hpp"

#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

namespace ephemeris_import_test {

using namespace obscura;
using namespace obscura::ephemeris;
using namespace obscura::tools;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Whether Debian's table is installed; says so if it is not.
bool table_is_there() {
    if (std::filesystem::exists(casacore_de405)) return true;
    std::cout << "SKIPPED: " << casacore_de405 << " is not there (casacore-data-jpl-de405)\n";
    return false;
}

std::string content(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

} // namespace

TEST_CASE("A kernel made of casacore's DE405 gives the states that python3-jplephem gives from JPL's") {
    if (!table_is_there()) return;
    const test::TempFolder folder;
    const CasacoreEphemeris table = read_casacore_ephemeris(casacore_de405);
    CHECK(table.name == "JPL Planetary ephemeris DE405");
    const auto file = folder.write("de405.bsp", daf_bytes("SPK", table.name, "from a test", table.segments));
    const Ephemeris kernels({file});
    CHECK(kernels.bodies() == std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 199, 299, 301, 399});
    // 1959-12-09 and 1143 intervals of 32 days.
    REQUIRE(kernels.coverage(301).size() == 1);
    CHECK(kernels.coverage(301)[0] == Interval{(36912 - 51544.5) * 86400, (36912 + 36576 - 51544.5) * 86400});
    for (const test::De405State& c : test::de405_states) {
        if (c.observer == 0 || length(c.position_m) > 2e12) continue; // less than two steps of a double of km
        CAPTURE(c.target, c.observer);
        const State s = kernels.state(c.target, c.observer, c.time);
        CHECK(length(s.position_m - c.position_m) < 1e-3);
        CHECK(length(s.velocity_m_s - c.velocity_m_s) < 1e-8);
    }
    const State venus = kernels.state(299, 2, test::de405_states[0].time);
    CHECK(length(venus.position_m) == 0);
}

TEST_CASE("Tables that are damaged or of another ephemeris are refused with file and place") {
    const test::TempFolder folder;
    CHECK_THROWS_WITH(read_casacore_ephemeris(folder.path()),
                      ContainsSubstring("no casacore table (table.dat)"));
    folder.write("table.dat", "SIMPLE = T");
    CHECK_THROWS_WITH(read_casacore_ephemeris(folder.path()),
                      ContainsSubstring("table.dat: not the description of a casacore table"));
    if (!table_is_there()) return;
    const std::string description = content(std::filesystem::path(casacore_de405) / "table.dat");
    const std::string rows = content(std::filesystem::path(casacore_de405) / "table.f0i");
    const auto refusal = [&](const std::string& dat, const std::string& f0i) -> std::string {
        folder.write("table.dat", dat);
        folder.write("table.f0i", f0i);
        try {
            (void)read_casacore_ephemeris(folder.path());
        } catch (const InputError& error) {
            return error.what();
        }
        return "no error";
    };
    for (const std::size_t size : {90U, 100U, 200U, 3000U})
        CHECK_THAT(refusal(description.substr(0, size), rows), ContainsSubstring("table.dat"));
    CHECK_THAT(refusal(description, rows.substr(0, 20'000)), ContainsSubstring("table.f0i: 20000 bytes"));
    std::string shape = rows;
    shape[16 + 8160 + 8] = 7;
    CHECK_THAT(refusal(description, shape), ContainsSubstring("table.f0i: row 2: 1 dimensions, 775 values"));
    std::string nan = rows;
    nan.replace(16 + 12, 8, "\xff\xff\xff\xff\xff\xff\xff\x7f");
    CHECK_THAT(refusal(description, nan), ContainsSubstring("row 1: a value that is no number"));
    // DENUM is 405.0: 4079500000000000 in hexadecimal.
    std::string other = description;
    other.replace(other.find("\x40\x79\x50", 0, 3), 3, "\x40\x69\x00", 3);
    CHECK_THAT(refusal(other, rows), ContainsSubstring("table.dat: ephemeris DE200, allowed DE405"));
}

TEST_CASE("The writer of DAF files makes what the reader reads, with many segments and comments") {
    const test::TempFolder folder;
    for (const char* kind : {"SPK", "PCK"}) {
        std::vector<DafArrayData> arrays;
        for (std::int32_t i = 0; i < 60; ++i) {
            DafArrayData& a = arrays.emplace_back();
            a.name = "SEGMENT " + std::to_string(i);
            a.doubles = {i * 1.5, i * 1.5 + 1};
            a.integers = kind == std::string("SPK") ? std::vector<std::int32_t>{i, 0, 1, 2}
                                                    : std::vector<std::int32_t>{i, 1, 2};
            for (std::int32_t k = 0; k <= i * 7; ++k)
                a.words.push_back(i + k * 0.25);
        }
        const std::string comments(2500, 'c');
        const Daf daf(folder.write("a.daf", daf_bytes(kind, "title", comments + "\nend", arrays)));
        CHECK(daf.kind() == kind);
        REQUIRE(daf.arrays().size() == arrays.size());
        for (std::size_t i = 0; i < arrays.size(); ++i) {
            const Daf::Array& read = daf.arrays()[i];
            CHECK(read.name == arrays[i].name);
            CHECK(read.doubles == arrays[i].doubles);
            CHECK(read.integers == arrays[i].integers);
            CHECK(std::vector<double>(read.words.begin(), read.words.end()) == arrays[i].words);
        }
    }
}

} // namespace ephemeris_import_test
