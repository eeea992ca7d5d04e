// SPDX-License-Identifier: Apache-2.0
#include "config/document.hpp"
#include "core/error.hpp"
#include "sync/conditioner.hpp"
#include "sync/inputs/gpio_line_name.hpp"
#include "sync/inputs/ipv4_endpoint.hpp"
#include "sync/ptp_monitor.hpp"
#include "sync/settings.hpp"
#include "sync/sources/gpio.hpp"
#include "sync/sources/ptp.hpp"
#include "sync/sources/ptp_timer.hpp"
#include "sync/sources/udp.hpp"
#include "tests/support/catch.hpp"

#include <arpa/inet.h>

#include <functional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace settings_test {

using namespace obscura;
using namespace obscura::sync;

namespace {

/// What "c.toml" with this text is refused for; empty when it is good.
template<typename Settings>
std::string complaint(std::string_view text, Settings& settings) {
    const config::Value root = config::parse_text(text, "c.toml");
    config::Mistakes mistakes;
    config::read_member(root, {"c.toml", ""}, section_of(settings), mistakes);
    try {
        mistakes.throw_if_any();
    } catch (const ConfigError& error) {
        return error.what();
    }
    return "";
}

std::string trigger_complaint(std::string_view text) {
    TriggerSettings trigger;
    return complaint(text, trigger);
}

TriggerSettings read_trigger(std::string_view text) {
    TriggerSettings trigger;
    REQUIRE(complaint(text, trigger) == "");
    return trigger;
}

std::string ptp_complaint(std::string_view text) {
    PtpSettings ptp;
    return complaint(text, ptp);
}

/// Lines of TOML without comments, joined by "|".
std::string without_comments(const std::string& toml) {
    std::istringstream in(toml);
    std::string line, all;
    while (std::getline(in, line))
        if (!line.empty() && line.front() != '#') all += line + "|";
    return all;
}

} // namespace

TEST_CASE("the defaults of [trigger] are a timer of 10 Hz at Line0 and nothing at the further lines") {
    const TriggerSettings defaults = read_trigger("");
    CHECK(defaults == TriggerSettings{});
    CHECK(defaults.lines[0].source == "timer");
    CHECK(defaults.lines[0].rate_hz == 10);
    CHECK(defaults.over_trigger == OverTrigger::count);
    for (std::size_t number = 0; number < line_count; ++number) {
        CHECK(defaults.lines[number].number == number);
        CHECK(defaults.lines[number].connected() == (number == 0));
    }
    CHECK(defaults.lines[0].table() == "trigger");
    CHECK(defaults.lines[3].table() == "trigger.line3");
}

TEST_CASE("[trigger] and its further lines are read, keys of sources that are not chosen included") {
    TriggerSettings trigger = read_trigger(R"([trigger]
source = "ptp_timer"
rate_hz = 2.5
phase_ms = 0.25
device = "/dev/ptp3"
start = "1795244437.5"
line = "SPARE"
over_trigger = "latch"
[trigger.line2]
source = "gpio"
line = "gpiochip0:7"
edge = "both"
debounce_us = 1.5
divider = 4
delay_us = 20
channel = 2
listen = "0.0.0.0:6000"
)");
    TriggerLineSettings& line0 = trigger.lines[0];
    CHECK(line0.source == "ptp_timer");
    CHECK(line0.rate() == RationalRate{5, 2});
    CHECK(line0.phase_ns() == 250'000);
    CHECK(line0.device_node() == "/dev/ptp3");
    CHECK(line0.kinds.get<PtpTimerKind>().start == "1795244437.5");
    CHECK(line0.kinds.get<GpioKind>().line == "SPARE");
    CHECK(trigger.over_trigger == OverTrigger::latch);
    CHECK_FALSE(trigger.lines[1].connected());
    TriggerLineSettings& line2 = trigger.lines[2];
    CHECK(line2.kinds.get<GpioKind>().line == "gpiochip0:7");
    CHECK(line2.kinds.get<GpioKind>().edge == GpioEdge::both);
    CHECK(line2.kinds.get<PtpKind>().channel == 2);
    CHECK(line2.kinds.get<UdpKind>().listen == "0.0.0.0:6000");
    const ConditionerSettings conditioner = conditioner_settings(line2);
    CHECK(conditioner.debounce_ns == 1500);
    CHECK(conditioner.divider == 4);
    CHECK(conditioner.delay_ns == 20'000);
    CHECK(nominal_rate(line2) == RationalRate{5, 2});
}

TEST_CASE("copies of a line's settings are deep, and lines compare by all their keys") {
    TriggerSettings a = read_trigger("[trigger]\nsource = \"gpio\"\nline = \"A\"\n");
    TriggerSettings b = a;
    CHECK(a == b);
    b.lines[0].kinds.get<GpioKind>().line = "B";
    CHECK(a.lines[0].kinds.get<GpioKind>().line == "A");
    CHECK_FALSE(a == b);
    b = a;
    CHECK(a == b);
    b.lines[3].kinds.get<UdpKind>().listen = "127.0.0.1:1";
    CHECK_FALSE(a == b);
}

TEST_CASE("mistakes in [trigger] are named with place and path of the key") {
    const auto [text, line] = GENERATE(table<const char*, const char*>({
        {"[trigger]\nsource = \"gpio\"\n",
         "c.toml:1:2: trigger.line: is missing, the name of a GPIO line or \"gpiochipN:OFFSET\" is wanted"},
        {"[trigger]\n[trigger.line1]\nsource = \"gpio\"\n",
         "c.toml:2:10: trigger.line1.line: is missing, the name of a GPIO line or \"gpiochipN:OFFSET\" is "
         "wanted"},
        {"[trigger]\nsource = \"gpio\"\nline = \"\"\n",
         "c.toml:3:8: trigger.line: is missing, the name of a GPIO line or \"gpiochipN:OFFSET\" is wanted"},
        {"[trigger]\nsource = \"gpio\"\nline = \"gpiochip0:x\"\n",
         "c.toml:3:8: trigger.line: GPIO line \"gpiochip0:x\": \"x\" is not a line offset; allowed is a "
         "line's name or \"gpiochipN:OFFSET\""},
        {"[trigger]\nsource = \"gpio\"\nline = \"/dev/gpiochip0\"\n",
         "c.toml:3:8: trigger.line: GPIO line \"/dev/gpiochip0\": the line's offset in the chip is missing; "
         "allowed is a line's name or \"gpiochipN:OFFSET\""},
        {"[trigger]\nsource = \"gpio\"\nline = \"ABCDEFGHIJKLMNOPQRSTUVWXYZ012345\"\n",
         "c.toml:3:8: trigger.line: GPIO line \"ABCDEFGHIJKLMNOPQRSTUVWXYZ012345\": longer than 31 "
         "characters; allowed is a line's name or \"gpiochipN:OFFSET\""},
        {"[trigger]\nsource = \"gpio\"\nline = \"A\\nB\"\n",
         "c.toml:3:8: trigger.line: a GPIO line's name has no control characters"},
        {"[trigger]\nsource = \"udp\"\nlisten = \"banana\"\n",
         "c.toml:3:10: trigger.listen: \"banana\": allowed is an IPv4 address and a port, "
         "\"127.0.0.1:5002\""},
        {"[trigger]\n[trigger.line3]\nsource = \"udp\"\nlisten = \"127.0.0.1:0\"\n",
         "c.toml:4:10: trigger.line3.listen: \"127.0.0.1:0\": allowed is an IPv4 address and a port, "
         "\"127.0.0.1:5002\""},
        {"[trigger]\nsource = \"ptp_timer\"\nstart = \"yesterday\"\n",
         "c.toml:3:9: trigger.start: \"yesterday\": seconds like \"1795244437.5\" are wanted, with up to "
         "nine decimals"},
        {"[trigger]\nrate_hz = 0.001\ndivider = 1000000\n",
         "c.toml:3:11: trigger.divider: 1000000 leaves 1e-09 Hz, allowed are 1e-6 Hz and more"},
        {"[trigger]\n[trigger.line2]\nsource = \"pps\"\nrate_hz = 0.001\ndivider = 2000\n",
         "c.toml:5:11: trigger.line2.divider: 2000 leaves 5e-07 Hz, allowed are 1e-6 Hz and more"},
        {"[trigger]\nsource = \"sundial\"\n",
         "c.toml:2:10: trigger.source: \"sundial\" is not known, allowed timer, ptp_timer, gpio, pps, ptp, "
         "udp, lockstep, none"},
        {"[trigger]\n[trigger.line1]\nsource = \"lockstep\"\n",
         "c.toml:3:10: trigger.line1.source: \"lockstep\" is not known, allowed timer, ptp_timer, gpio, "
         "pps, ptp, udp, none"},
        {"[trigger]\nedge = \"up\"\n",
         "c.toml:2:8: trigger.edge: \"up\" is not known, allowed rising, falling, both"},
        {"[trigger]\nchannel = 65\n", "c.toml:2:11: trigger.channel: 65 is out of range, allowed 0 to 64"},
        {"[trigger]\nover_trigger = \"queue\"\n",
         "c.toml:2:16: trigger.over_trigger: \"queue\" is not known, allowed count, ignore, latch"},
        {"[trigger]\n[trigger.line1]\nover_trigger = \"count\"\n",
         "c.toml:3:1: trigger.line1.over_trigger: unknown key, allowed source, rate_hz, phase_ms, line, "
         "edge, device, channel, start, listen, accept_empty, max_rate_hz, debounce_us, divider, delay_us"},
        {"[trigger]\n[trigger.line4]\n", "c.toml:2:10: trigger.line4: unknown key, did you mean \"line1\"?"},
        {"[trigger]\nrate_hz = 20000\n",
         "c.toml:2:11: trigger.rate_hz: 20000 is out of range, allowed 0.001 to 10000 Hz"},
    }));
    CHECK(trigger_complaint(text) == line);
}

TEST_CASE("values of sources that are not chosen are not checked against each other") {
    CHECK(trigger_complaint("[trigger]\nlisten = \"banana\"\nstart = \"yesterday\"\n") == "");
    CHECK(trigger_complaint("[trigger]\n[trigger.line1]\nline = \"gpiochip0\"\n") == "");
}

TEST_CASE("mistakes of several lines are reported together") {
    CHECK(trigger_complaint("[trigger]\n[trigger.line1]\nsource = \"gpio\"\n"
                            "[trigger.line2]\nsource = \"udp\"\nlisten = \"a:1\"\n") ==
          "c.toml:2:10: trigger.line1.line: is missing, the name of a GPIO line or \"gpiochipN:OFFSET\" is "
          "wanted\n"
          "c.toml:6:10: trigger.line2.listen: \"a:1\": allowed is an IPv4 address and a port, "
          "\"127.0.0.1:5002\"");
}

TEST_CASE("[ptp] is read, and the socket of an enabled one is checked") {
    PtpSettings ptp;
    REQUIRE(complaint("[ptp]\nenabled = true\nsocket = \"/run/ptp4l\"\ndomain = 24\nlock_us = 0.5\n", ptp) ==
            "");
    const PtpMonitorSettings monitor = monitor_settings(ptp);
    CHECK(monitor.socket == "/run/ptp4l");
    CHECK(monitor.domain == 24);
    CHECK(monitor.lock_ns == 500);
    CHECK(monitor_settings({}).socket == "/var/run/ptp4l");
    CHECK(monitor_settings({}).lock_ns == 10'000);

    const std::string wanted =
        "c.toml:3:10: ptp.socket: an absolute path of at most 107 characters is wanted, as in /var/run/ptp4l";
    CHECK(ptp_complaint("[ptp]\nenabled = true\nsocket = \"ptp4l\"\n") == wanted);
    CHECK(ptp_complaint("[ptp]\nenabled = true\nsocket = \"\"\n") == wanted);
    CHECK(ptp_complaint("[ptp]\nenabled = true\nsocket = \"/" + std::string(107, 'x') + "\"\n") == wanted);
    CHECK(ptp_complaint("[ptp]\nenabled = true\nsocket = \"/" + std::string(106, 'x') + "\"\n") == "");
    CHECK(ptp_complaint("[ptp]\nenabled = false\nsocket = \"ptp4l\"\n") == "");
    CHECK(ptp_complaint("[ptp]\ndomain = 128\n") ==
          "c.toml:2:10: ptp.domain: 128 is out of range, allowed 0 to 127");
}

TEST_CASE("printed settings have all keys in their order, and the further lines that are connected") {
    TriggerSettings trigger =
        read_trigger("[trigger]\n[trigger.line2]\nsource = \"gpio\"\nline = \"GATE\"\n");
    const std::string printed = config::print_section(section_of(trigger), "camera.");
    CHECK(without_comments(printed) ==
          "[camera.trigger]|source = \"timer\"|rate_hz = 10.0|phase_ms = 0.0|line = \"\"|edge = \"rising\"|"
          "device = \"\"|channel = 0|start = \"\"|listen = \"127.0.0.1:5002\"|"
          "accept_empty = false|max_rate_hz = 1000.0|debounce_us = 0.0|divider = 1|"
          "delay_us = 0.0|over_trigger = \"count\"|"
          "[camera.trigger.line2]|source = \"gpio\"|rate_hz = 10.0|phase_ms = 0.0|line = \"GATE\"|"
          "edge = \"rising\"|device = \"\"|channel = 0|start = \"\"|listen = \"127.0.0.1:5002\"|"
          "accept_empty = false|max_rate_hz = 1000.0|debounce_us = 0.0|divider = 1|delay_us = 0.0|");
    PtpSettings ptp;
    CHECK(without_comments(config::print_section(section_of(ptp), "")) ==
          "[ptp]|enabled = false|socket = \"/var/run/ptp4l\"|domain = 0|lock_us = 10.0|");
}

TEST_CASE("what is printed reads back as the same settings") {
    TriggerSettings trigger = read_trigger("[trigger]\nsource = \"udp\"\nphase_ms = 0.1\n"
                                           "[trigger.line1]\nsource = \"gpio\"\nline = \"GATE\"\n");
    CHECK(read_trigger(config::print_section(section_of(trigger), "")) == trigger);
}

TEST_CASE("every key has its own name and a help text that is understood alone") {
    TriggerSettings trigger;
    PtpSettings ptp;
    std::vector<config::DocumentedTable> tables = config::document(section_of(trigger), "");
    REQUIRE(tables.size() == line_count);
    CHECK(tables[0].heading == "[trigger]");
    CHECK(tables[3].heading == "[trigger.line3]");
    tables.push_back(config::document(section_of(ptp), "").front());
    for (const config::DocumentedTable& table : tables) {
        CHECK_FALSE(table.help.empty());
        std::set<std::string_view> names;
        for (const config::Key& key : table.keys) {
            INFO(table.heading << " " << key.name);
            CHECK(names.insert(key.name).second);
            CHECK(key.help().size() > 20);
            CHECK(key.help().find("The same") == std::string_view::npos);
        }
    }
}

TEST_CASE("a source's own keys name the source in their help") {
    TriggerLineSettings line;
    for (const auto& kind : line.kinds.all())
        for (const config::Key& key : kind->keys())
            CHECK(key.help().starts_with(std::string(kind->traits().name) + ": "));
}

TEST_CASE("a reload takes on the keys of Line0 but over_trigger") {
    TriggerSettings trigger;
    const config::Section section = section_of(trigger);
    for (const config::Key& key : section.keys)
        CHECK(config::is_reloadable(section, key.name) == (key.name != "over_trigger"));
    CHECK_FALSE(config::is_reloadable(section, "line1.source"));
    CHECK_FALSE(config::is_reloadable(section, "line3.listen"));
    PtpSettings ptp;
    CHECK_FALSE(config::is_reloadable(section_of(ptp), "enabled"));
}

TEST_CASE("lines report the edge types of their sources") {
    const auto edges = [](std::string_view text) {
        const LineEdges reported = reported_edges(read_trigger(text), 0);
        return std::pair{reported.rising, reported.falling};
    };
    CHECK(edges("[trigger]\nsource = \"gpio\"\nline = \"A\"\n") == std::pair{true, false});
    CHECK(edges("[trigger]\nsource = \"gpio\"\nline = \"A\"\nedge = \"falling\"\n") ==
          std::pair{false, true});
    CHECK(edges("[trigger]\nsource = \"gpio\"\nline = \"A\"\nedge = \"both\"\n") == std::pair{true, true});
    CHECK(edges("[trigger]\nsource = \"timer\"\nedge = \"both\"\n") == std::pair{true, false});
    CHECK(edges("[trigger]\nsource = \"none\"\n") == std::pair{true, false});
    const TriggerSettings defaults;
    CHECK_FALSE(reported_edges(defaults, 1).rising);
    CHECK_FALSE(reported_edges(defaults.lines[1]).rising);
}

TEST_CASE("sources are made by name") {
    const MonotonicClock clock;
    TriggerLineSettings line;
    line.kinds.get<GpioKind>().line = "TRIG_IN";
    for (const SourceTraits* traits : source_traits()) {
        line.source = traits->name;
        const auto source = make_source(line, clock, {});
        REQUIRE(source != nullptr);
        CHECK(source->name() == traits->name);
    }
    line.source = "none";
    CHECK(make_source(line, clock, {}) == nullptr);
}

TEST_CASE("settings that the section would refuse make no source") {
    const MonotonicClock clock;
    const auto refusal = [&clock](std::size_t number,
                                  const std::function<void(TriggerLineSettings&)>& adjust) {
        TriggerLineSettings line;
        line.number = number;
        adjust(line);
        try {
            (void)make_source(line, clock, {});
        } catch (const ConfigError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK(refusal(1, [](auto& line) { line.source = "gpio"; }) ==
          "trigger.line1.line: is missing, the name of a GPIO line or \"gpiochipN:OFFSET\" is wanted");
    CHECK(refusal(2, [](auto& line) { line.source = "sundial"; }) ==
          "trigger.line2.source: \"sundial\" is not known, allowed timer, ptp_timer, gpio, pps, ptp, udp, "
          "none");
    TriggerLineSettings fast;
    fast.source = "timer";
    fast.rate_hz = 1e9;
    CHECK_THROWS_AS((void)make_source(fast, clock, {}), std::invalid_argument);
}

TEST_CASE("devices are the source's own unless one is named") {
    TriggerLineSettings line;
    line.source = "pps";
    CHECK(line.device_node() == "/dev/pps0");
    line.source = "ptp_timer";
    CHECK(line.device_node() == "/dev/ptp0");
    line.device = "/dev/ptp5";
    CHECK(line.device_node() == "/dev/ptp5");
}

TEST_CASE("GPIO lines are names, or chip and offset") {
    CHECK(parse_gpio_line("TRIG_IN").name == "TRIG_IN");
    CHECK(parse_gpio_line("bank A: in").name == "bank A: in");
    CHECK(parse_gpio_line("gpiochip12:3").device == "/dev/gpiochip12");
    CHECK(parse_gpio_line("gpiochip12:3").offset == 3);
    CHECK(parse_gpio_line("/dev/gpiochip0:31").device == "/dev/gpiochip0");
    for (const char* bad :
         {"", "gpiochip0", "gpiochip0:", "gpiochip0:-1", "gpiochip0:4294967296", "/dev/x:y"})
        CHECK_THROWS_AS(parse_gpio_line(bad), std::invalid_argument);
}

TEST_CASE("endpoints are an IPv4 address and a port") {
    const sockaddr_in good = parse_ipv4_endpoint("10.1.2.3:5002", 1, "example");
    CHECK(ntohl(good.sin_addr.s_addr) == 0x0a010203);
    CHECK(ntohs(good.sin_port) == 5002);
    CHECK(parse_ipv4_endpoint("0.0.0.0:0", 0, "example").sin_port == 0);
    for (const char* bad :
         {"", "1.2.3.4", "1.2.3.4:", "1.2.3.4:70000", "1.2.3.4:+1", "1.2.3.4:1 ", "::1:5", "a:1"})
        CHECK_THROWS_AS(parse_ipv4_endpoint(bad, 0, "example"), std::invalid_argument);
    CHECK_THROWS_WITH(
        parse_ipv4_endpoint("simulator.listen", "banana", 0, "127.0.0.1:5003"),
        "simulator.listen: \"banana\": allowed is an IPv4 address and a port, \"127.0.0.1:5003\"");
}

} // namespace settings_test
