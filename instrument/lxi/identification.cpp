// SPDX-License-Identifier: Apache-2.0
#include "instrument/lxi/identification.hpp"

#include "core/text/text.hpp"

#include <fmt/format.h>

namespace obscura::instrument {
namespace {

constexpr std::string_view document_path = "/lxi/identification";

std::string answer(std::string_view status, std::string_view headers, std::string_view type,
                   std::string_view body) {
    return fmt::format("HTTP/1.1 {}\r\n"
                       "{}Content-Type: {}\r\n"
                       "Content-Length: {}\r\n"
                       "Cache-Control: no-store\r\n"
                       "X-Content-Type-Options: nosniff\r\n"
                       "Connection: close\r\n"
                       "\r\n"
                       "{}",
                       status, headers, type, body.size(), body);
}

std::string refusal(std::string_view status, std::string_view headers = {}) {
    return answer(status, headers, "text/plain", fmt::format("{}\n", status));
}

} // namespace

std::string lxi_identification(const LxiIdentity& identity) {
    constexpr std::string_view space = "http://www.lxistandard.org/InstrumentIdentification/1.0";
    const std::string scpi =
        identity.scpi_port == 0
            ? std::string()
            : fmt::format("    <InstrumentAddressString>TCPIP::{}::{}::SOCKET</InstrumentAddressString>\n",
                          identity.address, identity.scpi_port);
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<LXIDevice xmlns=\"{0}\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:schemaLocation=\"{0} {0}\">\n"
        "  <Manufacturer>Obscura</Manufacturer>\n"
        "  <Model>obscura-instrument</Model>\n"
        "  <SerialNumber>0</SerialNumber>\n"
        "  <FirmwareRevision>{1}</FirmwareRevision>\n"
        "  <ManufacturerDescription>Stand-in for a space camera</ManufacturerDescription>\n"
        "  <IdentificationURL>http://{2}:{3}{4}</IdentificationURL>\n"
        "  <Interface xsi:type=\"NetworkInformation\" InterfaceType=\"LXI\" IPType=\"IPv4\">\n"
        "{5}    <Hostname>{6}</Hostname>\n"
        "    <IPAddress>{2}</IPAddress>\n"
        "    <SubnetMask></SubnetMask>\n"
        "    <MACAddress></MACAddress>\n"
        "    <Gateway></Gateway>\n"
        "    <DHCPEnabled>false</DHCPEnabled>\n"
        "    <AutoIPEnabled>false</AutoIPEnabled>\n"
        "  </Interface>\n"
        "  <LXIVersion>1.5, identification only</LXIVersion>\n"
        "</LXIDevice>\n",
        space, escaped_xml(identity.version), identity.address, identity.http_port, document_path, scpi,
        escaped_xml(identity.host));
}

std::string lxi_answer(std::string_view head, const LxiIdentity& identity) {
    const std::string_view line = head.substr(0, head.find_first_of("\r\n"));
    const std::size_t first = line.find(' '), last = line.rfind(' ');
    if (first == std::string_view::npos || last == first || !line.substr(last + 1).starts_with("HTTP/1."))
        return refusal("400 Bad Request");
    if (line.substr(0, first) != "GET") return refusal("405 Method Not Allowed", "Allow: GET\r\n");
    const std::string_view path = line.substr(first + 1, last - first - 1);
    if (path == document_path) return answer("200 OK", {}, "text/xml", lxi_identification(identity));
    if (path == "/lxi" || path == "/lxi/")
        return refusal("302 Found", fmt::format("Location: {}\r\n", document_path));
    return refusal("404 Not Found");
}

} // namespace obscura::instrument
