// SPDX-License-Identifier: Apache-2.0
// Damaged giant textures: each is refused with one line that names the file and the place.
#include "core/error.hpp"
#include "obt_support.hpp"
#include "terrain/obt/obt_file.hpp"
#include "terrain/obt/obt_samples.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/obt_patch.hpp"
#include "tests/support/temp_folder.hpp"

#include <bit>
#include <limits>

namespace obt_damage_test {

using namespace obscura;
using namespace obscura::terrain;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;

namespace {

/// A file of 4 levels in memory, and what is said of it after an edit.
class Patient {
public:
    explicit Patient(ObtMetadata m = planar_metadata(SampleType::u16, 1300, 300)) {
        m.lattice = true;
        FunctionSource source(
            [](std::uint32_t p, std::int64_t x, std::int64_t y) { return 100 * noise_at(p, x, y); });
        (void)write_obt(file_, m, source);
        whole_ = bytes = bytes_of_file(file_);
        root = obt::get<std::uint64_t>(reinterpret_cast<const std::byte*>(bytes.data()) + 1280);
    }

    template<typename Number>
    Patient& put(std::size_t at, Number number) {
        obt::put(reinterpret_cast<std::byte*>(bytes.data()) + at, number);
        return *this;
    }
    /// Place of a tile's entry.
    [[nodiscard]] std::size_t entry(const obt::TileName& tile) const {
        return root + obt::Layout(planar_metadata(SampleType::u16, 1300, 300), "").place_in_block(tile);
    }
    /// The line with which the file is refused, when it is opened or when all of it is read.
    std::string complaint(Checksums fix = {}) {
        fix_checksums(bytes, fix);
        std::string said = said_of_bytes();
        bytes = whole_;
        return said;
    }
    std::string said_of_bytes() {
        folder_.write("a.obt", bytes);
        try {
            const ObtFile read(file_);
            std::vector<float> row(1300);
            for (int level = 0; level < read.levels(); ++level)
                for (std::int64_t y = 0; y < read.height(level); ++y)
                    read.read(level, 0, y, static_cast<int>(read.width(level)), 1, row);
        } catch (const InputError& e) {
            const std::string line = e.what();
            CHECK_THAT(line, ContainsSubstring("a.obt"));
            CHECK(line.find('\n') == std::string::npos);
            return line;
        }
        return "";
    }

    std::string bytes;
    std::uint64_t root = 0;

private:
    TempFolder folder_;
    std::filesystem::path file_ = folder_.path() / "a.obt";
    std::string whole_;
};

constexpr double nan64 = std::numeric_limits<double>::quiet_NaN();

} // namespace

TEST_CASE("The checksums of an undamaged file are right") {
    Patient p;
    const std::string before = p.bytes;
    fix_checksums(p.bytes);
    CHECK((p.bytes == before));
    CHECK(p.complaint().empty());
}

TEST_CASE("A truncated file is refused wherever it ends") {
    Patient p;
    const std::string whole = p.bytes;
    for (std::size_t size = 0; size < whole.size(); size += size < 20000 ? 397 : 40000) {
        p.bytes = whole.substr(0, size);
        const std::string line = p.said_of_bytes();
        CAPTURE(size, line);
        if (size < 8)
            REQUIRE_THAT(line, ContainsSubstring("does not begin with OBSTEX"));
        else if (size < obt::data_start)
            REQUIRE_THAT(line, ContainsSubstring("in its header of 16384"));
        else
            REQUIRE_THAT(line, ContainsSubstring("it is not whole"));
    }
    p.bytes = whole + "more";
    CHECK_THAT(p.said_of_bytes(), ContainsSubstring("it is not whole"));
}

TEST_CASE("A flipped bit is found wherever it is") {
    Patient p;
    const std::string whole = p.bytes;
    std::size_t found = 0, all = 0;
    for (std::size_t at = 0; at < whole.size(); at += 7919) {
        p.bytes = whole;
        p.bytes[at] = static_cast<char>(p.bytes[at] ^ 4);
        ++all;
        found += p.said_of_bytes().empty() ? 0 : 1;
    }
    // Not in the text for people, and not behind the samples of a slot.
    CHECK(found + 10 >= all);
    CHECK(found > 50);
}

TEST_CASE("Headers with numbers that no file has are refused") {
    Patient p;
    CHECK_THAT(p.put(8, std::uint32_t{2}).complaint(),
               ContainsSubstring("version 2 of the format: allowed is 1"));
    CHECK_THAT(p.put(4000, std::uint8_t{1}).complaint({false, true, true}),
               ContainsSubstring("checksum at byte 4092"));
    CHECK_THAT(p.put(16, std::uint32_t{2}).complaint(), ContainsSubstring("its making was not finished"));
    CHECK_THAT(p.put(20, std::uint8_t{9}).complaint(),
               ContainsSubstring("kind number 9 at byte 20 is not known"));
    CHECK_THAT(p.put(21, std::uint8_t{5}).complaint(), ContainsSubstring("sample type number 5"));
    CHECK_THAT(p.put(26, std::uint16_t{0}).complaint(), ContainsSubstring("0 planes: allowed are 1 to 16"));
    CHECK_THAT(p.put(26, std::uint16_t{17}).complaint(), ContainsSubstring("17 planes"));
    CHECK_THAT(p.put(28, std::uint32_t{512}).complaint(), ContainsSubstring("256 samples"));
    CHECK_THAT(p.put(36, std::uint32_t{5}).complaint(),
               ContainsSubstring("5 levels of 1300 x 300 samples: they have 4"));
    CHECK_THAT(p.put(40, std::uint64_t{0}).complaint(), ContainsSubstring("0 x 300 samples"));
    CHECK_THAT(p.put(40, ~std::uint64_t{0}).complaint(), ContainsSubstring("allowed are 1 to 2^40 each"));
    // 2^31 wide: possible as such, but its levels are others.
    CHECK_THAT(p.put(40, std::uint64_t{1} << 31).complaint(),
               ContainsSubstring("levels of 2147483648 x 300"));
    CHECK_THAT(p.put(56, nan64).complaint(), ContainsSubstring("transform"));
    CHECK_THAT(p.put(104, -1.0).complaint(), ContainsSubstring("radii"));
    CHECK_THAT(p.put(136, nan64).complaint(), ContainsSubstring("semi-axes"));
    CHECK_THAT(p.put(160, nan64).complaint(), ContainsSubstring("scale nan"));
    CHECK_THAT(p.put(160, 0.0).complaint(), ContainsSubstring("scale 0"));
    CHECK_THAT(p.put(176, std::int8_t{100}).complaint(), ContainsSubstring("steps from 2^100"));
    CHECK_THAT(p.put(192, std::uint64_t{1} << 62).complaint(), ContainsSubstring("at most 2^61"));
    CHECK_THAT(p.put(200, std::uint64_t{0}).complaint(), ContainsSubstring("in parts of 0"));
    CHECK_THAT(p.put(200, std::uint64_t{4096}).complaint(), ContainsSubstring("a.obt"));
    CHECK_THAT(p.put(1296, nan64).complaint(), ContainsSubstring("smallest and largest value"));
}

TEST_CASE("Directories that lead astray are refused") {
    Patient p;
    const std::uint64_t root = p.root;
    CHECK_THAT(p.put(1280, std::uint64_t{1} << 40).complaint(), ContainsSubstring("outside of the file"));
    CHECK_THAT(p.put(1280, root + 1).complaint(), ContainsSubstring("outside of the file"));
    CHECK_THAT(p.put(root + obt::block_name, std::uint64_t{5}).complaint(),
               ContainsSubstring("it is another one's"));
    CHECK_THAT(p.put(root + 5, std::uint8_t{77}).complaint({true, false, true}),
               ContainsSubstring("its checksum does not match"));
    const std::size_t entry = p.entry({0, 1, 1, 0});
    CHECK_THAT(p.put(entry + 6, std::uint8_t{7}).complaint(),
               ContainsSubstring("tile (1, 0) of level 1, plane 0: its entry"));
    CHECK_THAT(p.put(entry + 16, std::numeric_limits<float>::quiet_NaN()).complaint(),
               ContainsSubstring("its entry"));
    CHECK_THAT(p.put(entry, std::uint32_t{1} << 30).complaint(), ContainsSubstring("outside of the file"));
    CHECK_THAT(p.put(entry + 8, 12).complaint({true, true, false}),
               ContainsSubstring("tile (1, 0) of level 1, plane 0 at byte"));
    // Samples of another tile, with the checksum of that tile.
    const auto other =
        obt::get<std::uint32_t>(reinterpret_cast<const std::byte*>(p.bytes.data()) + p.entry({0, 0, 3, 0}));
    CHECK_THAT(p.put(p.entry({0, 0, 2, 0}), other).complaint({true, true, false}),
               ContainsSubstring("does not match"));
}

TEST_CASE("A cyclic directory is refused, not followed") {
    // 6 levels: one more than a block has.
    const TempFolder folder;
    const auto file = folder.path() / "a.obt";
    FunctionSource source([](auto, std::int64_t x, auto) { return static_cast<float>(x % 7); });
    (void)write_obt(file, planar_metadata(SampleType::u8, 8000, 200), source);
    std::string bytes = bytes_of_file(file);
    auto* const at = reinterpret_cast<std::byte*>(bytes.data());
    const auto root = obt::get<std::uint64_t>(at + 1280);
    // The pointers to the blocks below point to the root, or to each other, with the right checksums.
    const std::size_t first = root + obt::BlockName{0, 1, 0, 0}.place_in_parent();
    const std::size_t second = root + obt::BlockName{0, 1, 1, 0}.place_in_parent();
    REQUIRE(obt::get<std::uint64_t>(at + first) != 0);
    const std::string right = bytes;
    const auto said = [&] {
        fix_checksums(bytes, {true, true, false});
        folder.write("a.obt", bytes);
        bytes = right;
        const ObtFile read(file);
        CHECK(read.check().damaged > 0);
        std::vector<float> row(8000);
        try {
            read.read(0, 0, 0, 8000, 1, row);
        } catch (const InputError& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    obt::put(at + first, root / obt::page);
    CHECK_THAT(said(), ContainsSubstring("directory block at byte"));
    obt::put(reinterpret_cast<std::byte*>(bytes.data()) + first,
             obt::get<std::uint64_t>(reinterpret_cast<std::byte*>(bytes.data()) + second));
    CHECK_THAT(said(), ContainsSubstring("it is another one's"));
}

} // namespace obt_damage_test
