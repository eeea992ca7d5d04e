// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "emulator/timing_log.hpp"
#include "tests/support/catch.hpp"
#include "tools/support/timing_report.hpp"

#include <algorithm>
#include <sstream>

using namespace obscura;
using namespace obscura::tools;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

// As it was written before columns named the configured transports only.
const std::string header =
    "frame_id,trigger_id,edge_ns,seen_ns,pose_ns,render_begin_ns,render_end_ns,detector_end_ns,due_ns,"
    "first_ns,last_due_ns,last_ns,rows,late_rows,worst_row_ns,worst_row,flags,gige_first_byte_ns,"
    "gige_last_byte_ns,v4l2_first_byte_ns,v4l2_last_byte_ns,stimulator_first_byte_ns,"
    "stimulator_last_byte_ns,file_first_byte_ns,file_last_byte_ns,row_lateness_us\n";

TimingFile read(const std::string& text) {
    std::istringstream in(text);
    return read_timing(in, "run.csv");
}

std::string complaint(const std::string& text) {
    try {
        (void)read(text);
    } catch (const InputError& e) {
        return e.what();
    }
    return "";
}

// Edge at 1 s; seen 10 us, poses 15 us, rendering from 30 us to 1030 us, detector 100 us more; rows due from
// 2 ms to 6 ms. The first GigE byte left with the first row, the last one 100 us after the last row.
const std::string in_time =
    "1,1,1000000000,1000010000,1000015000,1000030000,1001030000,1001130000,1002000000,1002000500,1006000000,"
    "1006000700,30,0,700,29,0,1002010000,1006100700,0,0,0,0,0,0,0 0 1\n";
const std::string slow =
    "2,2,2000000000,2000010000,2000015000,2000030000,2009030000,2009130000,2002000000,2003000000,2006000000,"
    "2009140000,30,25,7000000,2,1,2003010000,2009240000,0,0,0,0,0,0,1000 7000 3140\n";
const std::string given_up =
    "3,3,3000000000,3000010000,0,0,0,0,3002000000,0,3006000000,0,30,30,0,0,9,0,0,0,0,0,0,0,0,\n";

} // namespace

TEST_CASE("a timing file is read column by column") {
    const TimingFile file = read(header + in_time);
    const auto& rows = file.rows;
    CHECK(file.transports == std::vector<std::string>{"gige", "v4l2", "stimulator", "file"});
    REQUIRE(rows.size() == 1);
    CHECK(rows[0].frame_id == 1);
    CHECK(rows[0].edge == 1'000'000'000);
    CHECK(rows[0].detector_end == 1'001'130'000);
    CHECK(rows[0].last == 1'006'000'700);
    CHECK(rows[0].rows == 30);
    CHECK(rows[0].worst_row == 700);
    CHECK(rows[0].worst_row_number == 29);
    CHECK(rows[0].first_byte[0] == 1'002'010'000);
    CHECK(rows[0].last_byte[0] == 1'006'100'700);
    CHECK(rows[0].row_lateness_us == std::vector<std::int32_t>{0, 0, 1});
}

TEST_CASE("what is no timing file is refused with its line") {
    CHECK_THAT(complaint(""), ContainsSubstring("run.csv:1: this is no timing file"));
    CHECK_THAT(complaint("a,b\n1,2\n"), ContainsSubstring("run.csv:1: this is no timing file"));
    CHECK_THAT(complaint(header + in_time + "1,2,x\n"),
               ContainsSubstring("run.csv:3: column 3 is no whole number"));
    CHECK_THAT(complaint(header + "1,2,3\n"), ContainsSubstring("run.csv:2: column 3"));
    for (const char* more : {",5", " x", " ", "  1", " 99999999999"}) {
        std::string longer = in_time;
        longer.insert(longer.size() - 1, more);
        CHECK_THAT(complaint(header + longer), ContainsSubstring("run.csv:2: column 26"));
    }
}

TEST_CASE("what a timing file names and counts stays within bounds") {
    const auto with_transport = [](const std::string& kind) {
        std::string text = header;
        for (std::size_t at = 0; (at = text.find("gige", at)) != std::string::npos; at += kind.size())
            text.replace(at, 4, kind);
        return text;
    };
    CHECK(complaint(with_transport("usb3_vision")).empty());
    CHECK(complaint(with_transport("<script>x()</script>")) ==
          "run.csv:1: \"<script>x()</script>\" is no kind of transport: allowed are small letters, digits "
          "and _");
    std::string extremes = in_time;
    extremes.replace(extremes.find("1000000000"), 10, "-9223372036854775808");
    CHECK_THAT(complaint(header + extremes), ContainsSubstring("run.csv:2: column 3"));
    std::string wide = header;
    for (int i = 0; i < 300; ++i)
        wide.insert(0, "x,");
    CHECK(complaint(wide) == "run.csv:1: 326 columns, allowed are 256");
}

TEST_CASE("a timing file has the columns of the configured transports") {
    emulator::TimingLog log;
    log.set_transports({"file", "loopback"});
    TransmitTimestamps& transmit = log.transmit_timestamps(0);
    transmit.note(1, Time{1'500});
    transmit.note(1, Time{2'500});
    emulator::FrameTiming timing;
    timing.frame_id = 7;
    timing.edge = Time{500};
    timing.transmit = &transmit;
    log.push(timing);
    std::ostringstream out;
    out << log.header();
    CHECK(log.drain(out) == 1);
    const TimingFile file = read(out.str());
    CHECK(file.transports == std::vector<std::string>{"file", "loopback"});
    REQUIRE(file.rows.size() == 1);
    CHECK(file.rows[0].frame_id == 7);
    CHECK(file.rows[0].first_byte == std::vector<std::int64_t>{0, 1'500});
    CHECK(file.rows[0].last_byte == std::vector<std::int64_t>{0, 2'500});
    const auto figures = span_figures(file);
    const auto last = std::find_if(figures.begin(), figures.end(), [](const SpanFigures& f) {
        return f.key == "edge_to_last_byte_loopback";
    });
    REQUIRE(last != figures.end());
    CHECK_THAT(last->p50, WithinAbs(2, 1e-9));
}

TEST_CASE("a missing column of a timing file is named") {
    for (const std::string column : {"edge_ns", "flags", "v4l2_last_byte_ns", "v4l2_first_byte_ns"}) {
        std::string shorter = header;
        shorter.erase(shorter.find(column + ","), column.size() + 1);
        CHECK_THAT(complaint(shorter), ContainsSubstring("run.csv:1: column " + column + " is missing"));
    }
}

TEST_CASE("spans, lateness and reasons of frames whose stamps are known") {
    const TimingFile file = read(header + in_time + slow + given_up);
    const auto& rows = file.rows;
    for (const SpanFigures& f : span_figures(file)) {
        if (f.key == "edge_to_seen") {
            CHECK(f.count == 3);
            CHECK_THAT(f.p50, WithinAbs(10, 1e-9));
        } else if (f.key == "rendering") {
            CHECK(f.count == 2); // the frame that was given up has no such stamps
            CHECK_THAT(f.p50, WithinAbs(1000, 1e-9));
            CHECK_THAT(f.max, WithinAbs(9000, 1e-9));
        } else if (f.key == "row_lateness") {
            CHECK(f.count == 6); // rows
            CHECK_THAT(f.max, WithinAbs(7000, 1e-9));
            CHECK(f.histogram[0] == 3); // 0, 0, 1 us
            CHECK(f.histogram[9] == 1); // up to 1 ms
            CHECK(f.histogram[11] == 1);
            CHECK(f.histogram[12] == 1);
        } else if (f.key == "edge_to_last_byte_gige") {
            CHECK(f.count == 2);
            CHECK_THAT(f.max, WithinAbs(9240, 1e-9));
        } else if (f.key == "first_row_lateness") {
            CHECK_THAT(f.p50, WithinAbs(0.5, 1e-9));
        }
    }
    // A way out that nothing left through is not shown.
    const auto figures = span_figures(file);
    CHECK(std::none_of(figures.begin(), figures.end(),
                       [](const SpanFigures& f) { return f.key.find("v4l2") != std::string::npos; }));
    CHECK(lateness(rows[0]) == 0);
    CHECK(lateness(rows[1]) == 3'140'000);
    CHECK(reason(rows[0]) == "in time");
    CHECK(reason(rows[1]) == "rendering, 9.000 ms");
    CHECK(reason(rows[2]) == "given up with 30 of 30 rows late");
    const auto sorted = worst(rows, 2);
    REQUIRE(sorted.size() == 2);
    CHECK(sorted[0].frame_id == 2);
}

TEST_CASE("the report as text, CSV and picture") {
    const TimingFile file = read(header + in_time + slow + given_up);
    CHECK_THAT(timing_text(file),
               ContainsSubstring("3 frames, 2 with late rows") && ContainsSubstring("rendering, 9.000 ms"));
    const std::string csv = timing_csv(file);
    CHECK_THAT(csv, ContainsSubstring("rendering,2,1000.000,9000.000,9000.000,9000.000,"
                                      "0,0,0,0,0,0,0,0,0,1,0,0,1,0,0,0,0,0,0,0\n"));
    CHECK_THAT(csv, ContainsSubstring("\n2,3140.000,25,2,\"rendering, 9.000 ms\"\n"));
    const std::string svg = timing_svg(file);
    CHECK(svg.rfind("<svg ", 0) == 0);
    // 1 ms is the third decade: x = 60 + 300; the first of two frames, y half way up.
    CHECK_THAT(svg, ContainsSubstring("360.0,230.0 "));
    CHECK_THAT(svg,
               ContainsSubstring("frame 2: 3.140 ms late, 25 rows, the worst row 2; rendering, 9.000 ms"));
    // One value up to 1 ms, one up to 10 ms.
    CHECK_THAT(timing_text(file),
               ContainsSubstring("\nrendering                             0        0        0        "
                                 "1        1        0        0        0\n"));
    CHECK_THAT(timing_text({}), ContainsSubstring("0 frames"));
    CHECK_THAT(timing_svg({}), ContainsSubstring("</svg>"));
}
