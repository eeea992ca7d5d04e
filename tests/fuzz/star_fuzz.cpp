// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: star catalogues in all layouts, star catalogue files, star lists. Whatever a file holds,
// it is read or refused in one line, and what is read has finite numbers.
//
// Input: a byte that chooses the reader, then the file.
#include "core/error.hpp"
#include "ephemeris/stars/star_file.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "tools/import/stars/star_import.hpp"
#include "tools/pictures/star_lists.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

using namespace obscura;
using test::require;

namespace {

void check(const ephemeris::CatalogueStar& star) {
    require(is_finite(ephemeris::direction_at(star, 30, {1, 0, 0})));
    require(std::abs(length(star.direction) - 1) < 1e-9);
    require(std::isfinite(star.magnitude_v) && !std::isinf(star.colour_b_v));
}

void catalogue(const std::filesystem::path& file, tools::StarFormat format) {
    tools::StarImportSettings settings;
    settings.format = format;
    settings.map.zero_w_m2 = 1e-8;
    tools::StarSink sink("fuzz", 40, [](const std::string& line) {
        require(line.find('\n') == std::string::npos && line.size() < 1000);
    });
    (void)tools::read_stars(file, settings, sink, [](double) {});
    for (const ephemeris::CatalogueStar& star : sink.stars)
        check(star);
    // What was taken can be written, and is the same again.
    const ephemeris::StarFile written(ephemeris::star_file_bytes(sink.stars, "fuzz", {}), "written");
    require(written.intact() && written.size() == sink.stars.size());
}

void catalogue_file(const std::filesystem::path& path) {
    const ephemeris::StarFile file(path);
    for (std::uint32_t i = 0; i < file.size(); ++i)
        check(file.star(i));
    std::vector<std::uint32_t> found(file.size());
    require(file.find({{0, 0, 1}, 4}, 40, found) <= file.size());
}

void lists(const std::filesystem::path& file) {
    require(tools::is_star_list("/nonexistent") == false);
    const tools::StarList list = tools::read_star_list(file, {"", {"kind=star"}});
    if (list.stars.size() > 500) return;
    const tools::StarAgreement same = tools::compare_star_lists(list, list, 1);
    require(same.pairs.size() == list.stars.size() && !(same.rms > 0));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1 || size > 65536) return 0;
    const test::MemoryFile memory(data + 1, size - 1);
    const std::filesystem::path file = memory.path();
    try {
        const unsigned choice = data[0] % 10;
        if (choice == 8)
            catalogue_file(file);
        else if (choice == 9)
            lists(file);
        else
            catalogue(file, static_cast<tools::StarFormat>(choice));
    } catch (const Error& error) {
        require(std::string(error.what()).find('\n') == std::string::npos);
    }
    return 0;
}
