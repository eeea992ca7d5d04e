// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "emulator/record/timing_log.hpp"
#include "tests/support/catch.hpp"
#include "tools/timing/timing_quality.hpp"
#include "tools/timing/timing_report.hpp"

#include <algorithm>
#include <sstream>

namespace timing_test {

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
    CHECK_THAT(csv, ContainsSubstring("\n1,2,3140.000,25,2,\"rendering, 9.000 ms\"\n"));
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

namespace {

/// A late frame of 184 ms of rendering on two threads, of which the chip wanted the rows 100 ms earlier.
TimingRow late_frame() {
    constexpr std::int64_t ms = 1'000'000;
    TimingRow row;
    row.frame_id = row.trigger_id = 1;
    row.acquisition = 1;
    row.edge = 1000 * ms;
    row.seen = row.pose = row.render_begin = row.edge;
    row.render_end = row.detector_end = row.edge + 184 * ms;
    row.due = row.last_due = row.edge + 84 * ms;
    row.first = row.last = row.detector_end;
    row.rows = row.late_rows = 512;
    row.width = row.height = 512;
    row.render_threads = row.render_cores = 2;
    row.samples_per_pixel = 1;
    row.rendered_rows = 512;
    row.row_instants = 512;
    row.sampling = 2 * 184 * ms;
    row.measured = row.measured_cpu = 100 * ms;
    return row;
}

std::string first_cure(const TimingRow& row) {
    const std::vector<Cure> all = cures({&row, 1});
    return all.empty() ? "" : all.front().text();
}

double part(const TimingRow& row, const std::string& name) {
    for (const TimePart& p : time_parts({&row, 1}))
        if (p.name == name) return p.ms;
    return 0;
}

} // namespace

TEST_CASE("a cause of lateness comes with its share, its setting and what the frame would take without") {
    constexpr std::int64_t ms = 1'000'000;
    TimingRow row = late_frame();
    // 16 instants a row: 15 of 16 of their cost, 241.1 ms on two threads, would go.
    row.row_instants = 16 * 512;
    row.setup = 241'066'667;
    row.sampling = 2 * 184 * ms - row.setup;
    CHECK(first_cure(row) ==
          "motion instants (16 a row) 113 of 184 ms: render.max_instants = 1 would give about 71 ms");
    CHECK(reason(row) == "rendering, 184.000 ms; " + first_cure(row));
    CHECK_THAT(part(row, "rendering: scene at motion instants"), WithinAbs(120.533, 0.001));
    // Stars at each instant belong to it, too.
    row.points = row.setup;
    row.setup = 0;
    CHECK_THAT(first_cure(row), ContainsSubstring("would give about 71 ms"));

    row = late_frame();
    row.samples_per_pixel = 16; // 7 of 16 fit into the 84 ms that there are
    CHECK(first_cure(row) ==
          "samples (16 a pixel) 184 of 184 ms: render.samples_per_pixel = 7 would give about 80 ms");
    row.target_error = 0.02; // half the samples^0.75: 40 % of the time
    CHECK(first_cure(row) == "samples (render.target_error = 0.02) 184 of 184 ms: "
                             "render.target_error = 0.04, at best, would give about 73 ms");

    row = late_frame();
    row.wings = row.sampling / 2;
    row.sampling -= row.wings;
    CHECK(first_cure(row) == "wings of the point spread function 92 of 184 ms: "
                             "camera.psf_wings_px = 0 in the scene would give about 92 ms");

    row = late_frame();
    row.render_cores = 8;
    CHECK(first_cure(row) ==
          "2 render threads for 8 cores 184 of 184 ms: render.threads = 8 would give about 46 ms");

    row = late_frame();
    CHECK(first_cure(row) == "512 x 512 pixels 184 of 184 ms: a window of 233 rows would give about 84 ms");

    row = late_frame();
    row.detector_wait = 120 * ms;
    row.detector = 180 * ms;
    CHECK_THAT(part(row, "rendering: samples"), WithinAbs(64, 1e-9));
    CHECK(first_cure(row) == "waiting for the detector 120 of 184 ms: a detector that takes less than its "
                             "180 ms of one thread would give about 64 ms");

    row = late_frame();
    row.render_end -= 100 * ms;
    row.sampling -= 200 * ms;
    row.detector = 100 * ms;
    CHECK_THAT(reason(row), ContainsSubstring("the detector, 100.000 ms; "));
    CHECK(first_cure(row) == "the detector after rendering 100 of 184 ms: render.band_rows = 128 "
                             "would give about 109 ms");
}

TEST_CASE("load by other programs and the frame's own cost are separate figures") {
    TimingRow row = late_frame();
    row.measured_cpu = row.measured * 3 / 4;
    row.preemptions = 12;
    CHECK_THAT(part(row, "rendering: lost to other programs"), WithinAbs(46, 1e-9));
    CHECK_THAT(part(row, "rendering: samples"), WithinAbs(138, 1e-9));
    const auto all = cures({&row, 1});
    CHECK(std::any_of(all.begin(), all.end(), [](const Cure& c) {
        return c.text() == "other programs 46 of 184 ms: an idle machine, cores of its own "
                           "(threads.render_cores) or threads.render_class = \"rr\" would give about 138 ms";
    }));
    const auto lines = remarks({{}, {row}});
    REQUIRE(lines.size() == 1);
    CHECK(lines[0] == "render threads: 2 of 2 cores, at work 100 % of the time of rendering; then they had "
                      "75.0 % of a core each, other programs the rest (46.0 ms a frame); 12.0 involuntary "
                      "context switches a frame");
    double sum = 0;
    for (const TimePart& p : time_parts({&row, 1}))
        sum += p.ms;
    CHECK_THAT(sum, WithinAbs(184, 1e-9)); // nothing twice, nothing left out
}

TEST_CASE("triggers faster than the chip and sending slower than the rows are said with figures") {
    constexpr std::int64_t ms = 1'000'000;
    TimingFile file{{"gige"}, {late_frame(), late_frame()}};
    TimingRow &one = file.rows[0], &two = file.rows[1];
    two.frame_id = 2;
    two.trigger_id = 5; // three edges in between were missed
    two.edge += 400 * ms;
    for (TimingRow* row : {&one, &two}) {
        row->min_period = 218 * ms;
        row->measured = 0;
        row->first = row->last - 26 * ms;
        row->first_byte = {row->first};
        row->last_byte = {row->last + 41 * ms};
        row->pace = {65 * ms};
    }
    const auto lines = remarks(file);
    REQUIRE(lines.size() == 2);
    CHECK(lines[0] ==
          "triggers every 100 ms, but the chip reads a frame in 218 ms: trigger at 4.59 Hz at most, "
          "or read fewer rows (camera.height)");
    CHECK(lines[1] ==
          "sending (gige): the last byte leaves 41 ms after the last row; at the pace that is set a "
          "frame takes 65 ms, its rows 26 ms: 2.5 times the pace (gige.throughput_limit_mbit_s, "
          "DeviceLinkThroughputLimit, GevSCPD) would end with the rows");
    one.pace = two.pace = {1 * ms};
    CHECK_THAT(remarks(file)[1], ContainsSubstring("the receiver or the machine that holds it up"));
}

TEST_CASE("frames below full quality are said with their levels") {
    TimingFile file = read(header + in_time + slow);
    for (const std::string& line : remarks(file))
        CHECK_THAT(line, !ContainsSubstring("quality:"));
    file.rows[0].levels = "0000";
    file.rows[1].levels = "0556";
    file.rows[1].quality.rows_degraded = 24;
    file.rows[1].quality.error_rms = 0.025F;
    REQUIRE_FALSE(remarks(file).empty());
    CHECK(remarks(file).front() == "quality: 1 of 2 frames below full, groups of rows: full 62.5 %, quarter "
                                   "25.0 %, sixteenth 12.5 %; estimated error 2.5 % (median; worst 2.5 %)");
}

TEST_CASE("acquisitions of a timing file are reported apart") {
    // Files without a column for it: in each acquisition frames count from 1.
    const TimingFile old = read(header + in_time + slow + in_time);
    const auto apart = acquisitions(old);
    REQUIRE(apart.size() == 2);
    CHECK(apart[0].rows.size() == 2);
    CHECK(apart[1].rows[0].acquisition == 2);
    CHECK_THAT(timing_text(old), ContainsSubstring("Acquisition 1\n\n2 frames, 1 with late rows") &&
                                     ContainsSubstring("Acquisition 2\n\n1 frames, 0 with late rows"));
    CHECK_THAT(timing_csv(old),
               ContainsSubstring("\n1,rendering,2,") && ContainsSubstring("\n2,rendering,1,"));
    CHECK_THAT(timing_svg(old), ContainsSubstring("Acquisition 2</text>"));
}

TEST_CASE("what a frame cost is in the timing file") {
    emulator::TimingLog log;
    log.set_transports({"gige"});
    log.set_render(
        {.samples_per_pixel = 4, .target_error = 0.02, .max_instants = 64, .threads = 2, .cores = 8});
    emulator::FrameTiming timing;
    timing.frame_id = 1;
    timing.width = 640;
    timing.height = 480;
    timing.facts = {.acquisition = 3, .min_period_ns = 50'000'000};
    for (std::size_t i = 0; i < renderer::render_part_count; ++i)
        timing.work.render.part_ns[i] = static_cast<std::int64_t>(100 + i);
    timing.work.render.measured_ns = 7;
    timing.work.render.measured_cpu_ns = 6;
    timing.work.render.preemptions = 5;
    timing.work.render.rows = 480;
    timing.work.render.instants = 960;
    timing.work.render.samples = 11;
    timing.work.render.rays = 12;
    timing.work.detector_wait_ns = 13;
    timing.work.detector_ns = 14;
    log.push(timing);
    std::ostringstream out;
    out << log.header();
    const std::int64_t pace_ns[] = {99};
    CHECK(log.drain(out, Time{INT64_MAX}, pace_ns) == 1);
    const TimingRow row = read(out.str()).rows.at(0);
    CHECK(row.acquisition == 3);
    CHECK(row.min_period == 50'000'000);
    CHECK(row.width == 640);
    CHECK(row.height == 480);
    CHECK(row.render_threads == 2);
    CHECK(row.render_cores == 8);
    CHECK(row.samples_per_pixel == 4);
    CHECK(row.target_error == 0.02);
    CHECK(row.max_instants == 64);
    CHECK(row.setup == 100);
    CHECK(row.sampling == 101);
    CHECK(row.grid == 102);
    CHECK(row.wings == 103);
    CHECK(row.points == 104);
    CHECK(row.rest == 105);
    CHECK(row.measured == 7);
    CHECK(row.measured_cpu == 6);
    CHECK(row.preemptions == 5);
    CHECK(row.rendered_rows == 480);
    CHECK(row.row_instants == 960);
    CHECK(row.samples == 11);
    CHECK(row.rays == 12);
    CHECK(row.detector_wait == 13);
    CHECK(row.detector == 14);
    CHECK(row.pace == std::vector<std::int64_t>{99});
}

TEST_CASE("each column of the timing file is a number of its own") {
    for (const TimingColumn& column : timing_columns()) {
        FrameRecord record;
        column.set(record, 7);
        for (const TimingColumn& other : timing_columns()) {
            CAPTURE(column.name, other.name);
            CHECK(other.value(record) == (&other == &column ? 7 : 0));
        }
    }
}

TEST_CASE("degraded frames are counted by reason, and each is explained") {
    TimingFile file;
    const auto add = [&](std::uint64_t id, std::uint32_t reasons, std::string levels, double error_ppm) {
        TimingRow row;
        row.acquisition = 1;
        row.frame_id = id;
        row.rows = row.height = 64;
        row.quality.reasons = reasons;
        row.quality.error_rms = static_cast<float>(1e-6 * error_ppm);
        row.levels = std::move(levels);
        for (const char digit : row.levels)
            row.quality.rows_degraded += digit == '0' ? 0 : 16;
        for (const char digit : row.levels)
            row.quality.level_max = std::max(row.quality.level_max, static_cast<QualityLevel>(digit - '0'));
        row.quality.budget_us = 83'200, row.quality.spent_us = 80'000,
        row.quality.margin_us = static_cast<std::int64_t>(id) * 1000;
        row.measured = 100, row.measured_cpu = 62, row.preemptions = 17, row.page_faults = 3;
        file.rows.push_back(row);
    };
    add(1, 0, "0000", 6'000);
    CHECK(degraded_text(file.rows, true).empty());
    CHECK(quality_remark(file.rows).empty());
    CHECK(degraded_because(file.rows[0]).empty());
    add(2, quality_budget | quality_predicted, "0044", 12'300);
    add(3, quality_budget | quality_predicted, "0066", 30'000);
    add(4, quality_stall | quality_budget, "6666", 41'000);
    add(5, quality_page_fault, "0001", 9'000);
    add(6, quality_unknown_scene, "4444", 9'000);
    CHECK(degraded_because(file.rows[1]) ==
          "too little time, foreseen; in full it would have taken longer than the 83.2 ms that there were");
    CHECK_THAT(degraded_because(file.rows[3]),
               ContainsSubstring("other programs, too little time") &&
                   ContainsSubstring("had 62 % of a core each, by 17 involuntary context switches"));
    CHECK_THAT(degraded_because(file.rows[4]), ContainsSubstring("3 page faults"));
    CHECK_THAT(degraded_because(file.rows[5]), ContainsSubstring("the first frame"));
    const std::string text = timing_text(file);
    CHECK_THAT(text,
               ContainsSubstring(
                   "       2      3.00      3.00         2.0  too little time, foreseen                 "
                   "full 50 %, grid 25 %, sixteenth 25 %\n"));
    CHECK_THAT(text, !ContainsSubstring("Each degraded frame"));
    CHECK_THAT(timing_text(file, true),
               ContainsSubstring("\n       4      4.10      0.00      0.00       83.2       80.0        4.0  "
                                 "sixteenth 100 %; other programs, too little time; "));
    CHECK_THAT(timing_csv(file),
               ContainsSubstring("\n1,3,sixteenth,32,5,30000,0,0,83200,80000,3000,0066,\"too little time, "));
    CHECK_THAT(quality_remark(file.rows), ContainsSubstring("quality: 5 of 6 frames below full"));
}

} // namespace timing_test
