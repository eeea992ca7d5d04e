// SPDX-License-Identifier: Apache-2.0
// SCPI conversations with cameras that only exist in memory.
#include "core/realtime/log_history.hpp"
#include "instrument/link/recorded_link.hpp"
#include "instrument/scpi/session.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/instrument/fake_link.hpp"

#include <random>
#include <string>
#include <vector>

namespace scpi_session_test {

using namespace obscura;
using namespace obscura::instrument;

namespace {

struct Fixture {
    CommandTable table;
    test::FakeLink link;
    std::string version = "1.2";
    ScpiSession session{table, link, version, true, [] { return false; }};

    std::string ask(const std::string& line) { return session.execute(line); }
    /// Number of the oldest error.
    std::string error() { return ask("SYST:ERR?").substr(0, 4); }
};

} // namespace

TEST_CASE_METHOD(Fixture, "common commands answer as IEEE 488.2 wants", "[instrument]") {
    CHECK(ask("*IDN?") == "Obscura,obscura-instrument,0,1.2");
    CHECK(ask("*ESE 32;*ESE?;*SRE 255;*SRE?") == "32;191");
    CHECK(ask("*OPC;*ESR?") == "129"); // power on, operation complete
    CHECK(ask("*OPC?;*TST?;:SYST:VERS?") == "1;0;1999.0");
    link.health = "bad";
    CHECK(ask("*TST?;:HEAL?") == "1;bad");
    CHECK(ask("NONSENSE").empty());
    CHECK(ask("*STB?") == "100"); // error queue, event, master summary
    CHECK(ask("*CLS;*STB?;SYST:ERR:COUN?") == "0;0");
    CHECK(ask("*ESE 256;*ESE?") == "32");
    CHECK(error() == "-222");
    CHECK(ask("*RST;SYST:ERR:ALL?") == "0,\"No error\"");
}

TEST_CASE_METHOD(Fixture, "a header continues at the node of the one before", "[instrument]") {
    CHECK(ask("TRIG:SOUR?;SOUR?;:EXP?;GAIN?;*ESE?;GAIN?") == "Line0;Line0;0.0025;0;0;0");
    CHECK(ask("CAM2:EXP?;GAIN?").empty() == false);
    CHECK(ask("TRIG:SOUR?;EXP?") == "Line0");
    CHECK(ask("SYST:ERR?") == "-113,\"Undefined header;EXP?\"");
}

TEST_CASE_METHOD(Fixture, "short commands are in SI units, features in their own", "[instrument]") {
    CHECK(ask("EXP 0.005;EXP?;:FEAT? \"ExposureTime\"") == "0.005;5000");
    CHECK(ask("EXP 12.3 ms;EXP?;:FEAT 'ExposureTime',250;EXP?") == "0.0123;0.00025");
    CHECK(ask("FEAT 'ExposureTime',1 S;:EXP?;EXP? MIN;EXP? max") == "1;1e-06;10");
    CHECK(ask("EXP MAX;EXP?;GAIN 3 dB;GAIN?") == "10;3");
    CHECK(ask("IMAG:WIDT 32.4;WIDT?") == "32");
    CHECK(ask("FRAM:RATE:ENAB ON;ENAB?;:FEAT 'AcquisitionFrameRateEnable',0;:FRAM:RATE:ENAB?") == "1;0");
    CHECK(ask("TRIG:SOUR software;SOUR?;:FEAT? \"TriggerSource\"") == "Software;\"Software\"");
    CHECK(ask("FEAT:CAT?") ==
          "\"ExposureTime\",\"Gain\",\"Width\",\"AcquisitionFrameRateEnable\",\"TriggerSource\"");
    CHECK(ask("FEAT:LIM? 'Gain';UNIT? 'Gain'") == "\"0 to 24 dB\";\"dB\"");
    CHECK(error() == "0,\"N");
}

TEST_CASE_METHOD(Fixture, "what cannot be done has its number, and the line goes on or ends",
                 "[instrument]") {
    for (const auto& [line, number] :
         std::vector<std::pair<std::string, std::string>>{{"EXP", "-109"},
                                                          {"EXP 1,2", "-108"},
                                                          {"EXP 1 HZ", "-131"},
                                                          {"IMAG:WIDT 3 S", "-138"},
                                                          {"EXP 'a'", "-104"},
                                                          {"TRIG:SOUR 3", "-104"},
                                                          {"TRIG:SOUR Nowhere", "-224"},
                                                          {"TRIG:SOUR MIN", "-224"},
                                                          {"IMAG:WIDT 1e300", "-222"},
                                                          {"FEAT 'Nothing',1", "-224"},
                                                          {"FEAT? Gain", "-104"},
                                                          {"CAM3:GAIN?", "-114"},
                                                          {"CAM0:GAIN?", "-114"},
                                                          {"CAM3:FRAM?", "-114"},
                                                          {"*IDN", "-113"},
                                                          {"ABOR?", "-113"},
                                                          {"*TRG 1", "-108"},
                                                          {"TRIG:RES?", "-230"},
                                                          {"COUN? 'x'", "-224"}}) {
        INFO(line);
        CHECK(ask(line).empty());
        CHECK(error() == number);
    }
    CHECK(ask("NONSENSE;*ESE?").empty()); // a command error ends the line
    CHECK(ask("TRIG:RES?;*ESE?") == "0"); // an execution error does not
    link.refusal.emplace("controlled", "", "controlled by 192.0.2.1:1");
    CHECK(ask("*CLS;GAIN 3;SYST:ERR?") == "-221,\"Settings conflict;controlled by 192.0.2.1:1\"");
    link.refusal.emplace("connection-lost", "", "gone");
    CHECK(ask("INIT;SYST:ERR?").starts_with("-241"));
    CHECK(link.done.empty());
}

TEST_CASE_METHOD(Fixture, "a trigger goes on beside other commands until its outcome is there",
                 "[instrument]") {
    link.looks_until_result = 20;
    CHECK(ask("*CLS;*TRG;*OPC;*ESR?") == "0");
    CHECK(ask("STAT:OPER:COND?") == "560"); // measuring, waiting, triggering
    CHECK(ask("TRIG;SYST:ERR?").starts_with("-211"));
    CHECK(ask("TRIG:RES?;*ESR?") == "7,complete,0,1000000000,0.25;17"); // with the execution error
    CHECK(link.done == std::vector<std::string>{"0 trigger"});
    link.result.outcome = "missed";
    CHECK(ask("CAM2:TRIG;*WAI;:SYST:ERR?") == "-211,\"Trigger ignored\"");
    link.refusal.emplace("not-now", "", "TriggerSource Line0");
    CHECK(ask("*TRG;SYST:ERR?") == "-211,\"Trigger ignored;TriggerSource Line0\"");
}

TEST_CASE_METHOD(Fixture, "state is told by the commands of the camera", "[instrument]") {
    CHECK(ask("ACQ?;FRAM?;COUN?;COUN? 'late'") == "1;12;12,1;1");
    CHECK(ask("COUN:CAT?;:LAT:CAT?;:LAT? 'release_lateness'") ==
          "\"frames\",\"late\";\"release_lateness\";12,2.5e-07,3.5e-06,4.1e-05");
    CHECK(ask("HEAL?;CLOC:STAT?;:CONT?;:SYST:CAM:COUN?") == "good;free;\"\";2");
    CHECK(ask("STAT:OPER:ENAB 16;ENAB?;EVEN?;EVEN?") == "16;48;0");
    CHECK(ask("STAT:PRES;:STAT:OPER:ENAB?;:STAT:QUES?") == "0;0");
    const std::string block = ask("SYST:HELP:HEAD?");
    REQUIRE(block.starts_with("#4"));
    CHECK(std::stoul(block.substr(2, 4)) == block.size() - 6);
    CHECK(block.find("\n:SYSTem:ERRor[:NEXT]?/qonly/\n") != std::string::npos);
    CHECK(block.find("\n*TRG/nquery/\n") != std::string::npos);
}

TEST_CASE_METHOD(Fixture, "a port for queries changes no camera", "[instrument]") {
    ScpiSession view(table, link, version, false, [] { return false; });
    for (const char* line : {"*TRG", "INIT", "ABOR", "GAIN 3", "FEAT 'Gain',3", "CAM2:TRIG"})
        CHECK(view.execute(std::string(line) + ";:SYST:ERR?").starts_with("-203"));
    CHECK(link.done.empty());
    CHECK(view.execute("*ESE 1;GAIN?;*ESE?") == "0;1");
}

TEST_CASE_METHOD(Fixture, "mutated lines neither break the session nor fill memory", "[instrument]") {
    const std::vector<std::string> seeds{
        "CAM2:FEAT \"ExposureTime\",5 MS;:SYST:ERR?", "*ESE #H2F;*OPC;*TRG;TRIG:RES?",
        "STAT:OPER:ENAB 65535;:COUN? 'late'", ":TRIG:SEQ:SOUR Software;DEL -1.5E-3 S"};
    std::mt19937 dice(5); // NOLINT(cert-msc32-c,cert-msc51-cpp): the same lines each time
    const auto number = [&dice](std::size_t below) {
        return std::uniform_int_distribution<std::size_t>(0, below - 1)(dice);
    };
    for (int run = 0; run < 5000; ++run) {
        std::string line = seeds[number(seeds.size())];
        for (std::size_t i = number(6); i-- > 0 && !line.empty();) {
            const std::size_t place = number(line.size());
            switch (number(4)) {
            case 0:
                line[place] = static_cast<char>(number(256));
                break;
            case 1:
                line.erase(place, number(8));
                break;
            case 2:
                line.insert(place, line.substr(number(line.size()), number(16)));
                break;
            default:
                line.insert(place, 1, "?;:,\"'#*(1eE.-"[number(14)]);
            }
        }
        const std::string response = ask(line);
        REQUIRE(response.size() < 65536);
        REQUIRE(response.find('\n') == std::string::npos);
    }
    CHECK(ask("*CLS;*IDN?") == "Obscura,obscura-instrument,0,1.2");
}

TEST_CASE("each change is a line of the log, with who has made it", "[instrument]") {
    const auto last_id = [] {
        const std::vector<LoggedLine> lines = log_history().after(0, LogHistory::lines);
        return lines.empty() ? 0 : lines.back().id;
    };
    const std::uint64_t before = last_id();
    test::FakeLink daemon;
    RecordedLink link(daemon, "SCPI");
    link.set_peer("192.0.2.7");
    link.set(0, "Gain", 6.0);
    link.set(0, "Gain", 6.0); // changes nothing
    link.set(1, "TriggerSource", std::string("Software"));
    link.stop(1);
    link.begin_trigger(1);
    daemon.looks_until_result = 1;
    CHECK_FALSE(link.trigger_result(0));
    CHECK(link.trigger_pending());
    CHECK(link.trigger_result(0)->frame == 7);
    daemon.refusal = LinkError("controlled", "", "controlled by 192.0.2.9:4711");
    CHECK_THROWS_AS(link.start(0), LinkError);
    std::vector<std::string> texts;
    for (const LoggedLine& line : log_history().after(before, LogHistory::lines))
        texts.push_back(line.text);
    CHECK(texts == std::vector<std::string>{"instrument: SCPI of 192.0.2.7: Gain of camera 0: 0 -> 6",
                                            "instrument: SCPI of 192.0.2.7: TriggerSource of camera 1: "
                                            "Line0 -> Software",
                                            "instrument: SCPI of 192.0.2.7: stop of camera 1",
                                            "instrument: SCPI of 192.0.2.7: trigger of camera 1"});
}

} // namespace scpi_session_test
