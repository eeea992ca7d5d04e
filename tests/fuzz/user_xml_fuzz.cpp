// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: a GenICam file from anywhere, bound to the camera and then written to.
//
// Input: the file's text, and behind its first zero byte pairs of 4 bytes, address and value, written in
// turn.
#include "core/error.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/genicam/user_xml.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <algorithm>
#include <cstdlib>

using namespace obscura;
using namespace obscura::transports::gige;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::uint8_t* const end = std::find(data, data + size, std::uint8_t{0});
    RegisterBank bank;
    for (std::uint32_t a = manufacturer_begin; a < 0xA200; a += 4)
        bank.add(
            {.name = "Feature", .address = a, .access = Access::read_write, .reset = 64, .maximum = 4096});
    for (std::uint32_t a = address_of("Width"); a < address_of("Width", 1); a += 4)
        bank.add(
            {.name = "Region", .address = a, .access = Access::read_write, .reset = 64, .maximum = 4096});
    bank.add_string("DeviceVendorName", reg::manufacturer, 32, Access::read_only, "Obscura");
    try {
        UserXml xml("fuzz.xml", {data, end}, "", bank, feature_table());
        for (const std::uint8_t* p = end + 1; p + 8 <= data + size; p += 8) {
            std::size_t done = 0;
            const Status status = xml.write(load_be32(p), {p + 4, 4}, done);
            if ((status == Status::success) != (done == 4)) std::abort();
            std::uint8_t word[4];
            xml.read(load_be32(p), word);
        }
    } catch (const ConfigError& e) {
        // One line, whatever the file.
        if (std::string(e.what()).find('\n') != std::string::npos) std::abort();
    }
    return 0;
}
