// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: heads of HTTP requests to the LXI port of obscura-instrument.
#include "instrument/lxi/identification.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

using namespace obscura;
using test::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const instrument::LxiIdentity identity{"1", "bench", "192.0.2.1", 80, 5025};
    const std::string answer = instrument::lxi_answer({reinterpret_cast<const char*>(data), size}, identity);
    // One whole answer of one length: nothing of the request is in its head, so that no line can be added.
    const std::size_t end = answer.find("\r\n\r\n");
    require(answer.starts_with("HTTP/1.1 ") && end != std::string::npos);
    const std::size_t length = answer.find("\r\nContent-Length: ");
    require(length < end &&
            std::stoul(answer.substr(length + std::string_view("\r\nContent-Length: ").size())) ==
                answer.size() - end - 4);
    require(answer.size() < 4096);
    const bool found = answer.starts_with("HTTP/1.1 200 ");
    require(!found || answer.substr(end + 4) == instrument::lxi_identification(identity));
    return 0;
}
