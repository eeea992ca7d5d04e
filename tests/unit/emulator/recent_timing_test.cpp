// SPDX-License-Identifier: Apache-2.0
// Time stamps of the newest frames: the numbers of the timing file, and histograms of stages.
#include "emulator/record/recent_timing.hpp"
#include "tests/support/catch.hpp"

#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace recent_timing_test {

using namespace obscura;
using namespace obscura::emulator;

namespace {

/// A log with frames whose stages take as long as their numbers say; every third is not rendered to its end.
struct Run {
    TimingLog log;
    std::vector<std::string> lines; // of the file

    explicit Run(RecentTiming* recent, std::uint64_t frames) {
        log.set_transports({"gige", "file"});
        log.set_render({.samples_per_pixel = 9, .threads = 2});
        for (std::uint64_t n = 1; n <= frames; ++n)
            push(n);
        std::ostringstream out;
        log.drain([&](const FrameTiming& frame) {
            out << log.row(frame, {});
            if (recent != nullptr) recent->note(frame);
        });
        std::istringstream text(out.str());
        for (std::string line; std::getline(text, line);)
            lines.push_back(line);
    }
    void push(std::uint64_t n, Time ended = {}) {
        const auto at = [n](std::int64_t us) {
            return Time{static_cast<std::int64_t>(n) * ns_per_s + us * ns_per_us};
        };
        const auto span = static_cast<std::int64_t>(n);
        FrameTiming t;
        t.frame_id = n % 10; // acquisitions of ten frames
        t.trigger_id = n;
        t.ended = ended;
        t.edge = at(0);
        t.seen = at(span);
        t.rows = 48;
        if (n % 3 != 0) {
            t.render_begin = at(1000);
            t.render_end = at(1000 + 10 * span);
            t.detector_end = at(1000 + 12 * span);
            t.quality.error_rms = 0.25F;
        }
        TransmitTimestamps& stamps = log.transmit_timestamps(static_cast<std::uint32_t>(n));
        stamps.note(1, at(3000 * span));
        t.transmit = &stamps;
        log.push(t);
    }
};

std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> parts;
    std::istringstream text(line);
    for (std::string part; std::getline(text, part, ',');)
        parts.push_back(part);
    return parts;
}

} // namespace

TEST_CASE("rows have the numbers of the timing file, and none where a frame has no instant") {
    TimingLog names;
    names.set_transports({"gige", "file"});
    names.set_render({.samples_per_pixel = 9, .threads = 2});
    RecentTiming recent(names, 16);
    const Run run(&recent, 12);
    const std::vector<std::string> header = split(run.log.header());
    const std::vector<std::string> columns = recent.columns();
    const RecentTiming::Rows found = recent.rows(0, 256);
    REQUIRE(found.rows.size() == 12);
    CHECK(found.last == 12);
    REQUIRE(columns.size() > 60);
    CHECK(columns.front() == "frame_id");
    for (std::size_t i = 0; i < found.rows.size(); ++i) {
        const std::vector<std::string> line = split(run.lines[i]);
        std::map<std::string, std::string> in_file;
        for (std::size_t k = 0; k < line.size(); ++k)
            in_file[header[k]] = line[k];
        REQUIRE(found.rows[i].size() == columns.size());
        for (std::size_t k = 0; k < columns.size(); ++k) {
            INFO(columns[k]);
            REQUIRE(in_file.count(columns[k]) == 1);
            CHECK(std::to_string(found.rows[i][k].value_or(0)) == in_file[columns[k]]);
        }
    }
    const auto cell = [&](std::size_t row, const std::string& column) {
        return found.rows[row][static_cast<std::size_t>(std::find(columns.begin(), columns.end(), column) -
                                                        columns.begin())];
    };
    CHECK(cell(2, "render_end_ns") == std::nullopt);
    CHECK(cell(2, "gige_first_byte_ns") == std::nullopt);
    CHECK(cell(2, "worst_row_ns") == 0);
    CHECK(cell(0, "error_ppm") == 250'000);
}

TEST_CASE("a reader that asks with the last number gets each frame once, and only the newest are kept") {
    const TimingLog names;
    RecentTiming recent(names, 16);
    const Run first(&recent, 5);
    const auto triggers = [&](std::uint64_t after, std::size_t most) {
        std::vector<std::int64_t> ids;
        for (const RecentTiming::Row& row : recent.rows(after, most).rows)
            ids.push_back(*row[1]);
        return ids;
    };
    using Ids = std::vector<std::int64_t>;
    CHECK(triggers(0, 256) == Ids{1, 2, 3, 4, 5});
    CHECK(triggers(3, 256) == Ids{4, 5});
    CHECK(triggers(5, 256).empty());
    CHECK(triggers(99, 256).empty());
    CHECK(triggers(0, 2) == Ids{4, 5});
    const Run second(&recent, 40);
    CHECK(recent.rows(0, 256).last == 45);
    CHECK(triggers(0, 256).size() == 16);
    CHECK(triggers(0, 256).front() == 25);
    CHECK(triggers(43, 256) == Ids{39, 40});

    RecentTiming none(names, 0);
    const Run third(&none, 3);
    CHECK(none.rows(0, 256).rows.empty());
    CHECK(none.stages().trigger_seen.count() == 3);
}

TEST_CASE("stages are counted with those frames that reached them") {
    const TimingLog names;
    RecentTiming recent(names, 0);
    const Run run(&recent, 30);
    const StageLatencies& stages = recent.stages();
    std::int64_t all_us = 0, rendered_us = 0;
    for (std::int64_t n = 1; n <= 30; ++n) {
        all_us += n;
        if (n % 3 != 0) rendered_us += n;
    }
    CHECK(stages.trigger_seen.count() == 30);
    CHECK(stages.trigger_seen.sum_ns() == all_us * ns_per_us);
    CHECK(stages.trigger_seen.max_ns() == 30 * ns_per_us);
    CHECK(stages.render.count() == 20);
    CHECK(stages.render.sum_ns() == 10 * rendered_us * ns_per_us);
    CHECK(stages.detector.sum_ns() == 2 * rendered_us * ns_per_us);
    CHECK(stages.first_byte[0].count() == 0);
    CHECK(stages.first_byte[1].sum_ns() == 3000 * all_us * ns_per_us);
}

TEST_CASE("frames that transports may still send are there early, and only once") {
    Run run(nullptr, 0);
    RecentTiming recent(run.log, 4);
    const auto take = [&](std::size_t frames) {
        run.log.drain([&](const FrameTiming& frame) { recent.note(frame); },
                      Time{static_cast<std::int64_t>(frames)});
    };
    using Ids = std::vector<std::uint64_t>;
    const auto ids = [&](std::uint64_t after, std::size_t most, bool early) {
        Ids found;
        for (const RecentTiming::Frame& frame : recent.rows(after, most, early).frames)
            found.push_back(frame.id);
        return found;
    };
    for (std::uint64_t n = 1; n <= 3; ++n)
        run.push(n, Time{static_cast<std::int64_t>(n)});
    CHECK(ids(0, 9, false).empty());
    CHECK(ids(0, 9, true) == Ids{1, 2, 3});
    CHECK(recent.rows(0, 9, true).last == 3);
    take(3); // the two that ended before
    CHECK(ids(0, 9, false) == Ids{1, 2});
    CHECK(ids(0, 9, true) == Ids{1, 2, 3});
    CHECK(ids(1, 9, true) == Ids{2, 3});
    CHECK(ids(0, 2, true) == Ids{2, 3});
    CHECK(ids(3, 9, true).empty());
    for (std::uint64_t n = 4; n <= 7; ++n)
        run.push(n, Time{static_cast<std::int64_t>(n)});
    take(7);
    CHECK(ids(0, 9, false) == Ids{3, 4, 5, 6}); // the ring is full
    CHECK(ids(0, 9, true) == Ids{3, 4, 5, 6, 7});
    CHECK(recent.rows(0, 9, true).rows.back() == recent.rows(6, 1, true).rows.front());
    take(99);
    CHECK(ids(0, 9, true) == Ids{4, 5, 6, 7});
}

TEST_CASE("the lateness of the rows of a frame is kept, of the latest acquisition that has its number") {
    TimingLog log;
    log.keep_rows(4);
    RecentTiming recent(log, 3);
    CHECK_FALSE(recent.row_lateness(0));
    for (std::uint32_t n = 1; n <= 5; ++n) {
        FrameTiming t;
        t.frame_id = n % 3; // 1, 2, 0, 1, 2
        t.facts.acquisition = 1 + n / 3;
        t.row_lateness_us = log.next_rows(3);
        t.row_lateness_us[0] = static_cast<std::int32_t>(10 * n);
        t.row_lateness_us[1] = 0;
        log.push(t);
        log.drain([&](const FrameTiming& frame) { recent.note(frame); });
    }
    const auto newest = recent.row_lateness(0);
    REQUIRE(newest);
    CHECK(newest->frame_id == 2);
    CHECK(newest->acquisition == 2);
    CHECK(newest->us == std::vector<std::int32_t>{50, 0, FrameTiming::not_released});
    const auto other = recent.row_lateness(1);
    REQUIRE(other);
    CHECK(other->us.front() == 40);
    CHECK_FALSE(recent.row_lateness(7));
}

} // namespace recent_timing_test
