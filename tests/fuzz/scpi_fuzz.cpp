// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: lines that a client sends to obscura-instrument, done with cameras that only exist in
// memory.
#include "instrument/scpi/session.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "tests/unit/instrument/fake_link.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

using namespace obscura;
using test::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const instrument::CommandTable table;
    static const std::string version = "1";
    test::FakeLink link;
    instrument::ScpiSession session(table, link, version, true, [] { return false; });
    std::string_view lines(reinterpret_cast<const char*>(data), size);
    while (!lines.empty()) {
        const std::size_t end = lines.find('\n');
        const std::string response = session.execute(lines.substr(0, end));
        require(response.find('\0') == std::string::npos);
        lines.remove_prefix(end == std::string_view::npos ? lines.size() : end + 1);
    }
    // Whatever came before, a new line begins at the root.
    require(session.execute("*CLS;SYST:ERR?") == "0,\"No error\"");
    return 0;
}
