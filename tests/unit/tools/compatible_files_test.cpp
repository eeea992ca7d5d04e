// SPDX-License-Identifier: Apache-2.0
// Files, compressed bytes and elevation models of the published client.
#include "core/error.hpp"
#include "serve/compatible/client_files.hpp"
#include "serve/compatible/dem_file.hpp"
#include "serve/compatible/packed_bytes.hpp"
#include "service/failure.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <lz4.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace compatible_files_test {

using namespace obscura;
using namespace obscura::serve;
using Catch::Matchers::ContainsSubstring;
using service::Failure;

namespace {

std::string content(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

struct Fixture {
    test::TempFolder folder;
    Fixture() {
        for (const char* name : {"root/a.txt", "root/sub/b.txt", "root/textures/map.png", "secret.txt"})
            (void)folder.write(name, name);
        std::filesystem::create_directory(folder.path() / "output");
        std::filesystem::create_symlink(folder.path() / "secret.txt", folder.path() / "root/link.txt");
        std::filesystem::create_symlink("sub/b.txt", folder.path() / "root/inside.txt");
        std::filesystem::create_symlink(folder.path(), folder.path() / "output/out");
    }
    [[nodiscard]] ClientFiles files() const {
        return {folder.path() / "root", folder.path() / "output", 1000};
    }
};

} // namespace

TEST_CASE("files are found below the root alone", "[compatible]") {
    const Fixture fixture;
    ClientFiles files = fixture.files();
    const std::string root = (fixture.folder.path() / "root").string();
    for (const std::string name : {"a.txt", "sub/b.txt", "map.png", "sub/../a.txt", "inside.txt"})
        CHECK(files.find(name));
    CHECK(content(files.existing(root + "/sub/b.txt")) == "root/sub/b.txt");
    for (const std::string& name :
         {std::string("../secret.txt"), std::string("/etc/passwd"), std::string("link.txt"),
          root + "/../secret.txt", std::string("a\0b", 3)}) {
        CAPTURE(name);
        CHECK_THROWS_AS(files.find(name), Failure);
    }
    CHECK_FALSE(files.find("sub"));
    CHECK_THROWS_WITH(files.existing("none.txt"), ContainsSubstring("\"none.txt\": there is no such file"));
}

TEST_CASE("names start from the current folder and from the resource path", "[compatible]") {
    const Fixture fixture;
    ClientFiles files = fixture.files();
    CHECK(files.folder() == "/");
    CHECK(files.listing() == "a.txt\ninside.txt\nlink.txt\nsub/\ntextures/\n");
    CHECK_FALSE(files.find("b.txt"));
    files.change_folder("sub");
    CHECK(files.folder() == "/sub");
    CHECK(files.find("b.txt"));
    CHECK_THROWS_AS(files.change_folder("../.."), Failure);
    CHECK_THROWS_AS(files.change_folder("b.txt"), Failure);
    CHECK(files.folder() == "/sub");
    files.change_folder("/");
    CHECK_FALSE(files.find("b.txt"));
    files.set_resource_path("sub");
    CHECK(files.find("b.txt"));
    CHECK_THROWS_AS(files.set_resource_path("/etc"), Failure);
}

TEST_CASE("files are written below the output folder alone", "[compatible]") {
    const Fixture fixture;
    ClientFiles files = fixture.files();
    CHECK(files.place_for("x.png") == fixture.folder.path() / "output/x.png");
    for (const char* name : {"../x.png", "/tmp/x.png", "out/x.png", "none/x.png", "out", "."}) {
        CAPTURE(name);
        CHECK_THROWS_AS(files.place_for(name), Failure);
    }
    files.receive("new/folder/x.bin", "abcdef", 0, false);
    files.receive("new/folder/x.bin", "XY", 4, true);
    CHECK(content(fixture.folder.path() / "output/new/folder/x.bin") == "abcdXY");
    files.receive("new/folder/x.bin", "Z", 2, false);
    CHECK(content(files.existing("new/folder/x.bin")) == "abZ");
    for (const char* name : {"../x.bin", "out/x.bin", "/etc/x.bin", ""})
        CHECK_THROWS_AS(files.receive(name, "x", 0, false), Failure);
    CHECK_FALSE(std::filesystem::exists(fixture.folder.path() / "x.bin"));
    CHECK_THROWS_WITH(files.receive("y.bin", std::string(1000, 'x'), 0, false),
                      ContainsSubstring("more bytes"));
    CHECK_THROWS_AS(files.receive("y.bin", "x", std::uint64_t{1} << 62, true), Failure);

    CHECK(files.has("empty.txt", "d41d8cd98f00b204e9800998ecf8427e"));
    CHECK(std::filesystem::file_size(fixture.folder.path() / "output/empty.txt") == 0);
    CHECK_FALSE(files.has("none.bin", "900150983cd24fb0d6963f7d28e17f72"));
    files.receive("abc", "abc", 0, false);
    CHECK(files.has("abc", "900150983cd24fb0d6963f7d28e17f72"));
    files.synchronise("/home/somebody/data");
    files.receive("/home/somebody/data/sub/z", "z", 0, false);
    CHECK(files.find("sub/z"));
    ClientFiles no_output(fixture.folder.path() / "root", "", 1000);
    CHECK_THROWS_WITH(no_output.place_for("x.png"), ContainsSubstring("without an output folder"));
}

TEST_CASE("a table has files for names that are nowhere else", "[compatible]") {
    const Fixture fixture;
    const auto table = fixture.folder.write("resources.toml",
                                            "\"star*.bin\" = \"secret.txt\"\n"
                                            "\"/data/x.txt\" = \"secret.txt\"\n\"a.txt\" = \"secret.txt\"\n");
    const compatible::ResourceTable resources(table);
    CHECK(resources.files().size() == 3);
    const ClientFiles files(fixture.folder.path() / "root", "", 0, resources);
    CHECK(content(files.existing("catalogues/stars_V.bin")) == "secret.txt");
    CHECK(content(files.existing("/data/x.txt")) == "secret.txt");
    CHECK(content(files.existing("a.txt")) == "root/a.txt");
    CHECK_FALSE(files.find("stars.txt"));
    for (const char* text : {"[resources]\n", "\"a\" = 3\n", "\"a\" = \"none.txt\"\n", "a = = 1\n"})
        CHECK_THROWS_AS(compatible::ResourceTable(fixture.folder.write("wrong.toml", text)), ConfigError);
}

TEST_CASE("compressed bytes are expanded up to the limit", "[compatible]") {
    const std::string plain(100'000, 'x');
    for (int level = 0; level <= 9; ++level) {
        const std::string packed = deflate_packed(plain, level);
        CHECK(packed.substr(0, 4) == std::string("\0\1\x86\xA0", 4));
        CHECK(inflate_packed(packed, plain.size()) == plain);
        CHECK_THROWS_AS(inflate_packed(packed, plain.size() - 1), Failure);
        CHECK_THROWS_AS(inflate_packed(packed.substr(0, packed.size() - 1), plain.size()), Failure);
    }
    CHECK_THROWS_AS(inflate_packed("\0\0", 10), Failure);
    CHECK_THROWS_AS(inflate_packed("\0\0\0\4abcd", 10), Failure);
    // Whatever the length says.
    CHECK(inflate_packed("\xFF\xFF\xFF\xFF" + deflate_packed("abc", 6).substr(4), 3) == "abc");

    std::string block(static_cast<std::size_t>(LZ4_compressBound(100'000)), '\0');
    block.resize(static_cast<std::size_t>(
        LZ4_compress_default(plain.data(), block.data(), 100'000, static_cast<int>(block.size()))));
    CHECK(expand_lz4(block, plain.size(), plain.size()) == plain);
    CHECK_THROWS_AS(expand_lz4(block, plain.size() + 1, 1 << 20), Failure);
    CHECK_THROWS_AS(expand_lz4(block, plain.size(), 1000), Failure);
    CHECK_THROWS_AS(expand_lz4("x", std::size_t{1} << 40, std::size_t{1} << 62), Failure);
}

TEST_CASE("an elevation model is read key by key", "[compatible]") {
    const DemFile dem =
        DemFile::parse("TYPE = \"CUBEMAP\";\n\n# remark\nLINES = 90;\r\n A_AXIS_RADIUS=1.7374e6 ;\n"
                       "HEIGHTMAP = \"a = b.img\";\nUNIT = m\n",
                       "x.dem");
    CHECK(dem.keys().size() == 5);
    CHECK(dem.text("TYPE") == "CUBEMAP");
    CHECK(dem.number("LINES") == 90);
    CHECK(dem.number("A_AXIS_RADIUS") == 1.7374e6);
    CHECK(dem.text("HEIGHTMAP") == "a = b.img");
    CHECK(dem.text("UNIT") == "m");
    CHECK_FALSE(dem.number("MAP_SCALE"));
    CHECK(dem.text("CONEMAP").empty());
    CHECK_THROWS_WITH(dem.number("TYPE"), "x.dem: TYPE: \"CUBEMAP\" is no number");
    CHECK_THROWS_WITH(DemFile::parse("A = 1;\nrubbish\n", "x.dem"),
                      "x.dem:2: \"rubbish\", wanted KEY = VALUE;");
    CHECK_THROWS_WITH(DemFile::parse("A = ;\n", "x.dem"), ContainsSubstring("x.dem:1:"));
}

} // namespace compatible_files_test
