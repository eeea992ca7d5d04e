// SPDX-License-Identifier: Apache-2.0
// The camera under a description that is not ours: bound by name, driven by an independent client.
#include "core/clock.hpp"
#include "core/error.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/gige_bench.hpp"
#include "tests/support/pattern_camera.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/genicam/user_xml.hpp"
#include "transports/gige/gige.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace gige_user_xml_test {

using namespace obscura;
using namespace obscura::test;
using namespace obscura::transports::gige;

namespace {

const std::string address = own_loopback_address();
const std::string flight_xml = OBSCURA_SOURCE_DIR "/tests/support/flight_camera.xml";

struct Bench : GigeBench {
    explicit Bench(const std::string& values = "") : GigeBench(limits(), settings(values)) {}
    static CameraLimits limits() {
        CameraLimits l;
        l.sensor_width = 128;
        l.sensor_height = 96;
        l.temperature_c = -12.5;
        return l;
    }
    static GigeSettings settings(const std::string& values) {
        GigeSettings s;
        s.interface = address;
        s.xml = flight_xml;
        s.xml_values = values;
        return s;
    }
};

/// A register table just large enough to bind to, for the text of a file.
std::string complaint(const std::string& xml, const std::string& values = "") {
    MonotonicClock clock;
    PatternCamera source(Bench::limits());
    const std::string file = "/tmp/gige_user_xml_" + std::to_string(getpid());
    std::ofstream(file) << xml;
    GigeSettings s = Bench::settings(values);
    s.xml = file;
    GigeCamera camera(s, source, clock);
    std::string what;
    try {
        camera.start();
        camera.stop();
    } catch (const ConfigError& e) {
        what = e.what();
    }
    std::remove(file.c_str());
    const std::size_t at = what.find(file);
    return at == std::string::npos ? what : what.erase(at, file.size());
}

std::string description(const std::string& nodes) {
    return R"(<RegisterDescription SchemaMajorVersion="1" SchemaMinorVersion="1" SchemaSubMinorVersion="0">)" +
           nodes + R"(<Port Name="Device"/></RegisterDescription>)";
}

/// Zip archive of entries "name, content, method", as `zip` writes them; deflated by zlib.
std::string zip_of(const std::vector<std::array<std::string, 2>>& files, int method = 8,
                   std::uint32_t plain_bytes = 0) {
    std::string zip, directory;
    const auto number = [](std::string& to, std::size_t value, int bytes) {
        for (int i = 0; i < bytes; ++i)
            to += static_cast<char>(value >> 8 * i & 0xFF);
    };
    for (const auto& [name, content] : files) {
        std::string packed = content;
        if (method == 8) {
            packed.resize(content.size() + 1024);
            z_stream stream{};
            REQUIRE(::deflateInit2(&stream, 9, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) == Z_OK);
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
            stream.avail_in = static_cast<uInt>(content.size());
            stream.next_out = reinterpret_cast<Bytef*>(packed.data());
            stream.avail_out = static_cast<uInt>(packed.size());
            REQUIRE(::deflate(&stream, Z_FINISH) == Z_STREAM_END);
            packed.resize(stream.total_out);
            ::deflateEnd(&stream);
        }
        const auto crc =
            ::crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size()));
        const std::size_t at = zip.size();
        std::string facts; // what both headers have
        for (const auto& [value, bytes] : {std::pair<std::size_t, int>{20, 2},
                                           {0, 2},
                                           {method, 2},
                                           {0, 4},
                                           {crc, 4},
                                           {packed.size(), 4},
                                           {plain_bytes != 0 ? plain_bytes : content.size(), 4},
                                           {name.size(), 2},
                                           {0, 2}})
            number(facts, value, bytes);
        zip += "PK\3\4" + facts + name + packed;
        directory += "PK\1\2" + std::string(2, '\0') + facts + std::string(10, '\0');
        number(directory, at, 4);
        directory += name;
    }
    const std::size_t at = zip.size();
    zip += directory + "PK\5\6" + std::string(4, '\0');
    number(zip, files.size(), 2);
    number(zip, files.size(), 2);
    number(zip, directory.size(), 4);
    number(zip, at, 4);
    return zip + std::string(2, '\0');
}

} // namespace

TEST_CASE("A description is taken as cameras hand it out: with marks, padded, zipped") {
    std::stringstream text;
    text << std::ifstream(flight_xml).rdbuf();
    const std::string xml = text.str();
    CHECK(complaint("\xEF\xBB\xBF" + xml).empty());
    CHECK(complaint(xml + std::string(3, '\0')).empty());
    for (const int method : {0, 8}) {
        CHECK(complaint(zip_of({{"flight.xml", xml}}, method)).empty());
        CHECK(complaint(zip_of({{"d/", ""}, {"d/flight.XML", xml}, {"read.me", "x"}}, method)).empty());
        CHECK(complaint(zip_of({{"flight", "\xEF\xBB\xBF" + xml + '\0'}}, method) + std::string(3, '\0'))
                  .empty());
    }
    const std::string archive = "gige.xml: : zip archive: ";
    CHECK(complaint(zip_of({{"a.xml", xml}, {"b.xml", xml}})) ==
          archive + "holds 2 files, 2 of them *.xml, wanted is one");
    CHECK(complaint(zip_of({})) == archive + "has no directory");
    CHECK(complaint(zip_of({{"d/", ""}})) == archive + "holds 0 files, 0 of them *.xml, wanted is one");
    CHECK(complaint(zip_of({{"a", ""}, {"b", ""}})) ==
          archive + "holds 2 files, 0 of them *.xml, wanted is one");
    CHECK(complaint(zip_of({{"a.xml", xml}}, 12)) ==
          archive + "compression method 12, allowed are 0 (stored) and 8 (deflated)");
    CHECK(complaint(zip_of({{"a.xml", xml}}, 8, 1U << 30)) ==
          archive + "1073741824 bytes when unpacked, allowed are 1 to 16777216");
    CHECK(complaint(zip_of({{"a.xml", xml}}, 8, static_cast<std::uint32_t>(xml.size()) - 1)) ==
          archive + "its data is damaged");
    CHECK(complaint(zip_of({{"a.xml", xml}}).substr(0, 900)) == archive + "has no directory");
    // A byte changed anywhere: one line, or the same document. Cut in front of its last record: one line.
    constexpr std::size_t last_record_bytes = 22;
    const std::string zip = zip_of({{"a.xml", xml}});
    for (std::size_t at = 0; at < zip.size(); at += 37) {
        std::string damaged = zip;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
        CHECK(complaint(damaged).find('\n') == std::string::npos);
        CHECK_FALSE(complaint(zip.substr(0, std::min(at + 1, zip.size() - last_record_bytes))).empty());
    }
}

TEST_CASE("A foreign description shows the camera's own state from the start") {
    Bench bench("HeaterSetPoint = -7, SerialText=FM-03");
    GigeClient client(address);
    CHECK(client.integer("SensorWidth") == 128);
    CHECK(client.integer("SensorHeight") == 96);
    CHECK(client.integer("Width") == 128);
    CHECK(client.text("PixelFormat") == "Mono16");
    CHECK(client.integer("PayloadSize") == 128 * 96 * 2);
    CHECK(client.real("ExposureTime") == 10'000.0);
    CHECK(client.real("AcquisitionFrameRate") == 50.0);
    CHECK(client.integer("HeaterSetPoint") == -7);
    CHECK(client.text("SerialText") == "FM-03");
    CHECK(client.text("DeviceVendorName") == "Obscura");
    CHECK(client.text("TriggerSource") == "Line2"); // whatever line it is called
    CHECK(client.integer("GevSCPSPacketSize") == 1500);
}

TEST_CASE("Writing features by their own registers drives the camera") {
    Bench bench;
    GigeClient client(address);
    client.set("Width", std::int64_t{64});
    client.set("Height", std::int64_t{48});
    client.set("OffsetX", std::int64_t{5});
    client.set("OffsetY", std::int64_t{7});
    CHECK(bench.source.settings().region == Region{5, 7, 64, 48});
    client.set("ExposureTime", 1234.0);
    CHECK(bench.source.settings().exposure_ns == 1'234'000);
    CHECK(client.text("ExposureAuto") == "Off");
    client.set("ExposureAuto", "Once");
    CHECK(bench.source.settings().exposure_auto == ExposureAuto::once);
    CHECK_THROWS(client.set("ExposureTime", 1300.0)); // the camera's own now
    CameraSettings found = bench.source.settings();
    found.exposure_auto = ExposureAuto::off; // it has found what it looked for
    found.exposure_ns = 777'000;
    REQUIRE(bench.source.apply(found));
    CHECK(client.text("ExposureAuto") == "Off");
    CHECK(client.real("ExposureTime") == 777.0);
    client.set("Gain", 3.25);
    CHECK(bench.source.settings().gain_db == 3.25);
    client.set("AcquisitionFrameRate", 40.0);
    CHECK(bench.source.settings().frame_rate_hz == 40.0);
    client.set("PixelFormat", "Mono8");
    CHECK(bench.source.settings().pixel_format == PixelFormat::mono8);
    CHECK(client.integer("PayloadSize") == 64 * 48);
    CHECK(client.text("BinningHorizontalMode") == "Sum");
    client.set("BinningHorizontalMode", "Average");
    client.set("BinningHorizontal", std::int64_t{4}); // the file's Width follows
    CHECK(client.integer("Width") == 16);
    CHECK(client.integer("OffsetX") == 1);
    CHECK(bench.source.settings().region == Region{4, 7, 64, 48});
    CHECK(client.integer("PayloadSize") == 16 * 48);
    CHECK_THROWS(client.set("BinningHorizontal", std::int64_t{3}));
    CHECK(client.integer("BinningHorizontal") == 4);
    client.set("BinningHorizontal", std::int64_t{1});
    client.set("OffsetX", std::int64_t{5});
    CHECK(client.integer("Width") == 64);

    // What the camera cannot do is refused, and the registers show what it does.
    CHECK_THROWS(client.set("OffsetX", std::int64_t{100}));
    CHECK(client.integer("OffsetX") == 5);
    CHECK_THROWS(client.set("PixelFormat", "BayerRG8"));
    CHECK(client.text("PixelFormat") == "Mono8");
    CHECK_THROWS(client.set("Gain", 99.0));
    CHECK(client.real("Gain") == 3.25);

    // The trigger that is not ours is memory; the one that is drives the camera.
    client.set("TriggerSelector", "AcquisitionStart");
    client.set("TriggerMode", "On");
    CHECK_FALSE(bench.source.settings().frame_trigger.enabled);
    client.set("TriggerSelector", "FrameStart");
    CHECK(client.text("TriggerMode") == "Off");
    client.set("TriggerMode", "On");
    client.set("TriggerSource", "Software");
    CHECK(bench.source.settings().frame_trigger.enabled);
    CHECK(bench.source.settings().frame_trigger.source == TriggerSource::software);

    // Everything else is memory, indexed registers too; what is read-only is not written.
    for (const std::int64_t mode : {0, 7}) {
        client.set("ModeSelector", mode);
        client.set("ModeWord", 100 + mode);
    }
    client.set("ModeSelector", std::int64_t{0});
    CHECK(client.integer("ModeWord") == 100);
    client.set("ModeSelector", std::int64_t{7});
    CHECK(client.integer("ModeWord") == 107);
    GError* error = nullptr;
    CHECK_FALSE(arv_device_write_register(client.device(), 0x30064, 1, &error));
    REQUIRE(error != nullptr);
    CHECK(std::string(error->message).find("write-protect") != std::string::npos);
    g_clear_error(&error);
    CHECK_FALSE(arv_device_write_register(client.device(), 0xA020, 1, &error)); // our own Width is not there
    g_clear_error(&error);

    client.set("GevHeartbeatTimeout", std::int64_t{5000}); // a bootstrap register is itself
    CHECK_THROWS(client.set("GevHeartbeatTimeout", std::int64_t{1}));
}

TEST_CASE("Commands that are bits of a register start, trigger and stop") {
    Bench bench;
    GigeClient client(address);
    client.set("TriggerSelector", "FrameStart");
    client.set("TriggerMode", "On");
    client.set("TriggerSource", "Software");
    client.open_stream(4);
    for (int round = 0; round < 2; ++round) {
        client.execute("AcquisitionStart");
        CHECK(bench.source.acquiring());
        CHECK_THROWS(client.set("Width", std::int64_t{64})); // locked while streaming
        CHECK(client.integer("Width") == 128);
        client.set("ExposureTime", 500.0 + round);
        client.execute("TriggerSoftware");
        auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        CHECK(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        CHECK(arv_buffer_get_image_width(buffer.get()) == 128);
        client.give_back(std::move(buffer));
        client.execute("AcquisitionStop");
        CHECK_FALSE(bench.source.acquiring());
    }
    CHECK(bench.source.triggers() == 2);
}

TEST_CASE("A broken or hostile description is refused in one line") {
    CHECK(complaint("") == "gige.xml: : 0 bytes, allowed are 1 to 16777216");
    const std::string none =
        "gige.xml: : not a GenICam description (XML with the root RegisterDescription is wanted)";
    CHECK(complaint("<html></html>") == none);
    CHECK(complaint("no xml at all").find("gige.xml: : no XML: Error on line 1") == 0);
    CHECK(complaint("<RegisterDescription>").find("gige.xml: : no XML: ") == 0);
    CHECK(complaint(description(R"(<Integer Name="A"><pValue>B</pValue></Integer>
        <Integer Name="B"><pValue>A</pValue></Integer>)")) == "gige.xml: : A: refers to itself");
    CHECK(complaint(description(R"(<IntSwissKnife Name="A"><pVariable Name="X">A</pVariable>
        <Formula>X</Formula></IntSwissKnife>)")) == "gige.xml: : A: refers to itself");
    CHECK(complaint(description(R"(<IntReg Name="R"><Address>0</Address><Length>4294967295</Length>
        <pPort>Device</pPort></IntReg>)")) ==
          "gige.xml: : R: Length \"4294967295\", allowed are 1 to 65536 bytes");
    // Half of the nodes twice each, forty deep: never evaluated, and no reason to refuse the file.
    std::string bush;
    for (int i = 0; i < 40; ++i)
        bush += "<IntSwissKnife Name=\"N" + std::to_string(i) + "\"><pVariable Name=\"X\">N" +
                std::to_string(i + 1) + "</pVariable><pVariable Name=\"Y\">N" + std::to_string(i + 1) +
                "</pVariable><Formula>X+Y</Formula></IntSwissKnife>";
    CHECK(complaint(description(bush + R"(<Integer Name="N40"><Value>1</Value></Integer>
        <Integer Name="Width"><pValue>N0</pValue></Integer>)"))
              .empty());

    std::ifstream in(flight_xml);
    std::stringstream text;
    text << in.rdbuf();
    CHECK(complaint(text.str()).empty());
    CHECK(complaint(text.str(), "HeaterSetPoint") ==
          "gige.xml_values: \"HeaterSetPoint\": no =, allowed is Feature=value of a feature in ");
    CHECK(complaint(text.str(), "Nonsense=1") ==
          "gige.xml_values: \"Nonsense=1\": no such feature, allowed is Feature=value of a feature in ");
    CHECK(complaint(text.str(), "Gain=99") == "gige.xml_values: \"Gain=99\": outside what the camera allows");
    for (std::size_t cut = 1; cut + 30 < text.str().size(); cut += 397) {
        const std::string what = complaint(text.str().substr(0, cut));
        CAPTURE(cut, what);
        CHECK(what.find("gige.xml: : no XML: ") == 0);
        CHECK(what.find('\n') == std::string::npos);
    }
    // A byte changed anywhere: refused, or bound as far as it goes.
    for (std::size_t at = 700; at < text.str().size(); at += 211) {
        std::string damaged = text.str();
        damaged[at] = damaged[at] == 'x' ? 'y' : 'x';
        CHECK_NOTHROW(complaint(damaged));
    }
}

TEST_CASE("The start-up line lists what is driven and what is not there") {
    MonotonicClock clock;
    PatternCamera source(Bench::limits());
    RegisterBank bank;
    for (const std::uint32_t a : {address_of("Width"), address_of("Height")})
        bank.add({.name = "Extent", .address = a, .access = Access::read_write, .reset = 64, .maximum = 128});
    UserXml xml("dir/small file.xml", description(R"(
        <IntReg Name="Width"><Address>0xC000</Address><Length>4</Length><AccessMode>RW</AccessMode>
        <pPort>Device</pPort><Endianess>BigEndian</Endianess></IntReg>
        <Float Name="PixelFormat"><Value>1</Value></Float>)"),
                "", bank, feature_table());
    CHECK(xml.report().find(
              "small file.xml: 1 registers; driven: Width; not in the file: DeviceVendorName") == 0);
    CHECK(xml.report().find("not driven: PixelFormat (of another type)") != std::string::npos);
    CHECK(xml.url().find("Local:smallfile.xml;100000;") == 0);
    std::uint8_t word[4] = {};
    REQUIRE(xml.read(0xC000, word) == Status::success);
    CHECK(word[3] == 64);
    std::size_t done = 0;
    const std::uint8_t large[4] = {0, 0, 1, 0};
    CHECK(xml.write(0xC000, large, done) == Status::invalid_parameter);
    CHECK(xml.read(address_of("SensorWidth"), word) == Status::invalid_address);
    CHECK(xml.read(0xC002, word) == Status::bad_alignment);
}

TEST_CASE("Of several commands in a register the value written starts its own") {
    RegisterBank bank;
    std::string started;
    const auto command = [&](const char* name, char sign) {
        bank.add({.name = name,
                  .address = address_of(name),
                  .access = Access::read_write,
                  .write = [&started, sign](std::uint32_t) {
                      started += sign;
                      return Status::success;
                  }});
    };
    command("AcquisitionStart", '+');
    command("AcquisitionStop", '-');
    command("TriggerSoftware", 't');
    UserXml xml("commands.zip", description(R"(
        <Command Name="AcquisitionStart"><pValue>Control</pValue><CommandValue>1</CommandValue></Command>
        <Command Name="AcquisitionStop"><pValue>Control</pValue><CommandValue>0</CommandValue></Command>
        <Command Name="TriggerSoftware"><pValue>Control</pValue><CommandValue>2</CommandValue></Command>
        <IntReg Name="Control"><Address>0xC000</Address><Length>4</Length><AccessMode>RW</AccessMode>
        <pPort>Device</pPort><Endianess>BigEndian</Endianess></IntReg>)"),
                "", bank, feature_table());
    CHECK(xml.url().find("Local:commands.xml;") == 0); // served unpacked
    const auto write = [&](std::uint8_t value) {
        const std::uint8_t word[4] = {0, 0, 0, value};
        std::size_t done = 0;
        started.clear();
        CHECK(xml.write(0xC000, word, done) == Status::success);
        return started;
    };
    CHECK(write(1) == "+");
    CHECK(write(2) == "t");
    CHECK(write(0) == "-");
    CHECK(write(3).empty());
    CHECK(write(1) == "+");
}

} // namespace gige_user_xml_test
