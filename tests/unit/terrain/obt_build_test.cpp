// SPDX-License-Identifier: Apache-2.0
// Making of giant textures: by rows, interrupted, killed, over shards, without room on the disk; sizes up to
// 2^48 bytes.
#include "core/error.hpp"
#include "obt_support.hpp"
#include "terrain/obt/obt_file.hpp"
#include "terrain/obt/obt_tile_writer.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

namespace obt_build_test {

using namespace obscura;
using namespace obscura::terrain;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

ObtMetadata lattice_metadata(std::int64_t width, std::int64_t height) {
    ObtMetadata m = planar_metadata(SampleType::u16, width, height);
    m.lattice = true;
    return m;
}

/// Some tiles are f32, some constant.
float rough(std::uint32_t plane, std::int64_t x, std::int64_t y) {
    if (x > 4400 && y > 1000 && x < 5400) return 12;
    const float wild = x / 256 == 3 && y / 256 == 2 ? 300000.F : 1000.F;
    return wild * noise_at(plane, x, y);
}

double resident_mb() {
    std::ifstream in("/proc/self/statm");
    double size = 0, resident = 0;
    in >> size >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Files of the folder that are not named so.
int others_than(const TempFolder& folder, const std::string& name) {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
        count += entry.path().filename() == name ? 0 : 1;
    return count;
}

} // namespace

TEST_CASE("Rows are asked for once, and make the same file as blocks") {
    const TempFolder folder;
    FunctionSource blocks(rough), rows(rough, true);
    const ObtMetadata m = lattice_metadata(5500, 3100);
    (void)write_obt(folder.path() / "a.obt", m, blocks);
    (void)write_obt(folder.path() / "b.obt", m, rows);
    const ObtFile a(folder.path() / "a.obt"), b(folder.path() / "b.obt");
    std::vector<float> of_a(5500), of_b(5500);
    for (int level = 0; level < a.levels(); ++level)
        for (std::int64_t y = 0; y < a.height(level); y += 37) {
            const auto w = static_cast<int>(a.width(level));
            a.read(level, 0, y, w, 1, of_a);
            b.read(level, 0, y, w, 1, of_b);
            REQUIRE(std::equal(of_a.begin(), of_a.begin() + w, of_b.begin()));
        }
    CHECK(b.check().damaged == 0);
}

TEST_CASE("An interrupted build goes on where it stopped and gives the same bytes") {
    const TempFolder folder;
    const bool by_rows = GENERATE(false, true);
    const ObtMetadata m = lattice_metadata(9000, 5000);
    FunctionSource whole(rough, by_rows);
    (void)write_obt(folder.path() / "a.obt", m, whole);
    const std::string expected = bytes_of_file(folder.path() / "a.obt");
    std::filesystem::remove(folder.path() / "a.obt");

    FunctionSource first(rough, by_rows);
    ObtWriteOptions options;
    options.progress = [&](std::uint64_t done, std::uint64_t total) { return done < total / 3; };
    const ObtWriteReport interrupted = write_obt(folder.path() / "a.obt", m, first, options);
    CHECK_FALSE(interrupted.finished);
    CHECK(interrupted.tiles > 0);
    CHECK_FALSE(std::filesystem::exists(folder.path() / "a.obt"));
    // A source that fails in the middle of a block.
    FunctionSource second(rough, by_rows);
    second.fail_at = by_rows ? 1 : 2;
    CHECK_THROWS_WITH(write_obt(folder.path() / "a.obt", m, second), "the source failed");
    // Damage to what is there: that block is made again.
    if (!by_rows) {
        std::fstream part(folder.path() / "a.obt.part", std::ios::in | std::ios::out | std::ios::binary);
        const obt::Layout layout(m, "");
        part.seekp(static_cast<std::streamoff>(layout.slot_place({0, 0, 5, 5})) + 1000);
        part.write("damage", 6);
    }
    FunctionSource third(rough, by_rows);
    const ObtWriteReport finished = write_obt(folder.path() / "a.obt", m, third);
    CHECK(finished.finished);
    CHECK(finished.resumed > 0);
    CHECK(third.calls < whole.calls);
    CHECK(bytes_of_file(folder.path() / "a.obt") == expected);
    CHECK(others_than(folder, "a.obt") == 0);
}

TEST_CASE("A killed build goes on and gives the same bytes") {
    const TempFolder folder;
    const ObtMetadata m = lattice_metadata(9000, 5000);
    FunctionSource whole(rough);
    (void)write_obt(folder.path() / "a.obt", m, whole);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        int blocks = 0;
        FunctionSource source([&](std::uint32_t plane, std::int64_t x, std::int64_t y) {
            if (x == 8999 && y == 4000 && ++blocks == 1) (void)raise(SIGKILL);
            return rough(plane, x, y);
        });
        (void)write_obt(folder.path() / "b.obt", m, source);
        _exit(0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    REQUIRE(WIFSIGNALED(status));
    CHECK(std::filesystem::exists(folder.path() / "b.obt.part"));
    CHECK_FALSE(std::filesystem::exists(folder.path() / "b.obt"));
    FunctionSource again(rough);
    const ObtWriteReport report = write_obt(folder.path() / "b.obt", m, again);
    CHECK(report.resumed > 0);
    CHECK(again.calls < whole.calls);
    CHECK(bytes_of_file(folder.path() / "b.obt") == bytes_of_file(folder.path() / "a.obt"));
}

TEST_CASE("A temporary file of another description is not gone on with") {
    const TempFolder folder;
    FunctionSource first(rough);
    ObtWriteOptions options;
    options.progress = [](auto, auto) { return false; };
    (void)write_obt(folder.path() / "a.obt", lattice_metadata(9000, 5000), first, options);
    FunctionSource second(rough);
    ObtMetadata other = lattice_metadata(9000, 5000);
    other.finest_exponent = -6;
    const ObtWriteReport report = write_obt(folder.path() / "a.obt", other, second);
    CHECK(report.finished);
    CHECK(report.resumed == 0);
}

TEST_CASE("Shards hold what one file would") {
    const TempFolder folder;
    FunctionSource source(rough);
    const ObtMetadata m = lattice_metadata(3000, 2000);
    ObtWriteOptions options;
    options.shard_bytes = 4096 * 301; // not a multiple of a slot
    const ObtWriteReport report = write_obt(folder.path() / "a.obt", m, source, options);
    const std::uint64_t shards = (report.bytes + options.shard_bytes - 1) / options.shard_bytes;
    CHECK(shards > 5);
    CHECK(others_than(folder, "a.obt") == static_cast<int>(shards) - 1);
    const ObtFile read(folder.path() / "a.obt");
    CHECK(read.check().damaged == 0);
    std::vector<float> row(3000);
    read.read(0, 0, 1234, 3000, 1, row);
    for (std::int64_t x = 0; x < 3000; ++x)
        REQUIRE_THAT(static_cast<double>(row[static_cast<std::size_t>(x)]),
                     WithinAbs(static_cast<double>(rough(0, x, 1234)), 0.032));
    // Replaced by a smaller one, whose shards are fewer.
    FunctionSource constant([](auto, auto, auto) { return 1.F; });
    (void)write_obt(folder.path() / "a.obt", lattice_metadata(300, 200), constant, options);
    CHECK(others_than(folder, "a.obt") == 0);
    // One shard is not there.
    (void)write_obt(folder.path() / "a.obt", m, source, options);
    std::filesystem::remove(folder.path() / "a.obt.002");
    CHECK_THROWS_WITH(ObtFile(folder.path() / "a.obt"), ContainsSubstring("a.obt.002"));
}

TEST_CASE("A build without room on the disk leaves nothing behind") {
    const TempFolder folder;
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        // Writing beyond 10 MB fails as on a full disk.
        (void)signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{10'000'000, 10'000'000};
        (void)setrlimit(RLIMIT_FSIZE, &limit);
        FunctionSource source(rough);
        try {
            (void)write_obt(folder.path() / "a.obt", lattice_metadata(9000, 5000), source);
        } catch (const OutputError& e) {
            _exit(std::string_view(e.what()).find("a.obt: cannot write") != std::string_view::npos ? 0 : 2);
        }
        _exit(1);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    CHECK(others_than(folder, "") == 0);
}

TEST_CASE("What cannot be stored is named with its column and row") {
    const TempFolder folder;
    const auto message = [&](const ObtMetadata& m, const FunctionSource::Function& f) {
        FunctionSource source(f);
        try {
            (void)write_obt(folder.path() / "a.obt", m, source);
        } catch (const InputError& e) {
            CHECK(others_than(folder, "") == 0);
            return std::string(e.what());
        }
        return std::string();
    };
    const auto bad = [](float value) {
        return [value](std::uint32_t, std::int64_t x, std::int64_t y) {
            return x == 300 && y == 17 ? value : 1 + 0.001F * static_cast<float>(x);
        };
    };
    const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    CHECK_THAT(message(planar_metadata(SampleType::u8, 400, 40), bad(256)),
               ContainsSubstring("a.obt: column 300, row 17 of level 0, plane 0: 256: allowed are 0 to 255"));
    CHECK_THAT(message(planar_metadata(SampleType::u16, 400, 40), bad(nan)),
               ContainsSubstring("column 300, row 17 of level 0, plane 0: no data"));
    CHECK_THAT(message(planar_metadata(SampleType::f32, 400, 40), bad(inf)),
               ContainsSubstring("column 300, row 17 of level 0, plane 0: infinite"));
    ObtMetadata m = planar_metadata(SampleType::i16, 400, 40);
    m.nodata = -5;
    CHECK_THAT(message(m, bad(-5)), ContainsSubstring("the number of missing samples"));
    m.width = 0;
    CHECK_THAT(message(m, bad(1)), ContainsSubstring("0 x 40 samples: allowed are 1 to 2^40 each"));
    m = planar_metadata(SampleType::f32, std::int64_t{1} << 40, std::int64_t{1} << 40);
    CHECK_THAT(message(m, bad(1)), ContainsSubstring("2^60 bytes"));
}

TEST_CASE("A second writer of the same file is refused") {
    const TempFolder folder;
    const ObtTileWriter first(folder.path() / "a.obt", lattice_metadata(100, 100), 4096, true);
    CHECK_THROWS_WITH(ObtTileWriter(folder.path() / "a.obt", lattice_metadata(100, 100), 4096, true),
                      ContainsSubstring("another process is writing it"));
}

TEST_CASE("A file of 2^48 bytes opens and its last tile is read, in the same memory") {
    const TempFolder folder;
    // 2^23 x 2^24 samples of u16 and their levels.
    const std::int64_t width = std::int64_t{1} << 23, height = std::int64_t{1} << 24;
    const auto file = folder.path() / "a.obt";
    const double before = resident_mb();
    {
        ObtTileWriter writer(file, lattice_metadata(width, height), std::uint64_t{1} << 40, false);
        std::vector<float> numbers(obt::tile_count);
        const auto fill = [&](float first) {
            for (std::size_t k = 0; k < numbers.size(); ++k)
                numbers[k] = first + static_cast<float>(k % 97);
        };
        fill(100);
        writer.write({0, writer.layout().levels() - 1, 0, 0}, numbers, {100, 1096, 0});
        fill(1000);
        writer.write({0, 0, width / 256 - 1, height / 256 - 1}, numbers, {1000, 1096, 0});
        CHECK(writer.bytes() > std::uint64_t{1} << 48);
        (void)writer.finish();
    }
    const ObtFile read(file, std::size_t{1} << 20);
    CHECK(read.bytes() > std::uint64_t{1} << 48);
    CHECK(std::filesystem::exists(folder.path() / "a.obt.256"));
    std::vector<float> part(16 * 16);
    read.read(0, width - 16, height - 16, 16, 16, part);
    CHECK(part[255] == 1000 + static_cast<float>((257 * 260 + 257) % 97));
    // Elsewhere the coarsest level.
    for (std::int64_t k = 1; k < 200; ++k) {
        read.read(0, width / 200 * k, height / 200 * k, 16, 16, part);
        REQUIRE((part[0] >= 100 && part[0] <= 196));
    }
    CHECK(read.check().damaged == 0);
    CHECK(resident_mb() < before + 40);
}

} // namespace obt_build_test
