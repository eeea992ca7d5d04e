// SPDX-License-Identifier: Apache-2.0
// Protocol of the helper obscura-gdal, and what becomes of a helper that fails: one line.
#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/gdal/process.hpp"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

namespace gdal_process_test {

using namespace obscura;
using namespace obscura::tools;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;
using test::TempFolder;

namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

GdalMap some_map() {
    GdalMap map;
    map.id = 3;
    map.driver = "GTiff";
    map.width = 1440;
    map.height = 720;
    map.bands.resize(2);
    map.bands[1].type = GdalType::f64;
    map.bands[1].nodata = -1e38;
    map.bands[1].unit = "m";
    map.band_count = 2;
    map.transform = {0, 0.25, 0, 90, 0, -0.25};
    map.system = GdalSystem::projected;
    map.method = "Polar_Stereographic";
    map.parameters = {{"latitude_of_origin", -90}};
    map.semi_major_m = map.semi_minor_m = 1737400;
    map.texts = {{"AREA_OR_POINT", "Area"}};
    map.warnings = {"a warning"};
    return map;
}

/// A program in the place of the helper for as long as the object lives.
class StandIn {
public:
    StandIn(const TempFolder& folder, const std::string& script) {
        const std::filesystem::path file = folder.path() / "helper";
        std::ofstream(file) << "#!/bin/sh\n" << script << "\n";
        std::filesystem::permissions(file, std::filesystem::perms::owner_all);
        setenv("OBSCURA_GDAL", file.c_str(), 1);
    }
    ~StandIn() { unsetenv("OBSCURA_GDAL"); }
    StandIn(const StandIn&) = delete;
    StandIn& operator=(const StandIn&) = delete;
};

std::string failure(const TempFolder& folder, const GdalLimits& limits = {}) {
    const std::filesystem::path file = folder.path() / "map.tif";
    std::ofstream(file) << "no map";
    try {
        GdalProcess process(limits);
        (void)process.open(file);
    } catch (const Error& error) {
        const std::string line = error.what();
        CHECK(line.find('\n') == std::string::npos);
        return line;
    }
    return "no failure";
}

} // namespace

TEST_CASE("messages of the helper survive the way, and no part of one does") {
    const std::string body = encoded(some_map());
    const GdalMap map = decoded_map(bytes_of(body));
    CHECK(map.id == 3);
    CHECK(map.driver == "GTiff");
    CHECK(map.width == 1440);
    CHECK(map.bands.size() == 2);
    CHECK(map.bands[1].type == GdalType::f64);
    CHECK(map.bands[1].nodata == -1e38);
    CHECK_FALSE(map.bands[0].nodata);
    CHECK((*map.transform)[5] == -0.25);
    CHECK(map.method == "Polar_Stereographic");
    CHECK(map.parameters.at(0).second == -90);
    CHECK(map.texts.at(0).second == "Area");
    CHECK(map.warnings.at(0) == "a warning");
    for (std::size_t length = 0; length < body.size(); ++length)
        CHECK_THROWS_AS(decoded_map(bytes_of(body.substr(0, length))), GdalProtocolError);
    CHECK_THROWS_AS(decoded_map(bytes_of(body + "x")), GdalProtocolError);

    GdalBlock block;
    block.x = 5;
    block.columns = 7;
    block.rows = 1;
    block.mask = true;
    CHECK(decoded_block(bytes_of(encoded(block))).columns == 7);
    CHECK(decoded_block(bytes_of(encoded(block))).mask);
    block.rows = 0;
    CHECK_THROWS_AS(decoded_block(bytes_of(encoded(block))), GdalProtocolError);
    GdalMap wide = some_map();
    wide.width = std::int64_t{1} << 31;
    CHECK_THROWS_AS(decoded_map(bytes_of(encoded(wide))), GdalProtocolError);
    GdalMap nowhere = some_map();
    (*nowhere.transform)[2] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(decoded_map(bytes_of(encoded(nowhere))), GdalProtocolError);
    // A count that would need more than all memory.
    std::string many = encoded(GdalTransform{1, false, {{1, 2}}});
    const std::uint64_t count = std::uint64_t{1} << 60;
    std::memcpy(many.data() + 5, &count, 8);
    CHECK_THROWS_AS(decoded_transform(bytes_of(many)), GdalProtocolError);
}

TEST_CASE("a helper that fails ends in one line") {
    const TempFolder folder;
    {
        const StandIn helper(folder, "kill -9 $$");
        CHECK_THAT(failure(folder),
                   ContainsSubstring("map.tif: obscura-gdal, which reads it, was ended by signal 9"));
    }
    {
        const StandIn helper(folder, "exit 3");
        CHECK_THAT(failure(folder), ContainsSubstring("ended with status 3"));
    }
    {
        const StandIn helper(folder, "exec sleep 1000"); // longer than this test may take
        CHECK_THAT(failure(folder, {200ms, std::uint64_t{4} << 30}),
                   ContainsSubstring("has not answered within 0.2 s"));
    }
    {
        const StandIn helper(folder, "echo this is not an answer at all; exec sleep 30");
        CHECK_THAT(failure(folder), ContainsSubstring("answers with what is no answer"));
    }
    {
        // Header of 2^60 bytes: kind 101, 0, length.
        const StandIn helper(folder, R"(printf '\145\0\0\0\0\0\0\0\0\0\0\0\0\0\0\020'; exec sleep 30)");
        CHECK_THAT(failure(folder), ContainsSubstring("answers with what is no answer"));
    }
    {
        const StandIn helper(folder, R"(printf '\145\0\0\0\0\0\0\0\004\0\0\0\0\0\0\0abcd'; exec sleep 30)");
        CHECK_THAT(failure(folder), ContainsSubstring("answers with a message is cut off"));
    }
    setenv("OBSCURA_GDAL", "/nonexistent/obscura-gdal", 1);
    CHECK_THAT(failure(folder), ContainsSubstring("the program obscura-gdal is missing"));
    unsetenv("OBSCURA_GDAL");
}

TEST_CASE("the helper reads blocks of a file, and refuses what is none") {
    if (!std::filesystem::exists(OBSCURA_GDAL_HELPER)) {
        WARN("SKIPPED: obscura-gdal is not built, libgdal-dev is missing");
        return;
    }
    setenv("OBSCURA_GDAL", OBSCURA_GDAL_HELPER, 1);
    const TempFolder folder;
    const std::filesystem::path file = folder.path() / "map.img";
    std::ofstream(folder.path() / "map.hdr") << "ENVI\nsamples = 3\nlines = 2\nbands = 1\nheader offset = "
                                                "0\nfile type = ENVI Standard\ndata type = 2\n"
                                                "interleave = bsq\nbyte order = 0\n";
    const std::int16_t samples[6] = {1, -2, 3, 400, -32768, 32767};
    std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(samples), sizeof samples);
    GdalProcess process;
    const GdalMap map = process.open(file);
    CHECK(map.driver == "ENVI");
    CHECK(map.width == 3);
    CHECK(map.height == 2);
    CHECK(map.bands.at(0).type == GdalType::i16);
    const auto bytes = process.read({map.id, 1, false, 1, 0, 2, 2}, GdalType::i16);
    std::int16_t read[4];
    REQUIRE(bytes.size() == sizeof read);
    std::memcpy(read, bytes.data(), sizeof read);
    CHECK(read[0] == -2);
    CHECK(read[1] == 3);
    CHECK(read[2] == -32768);
    CHECK(read[3] == 32767);
    // Refusals leave it in use.
    CHECK_THROWS_WITH(process.read({map.id, 1, false, 2, 0, 2, 2}, GdalType::i16),
                      ContainsSubstring("the block is not in the raster"));
    CHECK_THROWS_WITH(process.read({map.id, 2, false, 0, 0, 2, 2}, GdalType::i16),
                      ContainsSubstring("map.img: GDAL cannot read"));
    const std::filesystem::path other = folder.path() / "text.tif";
    std::ofstream(other) << "II*\0no tiff";
    CHECK_THROWS_WITH(process.open(other), ContainsSubstring("text.tif: GDAL cannot read it: "));
    CHECK_THROWS_AS(process.open(folder.path() / "missing.tif"), InputError);
    CHECK(process.read({map.id, 1, false, 0, 0, 3, 2}, GdalType::i16).size() == 12);
    // Ended from outside between two blocks.
    kill(process.pid(), SIGKILL);
    CHECK_THROWS_WITH(process.read({map.id, 1, false, 0, 0, 3, 2}, GdalType::i16),
                      ContainsSubstring("signal 9"));
    unsetenv("OBSCURA_GDAL");
}

} // namespace gdal_process_test
