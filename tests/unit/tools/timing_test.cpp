#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "tools/timing_report.hpp"

#include <sstream>

using namespace obscura;
using namespace obscura::tools;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

const std::string header =
    "frame_id,trigger_id,edge_ns,seen_ns,render_begin_ns,render_end_ns,detector_end_ns,due_ns,"
    "first_ns,last_due_ns,last_ns,rows,late_rows,worst_row_ns,flags\n";

std::vector<TimingRow> read(const std::string& text) {
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

// Edge at 1 s; seen 10 us, rendering from 30 us to 5030 us, detector 100 us more; rows due from 2 ms to 6 ms.
const std::string in_time = "1,1,1000000000,1000010000,1000030000,1001030000,1001130000,1002000000,"
                            "1002000500,1006000000,1006000700,30,0,700,0\n";
const std::string slow = "2,2,2000000000,2000010000,2000030000,2009030000,2009130000,2002000000,2003000000,"
                         "2006000000,2009140000,30,25,7000000,1\n";
const std::string given_up = "3,3,3000000000,3000010000,0,0,0,3002000000,0,3006000000,0,30,30,0,9\n";

} // namespace

TEST_CASE("a timing file is read column by column") {
    const auto rows = read(header + in_time);
    REQUIRE(rows.size() == 1);
    CHECK(rows[0].frame_id == 1);
    CHECK(rows[0].edge == 1'000'000'000);
    CHECK(rows[0].detector_end == 1'001'130'000);
    CHECK(rows[0].last == 1'006'000'700);
    CHECK(rows[0].rows == 30);
    CHECK(rows[0].worst_row == 700);
}

TEST_CASE("what is no timing file is refused with its line") {
    CHECK_THAT(complaint(""), ContainsSubstring("run.csv:1: this is no timing file"));
    CHECK_THAT(complaint("a,b\n1,2\n"), ContainsSubstring("run.csv:1: this is no timing file"));
    CHECK_THAT(complaint(header + in_time + "1,2,x\n"),
               ContainsSubstring("run.csv:3: column 3 is no whole number"));
    CHECK_THAT(complaint(header + "1,2,3\n"), ContainsSubstring("run.csv:2: column 3"));
    std::string longer = in_time;
    longer.insert(longer.size() - 1, ",5");
    CHECK_THAT(complaint(header + longer), ContainsSubstring("run.csv:2: column 15"));
}

TEST_CASE("spans, lateness and reasons of frames whose stamps are known") {
    const auto rows = read(header + in_time + slow + given_up);
    for (const SpanFigures& f : span_figures(rows)) {
        if (f.key == "edge_to_seen") {
            CHECK(f.count == 3);
            CHECK_THAT(f.p50, WithinAbs(10, 1e-9));
        } else if (f.key == "rendering") {
            CHECK(f.count == 2); // the frame that was given up has no such stamps
            CHECK_THAT(f.p50, WithinAbs(1000, 1e-9));
            CHECK_THAT(f.max, WithinAbs(9000, 1e-9));
        } else if (f.key == "first_row_lateness") {
            CHECK_THAT(f.p50, WithinAbs(0.5, 1e-9));
        }
    }
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
    const auto rows = read(header + in_time + slow + given_up);
    CHECK_THAT(timing_text(rows),
               ContainsSubstring("3 frames, 2 with late rows") && ContainsSubstring("rendering, 9.000 ms"));
    const std::string csv = timing_csv(rows);
    CHECK_THAT(csv, ContainsSubstring("rendering,2,1000.000,9000.000,9000.000,9000.000\n"));
    const std::string svg = timing_svg(rows);
    CHECK(svg.rfind("<svg ", 0) == 0);
    // 1 ms is the third decade: x = 60 + 300; the first of two frames, y half way up.
    CHECK_THAT(svg, ContainsSubstring("360.0,230.0 "));
    CHECK_THAT(timing_text({}), ContainsSubstring("0 frames"));
    CHECK_THAT(timing_svg({}), ContainsSubstring("</svg>"));
}
