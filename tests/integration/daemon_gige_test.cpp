// The whole daemon inside the test, seen by an independent GigE Vision client (libaravis).
#include "core/clock.hpp"
#include "emulator/daemon.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/integration/event_socket.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "transports/gige/fault_injector.hpp"

#include <fmt/format.h>

using namespace obscura;
using namespace obscura::test;

namespace {

std::uint64_t tai_now() {
    const MonotonicClock clock;
    return static_cast<std::uint64_t>(clock.now().ns + clock.tai_offset_ns());
}

void listen_to(GigeClient& client, const EventSocket& events, const char* event) {
    client.set("GevMCPHostPort", std::int64_t{events.port()});
    client.set("EventSelector", event);
    client.set("EventNotification", "On");
}

} // namespace

TEST_CASE("a client hears of triggers that were missed") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(11);
    options.size = 128;
    options.rate_hz = 2000; // the exposure alone takes 5 ms
    emulator::Daemon daemon(config::load(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    EventSocket events;
    listen_to(client, events, "FrameTriggerMissed");
    client.open_stream(4);
    const std::uint64_t begin = tai_now();
    client.execute("AcquisitionStart");
    std::uint64_t before = begin;
    for (int i = 0; i < 3; ++i) {
        const auto missed = events.receive(5000);
        REQUIRE(missed);
        CHECK(missed->id == 0x9004);
        CHECK(missed->block == 0);
        // Stamped with the edge that was missed, in the order in which they came.
        CHECK(missed->timestamp > before - (i == 0 ? 1'000'000 : 0));
        CHECK(missed->timestamp < tai_now());
        before = missed->timestamp;
    }
    client.execute("AcquisitionStop");
    CHECK(daemon.camera().counters().missed_triggers >= 3);
}

TEST_CASE("a client hears of frames that could not be made in time") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(12);
    options.size = 512;
    options.rate_hz = 20;
    options.more = "[deadline]\npolicy = \"drop\"\n";
    emulator::Daemon daemon(config::load(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    EventSocket events;
    listen_to(client, events, "Error");
    client.set("ExposureTime", 10.0); // the first row is due sooner than any renderer can be
    client.open_stream(4);
    client.execute("AcquisitionStart");
    const auto error = events.receive(5000);
    client.execute("AcquisitionStop");
    REQUIRE(error);
    CHECK(error->id == 0x9005);
    CHECK(error->block == 1);
    CHECK(daemon.camera().counters().late_dropped >= 1);
}

TEST_CASE("fault rules of the configuration strike the stream") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(13);
    options.size = 128;
    options.rate_hz = 40;
    options.more = "[[gige.faults]]\nkind = \"skip_frame\"\nfirst = 2\nlast = 6\nevery = 2\n"
                   "[[gige.faults]]\nkind = \"lose\"\npercent = 20\n";
    emulator::Daemon daemon(config::load(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    client.open_stream(12);
    client.execute("AcquisitionStart");
    for (const std::uint64_t id : {1U, 3U, 5U, 7U, 8U}) {
        const auto buffer = client.next(5000);
        REQUIRE(buffer != nullptr);
        CHECK(arv_buffer_get_frame_id(buffer.get()) == id);
        CHECK(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
    }
    client.execute("AcquisitionStop");
    CHECK_THAT(daemon.statistics_json(), Catch::Matchers::ContainsSubstring("\"injected_losses\""));
}

TEST_CASE("the configuration knows every fault by the name that the camera has for it") {
    using namespace transports::gige;
    const TempFolder folder;
    for (std::size_t i = 0; i < fault_count; ++i) {
        DaemonOptions options;
        options.address = own_address(14);
        options.size = 64;
        options.more = fmt::format("[[gige.faults]]\nkind = \"{}\"\n", fault_name(static_cast<Fault>(i)));
        const config::Config config = config::load(write_configuration(folder, options));
        CHECK(config.gige.faults.at(0).kind == fault_name(static_cast<Fault>(i)));
        CHECK_NOTHROW(emulator::Daemon(config));
    }
}
