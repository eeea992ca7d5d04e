// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: messages between obscura and obscura-gdal, and labels of maps. Whatever they hold, the
// place of a map's samples follows from them or they are refused in one line.
//
// Input: a byte that chooses the reader, then the message or label.
#include "core/error.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "tools/gdal/protocol.hpp"
#include "tools/import/map/georeference.hpp"

#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

using namespace obscura;
using namespace obscura::tools;
using test::require;

namespace {

void one(const std::string& line) {
    require(line.find('\n') == std::string::npos && line.size() < 4000);
}

void place(const GdalMap& map, const images::PdsLabel* label) {
    MapRemarks remarks;
    const Georeference found = georeference(map, label, {}, "fuzz", remarks);
    for (const std::string& text : remarks.warnings())
        one(text);
    if (found.foreign) return;
    try {
        const terrain::MapFrame frame(found.projection, found.transform, found.registration, map.width,
                                      map.height);
        (void)frame.position({0, 0});
        require(!(frame.period() < 0));
    } catch (const std::invalid_argument& error) {
        one(error.what());
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1 || size > 65536) return 0;
    const auto body = std::as_bytes(std::span(data + 1, size - 1));
    try {
        switch (data[0] % 6) {
        case 0:
            place(decoded_map(body), nullptr);
            break;
        case 1: {
            const test::MemoryFile file(data + 1, size - 1);
            const images::PdsLabel label(file.path());
            GdalMap map;
            map.width = 1440;
            map.height = 720;
            place(map, &label);
            break;
        }
        case 2: {
            const GdalBlock block = decoded_block(body);
            require(block.columns > 0 && block.rows > 0);
            const std::string again = encoded(block);
            require(decoded_block(std::as_bytes(std::span(again))).rows == block.rows);
            break;
        }
        case 3:
            (void)decoded_transform(body);
            break;
        default:
            one(one_line({reinterpret_cast<const char*>(body.data()), body.size()}));
            break;
        }
    } catch (const GdalProtocolError& error) {
        one(error.what());
    } catch (const Error& error) {
        one(error.what());
    }
    return 0;
}
