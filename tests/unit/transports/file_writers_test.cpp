// SPDX-License-Identifier: Apache-2.0
// Image files, read back by readers of other people (fitsverify) and by tests/support/read_image.py, which
// was written from the format specifications.
#include "core/error.hpp"
#include "images/writers/exr.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/frame_writer.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/png.hpp"
#include "images/writers/raw.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <random>

namespace file_writers_test {

using namespace obscura;
using namespace obscura::images;

namespace {

constexpr std::int32_t width = 67, height = 41; // neither even nor a multiple of an EXR block

template<typename T>
std::vector<T> noise(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<T> values(count);
    for (T& v : values)
        v = static_cast<T>(std::is_integral_v<T> ? random() & 0xffff : std::ldexp(random() & 0xffffff, -40));
    return values;
}

const Cards cards{{"NAME", std::string("it's a 'test'"), "a string"},
                  {"COUNT", std::int64_t{123456789012345}, "an integer"},
                  {"LENGTH", 0.1, "[m] a number"},
                  {"FLAG", true, "a boolean"}};

template<typename T>
std::filesystem::path dump(const test::TempFolder& folder, const std::vector<T>& values) {
    return folder.write("expected.raw",
                        {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
}

/// Exit status of the independent reader; what differs goes to the test's output.
int read_back(const std::filesystem::path& file, const std::filesystem::path& expected,
              const std::string& header) {
    const std::string command = fmt::format("{} {}/tests/support/read_image.py '{}' '{}' {}", OBSCURA_PYTHON,
                                            OBSCURA_SOURCE_DIR, file.string(), expected.string(), header);
    return std::system(command.c_str());
}

std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::size_t files_in(const std::filesystem::path& folder) {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

std::string error_of(const std::function<void()>& write) {
    try {
        write();
    } catch (const Error& error) {
        CHECK(error.status() == exit_no_output);
        return error.what();
    }
    return "no error";
}

/// fitsverify's verdict, where it is installed.
void verify_fits(const std::filesystem::path& file) {
    if (std::system("command -v fitsverify >/dev/null 2>&1") != 0) {
        WARN("SKIPPED: fitsverify is not installed");
        return;
    }
    CHECK(std::system(fmt::format("fitsverify -q '{}'", file.string()).c_str()) == 0);
}

} // namespace

TEST_CASE("PNG files hold the digital numbers, their depth and the cards") {
    const test::TempFolder folder;
    const auto pixels = noise<std::uint16_t>(width * height, 1);
    const auto file = folder.path() / "a.png";
    write_png16(file, width, height, 12, pixels, cards);
    CHECK(read_back(file, dump(folder, pixels),
                    R"("NAME=it's a 'test'" COUNT=123456789012345 LENGTH=0.1 FLAG=true sBIT=12)") == 0);
}

TEST_CASE("FITS files of digital numbers are valid and hold what was written") {
    const test::TempFolder folder;
    const auto pixels = noise<std::uint16_t>(width * height, 2);
    const auto file = folder.path() / "a.fits";
    write_fits16(file, width, height, pixels, cards);
    CHECK(read_back(file, dump(folder, pixels),
                    R"("NAME=it''s a ''test''" COUNT=123456789012345 LENGTH=0.1 FLAG=T BUNIT=adu NAXIS=2)") ==
          0);
    verify_fits(file);
}

TEST_CASE("FITS cubes of floats are valid and hold what was written") {
    const test::TempFolder folder;
    const auto values = noise<float>(3 * width * height, 3);
    const auto file = folder.path() / "[odd] name.fits";
    write_fits_float(file, width, height, 3, values, "W m-2", cards);
    CHECK(read_back(file, dump(folder, values), R"("BUNIT=W m-2" NAXIS=3 NAXIS3=3)") == 0);
    // fitsverify takes [...] in a name for an extended file name: give it a plain one.
    std::filesystem::rename(file, folder.path() / "plain.fits");
    verify_fits(folder.path() / "plain.fits");
}

TEST_CASE("EXR files hold named channels bit by bit, with their units") {
    const test::TempFolder folder;
    const auto values = noise<float>(2 * width * height, 4);
    const std::span<const float> all(values);
    const auto file = folder.path() / "a.exr";
    // Channels are stored in alphabetical order, whatever order they come in.
    write_exr(file, width, height,
              {{"irradiance.b", "W m-2", all.subspan(width * height)},
               {"irradiance.a", "W m-2", all.first(width * height)}},
              cards);
    CHECK(read_back(file, dump(folder, values),
                    R"("irradiance.a:unit=W m-2" LENGTH=0.1 COUNT=123456789012345)") == 0);
}

TEST_CASE("raw files come with a sidecar") {
    const test::TempFolder folder;
    const auto pixels = noise<std::uint16_t>(width * height, 5);
    write_raw16(folder.path() / "a.raw", width, height, 12, pixels, cards);
    CHECK(bytes_of(folder.path() / "a.raw") == bytes_of(dump(folder, pixels)));
    const std::string sidecar = bytes_of(folder.path() / "a.toml");
    CHECK(sidecar.find("width = 67\nheight = 41\nbits = 12\n") != std::string::npos);
    CHECK(sidecar.find("LENGTH = 0.1 # [m] a number\n") != std::string::npos);
}

TEST_CASE("the same picture gives the same bytes, an existing file is replaced, nothing else is left") {
    const test::TempFolder folder;
    const auto pixels = noise<std::uint16_t>(width * height, 6);
    const auto floats = noise<float>(width * height, 6);
    const auto write = [&] {
        std::string all;
        for (const FrameFormat format : {FrameFormat::png, FrameFormat::fits, FrameFormat::raw}) {
            const auto file = folder.path() / frame_file_name(7, format);
            write_picture(file, format, {width, height, 12, pixels}, cards);
            all += bytes_of(file);
        }
        write_exr(folder.path() / "x.exr", width, height, {{"Y", "W m-2", floats}}, cards);
        return all + bytes_of(folder.path() / "x.exr");
    };
    const std::string first = write();
    CHECK(write() == first);
    CHECK(files_in(folder.path()) == 5); // png, fits, raw and its sidecar, exr
    CHECK(std::filesystem::exists(folder.path() / "frame_000007.png"));
}

TEST_CASE("a temporary file is created by its writer and never found there") {
    const test::TempFolder folder;
    const std::filesystem::path target = folder.path() / "frame.png";
    const std::filesystem::path victim = folder.write("victim", "precious");
    // Names count up: a link is planted under the next one.
    const std::string name = PendingFile(target).path().filename();
    const std::size_t digits = name.rfind('.', name.size() - 5) + 1;
    const unsigned number = static_cast<unsigned>(std::stoul(name.substr(digits)));
    std::filesystem::create_symlink(victim, folder.path() /
                                                fmt::format("{}{}.tmp", name.substr(0, digits), number + 1));
    CHECK_THROWS_AS(PendingFile(target), OutputError);
    CHECK(test::text_of(victim) == "precious");
    CHECK(std::filesystem::exists(victim));
}

TEST_CASE("an output that cannot be written is one line, and leaves nothing behind") {
    const test::TempFolder folder;
    const std::vector<std::uint16_t> pixels(4);
    const std::vector<float> floats(4);
    const std::string place = (folder.path() / "no" / "a").string();
    const std::string why = ": cannot be written: No such file or directory";
    CHECK(error_of([&] { write_png16(place + ".png", 2, 2, 12, pixels, {}); }) == place + ".png" + why);
    CHECK(error_of([&] { write_fits16(place + ".fits", 2, 2, pixels, {}); }) == place + ".fits" + why);
    CHECK(error_of([&] { write_raw16(place + ".raw", 2, 2, 12, pixels, {}); }) == place + ".raw" + why);
    CHECK(error_of([&] {
              write_exr(place + ".exr", 2, 2, {{"Y", "", floats}}, {});
          }) == place + ".exr" + why);
    std::filesystem::create_directory(folder.path() / "folder.png");
    CHECK(error_of([&] { write_png16(folder.path() / "folder.png", 2, 2, 12, pixels, {}); }) ==
          (folder.path() / "folder.png").string() + ": cannot be written: Is a directory");
    CHECK(files_in(folder.path()) == 1);

    CHECK(error_of([&] { require_writable(folder.path() / "no"); }) ==
          (folder.path() / "no").string() + ": no such directory");
    const auto file = folder.write("file", "x");
    CHECK(error_of([&] { require_writable(file); }) == file.string() + ": not a directory");
    // procfs refuses new files even to root.
    CHECK(error_of([] { require_writable("/proc/self"); }).substr(0, 29) == "/proc/self: cannot be written");
}

} // namespace file_writers_test
