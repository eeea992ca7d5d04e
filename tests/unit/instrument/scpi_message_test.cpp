// SPDX-License-Identifier: Apache-2.0
// Program messages and headers, as IEEE 488.2 and SCPI-1999 define them.
#include "instrument/scpi/errors.hpp"
#include "instrument/scpi/header_pattern.hpp"
#include "instrument/scpi/line_reader.hpp"
#include "instrument/scpi/message.hpp"
#include "instrument/scpi/status.hpp"
#include "tests/support/catch.hpp"

#include <string>
#include <utility>
#include <vector>

namespace scpi_message_test {

using namespace obscura::instrument;

namespace {

/// The number of the error that parsing the line ends with; 0 if none.
int error_of(const std::string& line) {
    MessageParser parser(line);
    try {
        while (parser.next()) {
        }
        return 0;
    } catch (const ScpiError& error) {
        return static_cast<int>(error.code);
    }
}

Parameter parameter_of(const std::string& text) {
    const std::string line = "X " + text;
    return MessageParser(line).next()->parameters.at(0);
}

} // namespace

TEST_CASE("a message is taken apart into units, headers and data elements", "[instrument]") {
    const std::string line = " :trig:sour Software , 'a''b;c' ; *ESE #H2f;del? MIN ;";
    MessageParser parser(line);
    const auto first = parser.next();
    REQUIRE(first);
    CHECK((first->rooted && !first->query && !first->common));
    CHECK(first->header == std::vector<std::string>{"TRIG", "SOUR"});
    REQUIRE(first->parameters.size() == 2);
    CHECK(first->parameters[0].text == "Software");
    CHECK(first->parameters[1].kind == Parameter::Kind::string);
    CHECK(first->parameters[1].text == "a'b;c");
    const auto second = parser.next();
    CHECK((second->common && second->header[0] == "ESE" && second->parameters[0].number == 47));
    const auto third = parser.next();
    CHECK((third->query && third->header[0] == "DEL" && third->parameters[0].text == "MIN"));
    CHECK_FALSE(parser.next());
}

TEST_CASE("numbers have signs, exponents and suffixes", "[instrument]") {
    for (const auto& [text, number, suffix] : {std::tuple{"5", 5.0, ""},
                                               {"+.5", 0.5, ""},
                                               {"-2.", -2.0, ""},
                                               {"1.5 E -3", 1.5e-3, ""},
                                               {"5 ms", 5.0, "MS"},
                                               {"5e3us", 5000.0, "US"},
                                               {"2 EV", 2.0, "EV"},
                                               {"#B101", 5.0, ""},
                                               {"#q17", 15.0, ""}}) {
        INFO(text);
        const Parameter parameter = parameter_of(text);
        CHECK(parameter.kind == Parameter::Kind::number);
        CHECK(parameter.number == number);
        CHECK(parameter.suffix == suffix);
    }
}

TEST_CASE("what is no message has the standard's error", "[instrument]") {
    const std::string digits(256, '1');
    for (const auto& [line, code] :
         std::vector<std::pair<std::string, int>>{{"", 0},
                                                  {"  \r", 0},
                                                  {"X;", 0},
                                                  {"&X", -101},
                                                  {"X&", -101},
                                                  {"X \x80", -101},
                                                  {"X ,", -102},
                                                  {"X 1,", -102},
                                                  {"X 1 2", -103},
                                                  {"X 'a' b", -103},
                                                  {"X\"a\"", -111},
                                                  {"ABCDEFGHIJKLM", -112},
                                                  {"A:B:C:D:E:F:G:H:I", -113},
                                                  {"X +", -121},
                                                  {"X #Hg", -121},
                                                  {"X 1e40000", -123},
                                                  {"X 1e999", -123},
                                                  {"X 1e99999999999", -123},
                                                  {"X " + digits, -124},
                                                  {"X #HFFFFFFFFF", -124},
                                                  {"X 1 abcdefghijklm", -131},
                                                  {"X " + std::string(65, 'a'), -144},
                                                  {"X 'a", -151},
                                                  {"X \"a\tb\"", -151},
                                                  {"X #13abc", -168},
                                                  {"X (1)", -178},
                                                  {"X 1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17", -108}}) {
        INFO(line);
        CHECK(error_of(line) == code);
    }
}

TEST_CASE("headers have long and short forms, optional nodes and one number", "[instrument]") {
    const HeaderPattern pattern("[CAMera#:]TRIGger[:SEQuence]:SOURce");
    const auto match = [&](std::vector<std::string> header) { return pattern.match(header).value_or(99); };
    CHECK(match({"TRIG", "SOUR"}) == 1);
    CHECK(match({"TRIGGER", "SEQ", "SOURCE"}) == 1);
    CHECK(match({"CAM", "TRIG", "SOUR"}) == 1);
    CHECK(match({"CAMERA12", "TRIG", "SEQUENCE", "SOUR"}) == 12);
    CHECK(match({"CAM99999999999", "TRIG", "SOUR"}) == 0);
    for (const std::vector<std::string>& wrong :
         std::vector<std::vector<std::string>>{{},
                                               {"TRIG"},
                                               {"TRIGG", "SOUR"},
                                               {"SEQ", "SOUR"},
                                               {"TRIG1", "SOUR"},
                                               {"TRIG", "SOUR", "X"},
                                               {"12", "TRIG", "SOUR"}})
        CHECK(match(wrong) == 99);
    CHECK(is_form_of("max", "MAXimum"));
    CHECK_FALSE(is_form_of("maxi", "MAXimum"));
}

TEST_CASE("lines come in pieces, and long ones are thrown away", "[instrument]") {
    LineReader reader(4);
    std::vector<std::string> lines;
    for (const std::string_view piece : {"ab", "c\r\nd\n", "12345\n\nxy", "zab", "c\nok\n"}) {
        reader.give(piece);
        while (const auto line = reader.next())
            lines.push_back(line->value_or("too long"));
    }
    CHECK(lines == std::vector<std::string>{"abc", "d", "too long", "", "too long", "ok"});
    reader.give(std::string_view("123456789"));
    CHECK_FALSE(reader.next());
    CHECK(reader.thrown_away() == 9);
}

TEST_CASE("a full error queue says so, and each class has its event bit", "[instrument]") {
    Status status;
    CHECK(status.take_event() == event_power_on);
    CHECK(status.take_error() == "0,\"No error\"");
    status.report(ScpiCode::undefined_header, "A\"B\n");
    status.report(ScpiCode::data_out_of_range);
    status.report(ScpiCode::input_buffer_overrun);
    CHECK(status.take_event() == (event_command_error | event_execution_error | event_device_error));
    CHECK(status.take_event() == 0);
    CHECK(status.take_error() == "-113,\"Undefined header;A\"\"B?\"");
    for (int i = 0; i < 100; ++i)
        status.report(ScpiCode::syntax_error, std::string(1000, 'x'));
    CHECK(status.errors() == Status::queue_length);
    std::string last;
    while (status.errors() > 0)
        last = status.take_error();
    CHECK(last == "-350,\"Queue overflow\"");
}

} // namespace scpi_message_test
