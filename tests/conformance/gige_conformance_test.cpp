// SPDX-License-Identifier: Apache-2.0
// The camera before judges from outside: the GenApi schema, Aravis's camera tester, Wireshark.
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/gige_bench.hpp"
#include "tests/support/private_network.hpp"
#include "transports/gige/gige.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <thread>

namespace gige_conformance_test {

using namespace obscura;
using namespace obscura::test;
using transports::gige::GigeCamera;
using transports::gige::GigeSettings;

namespace {

constexpr const char* address = "127.0.0.9";
const bool private_network = enter_private_network();

bool have(const char* program) {
    return std::system((std::string("command -v ") + program + " >/dev/null 2>&1").c_str()) == 0;
}

/// Says so on standard output and returns true when something the test needs is not there.
bool skipped(std::initializer_list<const char*> programs) {
    if (!private_network) {
        std::cout << "SKIPPED: no network namespace to be had\n";
        return true;
    }
    for (const char* p : programs)
        if (!have(p)) {
            std::cout << "SKIPPED: " << p << " is not installed\n";
            return true;
        }
    return false;
}

std::string output_of(const std::string& command) {
    std::string text;
    FILE* pipe = popen(command.c_str(), "r");
    REQUIRE(pipe != nullptr);
    std::array<char, 4096> buffer{};
    while (const std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe))
        text.append(buffer.data(), n);
    pclose(pipe);
    return text;
}

struct Bench : GigeBench {
    explicit Bench(std::vector<Region> windows, GigeSettings settings = {})
        : GigeBench(limits(), at(std::move(settings))) {
        source.set_windows(std::move(windows));
    }
    static CameraLimits limits() {
        CameraLimits l;
        l.sensor_width = 640;
        l.sensor_height = 480;
        return l;
    }
    static GigeSettings at(GigeSettings s) {
        s.interface = address;
        return s;
    }
};

/// Takes a test event and those of one frame that an ACTION triggers, then schedules another action and tells
/// the camera to stay where it is. The number of events that came; `port` is where to.
int exchange_events_and_actions(std::uint16_t& port) {
    GigeClient client(address);
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in here{}, camera{};
    here.sin_family = camera.sin_family = AF_INET;
    here.sin_addr.s_addr = inet_addr("127.0.0.1");
    camera.sin_addr.s_addr = inet_addr(address);
    camera.sin_port = htons(3956);
    socklen_t bytes = sizeof here;
    REQUIRE(bind(fd, reinterpret_cast<sockaddr*>(&here), sizeof here) == 0);
    REQUIRE(getsockname(fd, reinterpret_cast<sockaddr*>(&here), &bytes) == 0);
    port = ntohs(here.sin_port);
    const timeval timeout{5, 0};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    client.set("GevMCPHostPort", std::int64_t{port});
    for (const char* event : {"Test", "FrameStart", "ExposureStart", "ExposureEnd"}) {
        client.set("EventSelector", event);
        client.set("EventNotification", "On");
    }
    client.set("ActionGroupMask", std::int64_t{1});
    client.set("TriggerMode", "On");
    client.set("TriggerSource", "Action1");
    client.set_flag("GevSCCFGMultiPart", false);
    client.open_stream(2);
    client.execute("AcquisitionStart");
    client.execute("TestEventGenerate");
    std::uint8_t force_ip[8 + 56] = {0x42, 0x01, 0, 0x04, 0, 56, 0, 9};
    const std::uint8_t action[] = {0x42, 0x01, 1, 0, 0, 12, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    const std::uint8_t late[] = {0x42, 0x81, 1, 0, 0, 20, 0, 8, 0, 0, 0, 0, 0, 0,
                                 0,    0,    0, 0, 0, 1,  0, 0, 0, 0, 0, 0, 0, 1};
    const auto send = [&](const auto& datagram) {
        sendto(fd, datagram, sizeof datagram, 0, reinterpret_cast<const sockaddr*>(&camera), sizeof camera);
    };
    send(action);
    int events = 0;
    for (int i = 0; i < 30 && events < 4; ++i) {
        std::uint8_t d[600] = {};
        sockaddr_in from{};
        socklen_t from_bytes = sizeof from;
        const ssize_t n = recvfrom(fd, d, sizeof d, 0, reinterpret_cast<sockaddr*>(&from), &from_bytes);
        if (n < 8) break;
        if (d[3] != 0xC0) continue; // the action's acknowledge
        ++events;
        const std::uint8_t acknowledge[8] = {0, 0, 0, 0xC1, 0, 0, d[6], d[7]};
        sendto(fd, acknowledge, sizeof acknowledge, 0, reinterpret_cast<sockaddr*>(&from), from_bytes);
    }
    send(late);
    send(force_ip);
    client.execute("AcquisitionStop");
    close(fd);
    return events;
}

const std::vector<Region> two_windows = {{0, 0, 640, 240}, {0, 240, 640, 240}};

} // namespace

TEST_CASE("The description validates against the GenApi 1.1 schema") {
    if (skipped({"gresource", "arv-test-0.8"})) return;
    Bench bench({});
    GigeClient client(address);
    std::size_t size = 0;
    const char* xml = arv_device_get_genicam_xml(client.device(), &size);
    const std::string schema = output_of(
        "gresource extract $(command -v arv-test-0.8) /org/aravis/GenApiSchema_Version_1_1.xsd 2>/dev/null");
    REQUIRE(schema.find("GenApi/Version_1_1") != std::string::npos);
    Object<ArvXmlSchema> validator(arv_xml_schema_new_from_memory(schema.data(), schema.size()));
    int line = 0, column = 0;
    GError* error = nullptr;
    const bool valid = arv_xml_schema_validate(validator.get(), xml, size, &line, &column, &error) != 0;
    const std::string message = error != nullptr ? error->message : "";
    g_clear_error(&error);
    INFO(message);
    CHECK(valid);
}

TEST_CASE("arv-test finds nothing to complain about") {
    if (skipped({"arv-test-0.8"})) return;
    GigeSettings settings;
    settings.history_frames = 12;
    Bench bench(two_windows, settings);
    // On a starved machine its receive thread may lose packets for good. Each check is therefore asked up to
    // five times: a fault of ours shows every time.
    std::map<std::string, bool> succeeded;
    std::string report;
    for (int attempt = 0; attempt < 5; ++attempt) {
        report = output_of("arv-test-0.8 -c " OBSCURA_SOURCE_DIR "/tests/conformance/arv-test.cfg 2>&1");
        std::istringstream lines(report);
        for (std::string line; std::getline(lines, line);) {
            const bool success = line.find("SUCCESS") != std::string::npos;
            if (success || line.find("FAILURE") != std::string::npos)
                succeeded[line.substr(0, line.find(' '))] |= success;
        }
        if (std::all_of(succeeded.begin(), succeeded.end(), [](const auto& check) { return check.second; }))
            break;
    }
    INFO(report);
    for (const auto& [check, success] : succeeded) {
        CAPTURE(check);
        CHECK(success);
    }
    for (const char* test : {"Genicam:Load", "Properties:SensorSizeCheck", "Properties:GainReadout",
                             "MultipleAcquisitionA:FrameRate", "SingleAcquisition:BufferCheck",
                             "SoftwareTrigger:BufferCheck", "MultipleAcquisitionB:FrameRate",
                             "Multipart:BufferCheck", "Chunks:BufferCheck", "GigEVision:StreamChannel"}) {
        CAPTURE(test);
        CHECK(succeeded.count(test) == 1);
    }
    for (const char* test : {"Multipart:NoSupport", "Chunks:NoSupport", "SoftwareTrigger:NoSupport"})
        CHECK(succeeded.count(test) == 0);
}

TEST_CASE("arv-tool lists, reads and sets") {
    if (skipped({"arv-tool-0.8"})) return;
    Bench bench({});
    const std::string tool = std::string("arv-tool-0.8 -a ") + address + " ";
    CHECK(output_of("arv-tool-0.8 2>&1").find("Obscura") != std::string::npos);
    CHECK(output_of(tool + "features 2>&1").find("ExposureTime") != std::string::npos);
    CHECK(output_of(tool + "control Width=320 ExposureTime=2500 2>&1").find("320") != std::string::npos);
    CHECK(bench.source.settings().region.width == 320);
    CHECK(bench.source.settings().exposure_ns == 2'500'000);
    const std::string values = output_of(tool + "values 2>&1");
    CHECK(values.find("'Width' = 320") != std::string::npos);
    CHECK(values.find("CRITICAL") == std::string::npos);
    CHECK(output_of(tool + "genicam 2>&1").find("</RegisterDescription>") != std::string::npos);
    CHECK(output_of(tool + "control Width=100000 2>&1").find("invalid-parameter") != std::string::npos);
}

TEST_CASE("Wireshark's dissectors find no malformed packet") {
    if (skipped({"tshark"})) return;
    const auto file =
        std::filesystem::temp_directory_path() / ("gige_" + std::to_string(getpid()) + ".pcapng");
    const pid_t tshark = fork();
    if (tshark == 0) {
        execlp("tshark", "tshark", "-q", "-i", "lo", "-w", file.c_str(), static_cast<char*>(nullptr));
        _exit(127);
    }
    for (int i = 0; i < 2400 && !(std::filesystem::exists(file) && std::filesystem::file_size(file) > 0); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    int received = 0, events = 0;
    std::uint16_t event_port = 0;
    {
        GigeSettings settings;
        settings.drop_percent = 2;
        settings.history_frames = 12;
        Bench bench(two_windows, settings);
        arv_update_device_list();
        for (int kind = 0; kind < 4; ++kind) {
            GigeClient client(address);
            client.set("AcquisitionFrameRate", 20.0);
            client.set("GevGVSPExtendedIDMode", kind == 1 ? "On" : "Off");
            client.set_flag("ChunkModeActive", kind >= 2);
            client.set("ChunkSelector", "GroundTruth");
            client.set_flag("ChunkEnable", true);
            client.set_flag("GevSCCFGMultiPart", kind == 3);
            client.open_stream(8);
            client.execute("AcquisitionStart");
            for (int i = 0; i < 5; ++i) {
                auto buffer = client.next();
                received +=
                    buffer != nullptr && arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS;
                if (buffer) client.give_back(std::move(buffer));
            }
            client.execute("AcquisitionStop");
        }
        events = exchange_events_and_actions(event_port);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    kill(tshark, SIGINT);
    int status = 0;
    waitpid(tshark, &status, 0);
    CHECK(received == 20);
    // Events come to a port of the client's choice, which the dissector cannot know.
    const std::string read = "tshark -r " + file.string() +
                             " --enable-heuristic gvsp_udp -d udp.port==" + std::to_string(event_port) +
                             ",gvcp 2>/dev/null ";
    const auto count = [&](const std::string& filter) {
        std::istringstream lines(output_of(read + "-Y '" + filter + "' | wc -l"));
        int n = 0;
        lines >> n;
        return n;
    };
    CHECK(count("gvcp") > 200);
    CHECK(count("gvsp") > 20 * 400);
    CHECK(count("gvsp.format == 7 || gvsp.format == 0x87") > 5 * 400); // multi-part
    CHECK(count("gvcp.cmd.command == 0x0040") > 50);                   // resend requests
    CHECK(events == 4);
    CHECK(count("gvcp.cmd.command == 0x00c0") >= 4); // events and their acknowledges
    CHECK(count("gvcp.ack == 0x00c1") >= 4);
    CHECK(count("gvcp.cmd.command == 0x0100") == 2); // actions
    CHECK(count("gvcp.cmd.command == 0x0004") == 1); // FORCEIP
    CHECK(count("_ws.malformed") == 0);
    std::filesystem::remove(file);
}

} // namespace gige_conformance_test
