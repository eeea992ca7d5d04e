// SPDX-License-Identifier: Apache-2.0
// HTTP answers of the LXI identification.
#include "instrument/lxi/identification.hpp"
#include "tests/support/catch.hpp"

#include <string>

namespace lxi_test {

using namespace obscura::instrument;

TEST_CASE("the identification is served at its paths, and nothing elsewhere", "[instrument]") {
    const LxiIdentity identity{"1.2", "bench<1>", "192.0.2.1", 80, 5025};
    const auto status = [&](const std::string& line) {
        return lxi_answer(line + "\r\nHost: x\r\n\r\n", identity).substr(9, 3);
    };
    CHECK(status("GET /lxi/identification HTTP/1.1") == "200");
    CHECK(status("GET /lxi HTTP/1.0") == "302");
    CHECK(status("GET / HTTP/1.1") == "404");
    CHECK(status("GET /lxi/../etc/passwd HTTP/1.1") == "404");
    CHECK(status("POST /lxi/identification HTTP/1.1") == "405");
    for (const char* line : {"", "GET", "GET /lxi/identification", "GET /lxi/identification FTP/1.1", "  "})
        CHECK(status(line) == "400");
    const std::string document = lxi_identification(identity);
    CHECK(document.find("<InstrumentAddressString>TCPIP::192.0.2.1::5025::SOCKET<") != std::string::npos);
    CHECK(document.find("<Hostname>bench&lt;1&gt;") != std::string::npos);
    CHECK(lxi_identification({"1", "", "192.0.2.1", 80, 0}).find("InstrumentAddressString") ==
          std::string::npos);
}

} // namespace lxi_test
