// SPDX-License-Identifier: Apache-2.0
// The lines that tell the bench what the camera does.
#include "core/error.hpp"
#include "emulator/camera/output_lines.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <mutex>
#include <vector>

namespace output_lines_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

/// What a line was set to, and when.
struct Record {
    struct Change {
        bool active;
        Time at;
    };
    std::mutex mutex;
    std::vector<Change> changes;
    std::atomic<bool> broken{false}, present{true};
    std::atomic<int> opened{0};

    std::vector<Change> copy() {
        const std::lock_guard lock(mutex);
        return changes;
    }
    std::size_t count() { return copy().size(); }
};

class RecordedLine final : public sync::OutputLine {
public:
    explicit RecordedLine(Record& record) : record_(record) { ++record.opened; }
    bool set(bool active) noexcept override {
        if (record_.broken) return false;
        const std::lock_guard lock(record_.mutex);
        record_.changes.push_back({active, MonotonicClock().now()});
        return true;
    }

private:
    Record& record_;
};

OutputLines::Open opener(Record& record) {
    return [&record]() -> std::unique_ptr<sync::OutputLine> {
        if (!record.present) throw HardwareError("no such line");
        return std::make_unique<RecordedLine>(record);
    };
}

void wait_until(const std::function<bool()>& condition) {
    while (!condition())
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

} // namespace

TEST_CASE("the exposure line is active from the first row's reset to the last row's readout") {
    Record ready, exposure;
    CameraBench bench(small_sensor(), 5, [](CameraSettings& s) { s.exposure_ns = 30 * ns_per_ms; });
    OutputLines lines(bench.camera, bench.clock, {}, opener(ready), opener(exposure));
    lines.start();
    CHECK(ready.count() == 0); // not acquiring
    bench.camera.acquisition_start();
    wait_until([&] { return ready.count() == 1; });
    CHECK(ready.copy().back().active);
    for (std::uint64_t id = 1; id <= 3; ++id) {
        wait_until([&] { return bench.camera.ready_for_line0(bench.clock.now()); });
        const Time edge = bench.clock.now();
        bench.camera.on_trigger({id, edge, edge});
        bench.wait_ended(static_cast<std::uint32_t>(id));
        wait_until([&] { return exposure.count() == 2 * id; });
        const auto changes = exposure.copy();
        const CameraMoments moments = bench.camera.moments();
        const auto begin = changes[2 * id - 2], end = changes[2 * id - 1];
        CHECK(begin.active);
        CHECK_FALSE(end.active);
        CHECK(moments.exposure_end - moments.exposure_start >= 30 * ns_per_ms);
        CHECK(begin.at >= moments.exposure_start);
        CHECK(end.at >= moments.exposure_end);
    }
    wait_until([&] { return ready.copy().back().active; });
    const auto changes = ready.copy();
    for (std::size_t i = 0; i < changes.size(); ++i)
        CHECK(changes[i].active == (i % 2 == 0)); // never the same twice
    CHECK(changes.size() >= 3);
    bench.camera.acquisition_stop(true);
    wait_until([&] { return !ready.copy().back().active; });
    lines.stop();
    CHECK(lines.exposures() == 3);
}

TEST_CASE("a line that is not there is an error at the start; one that goes is opened anew") {
    Record ready, exposure;
    CameraBench bench;
    exposure.present = false;
    OutputLines lines(bench.camera, bench.clock, {}, opener(ready), opener(exposure));
    CHECK_THROWS_AS(lines.start(), HardwareError);
    exposure.present = true;
    lines.start();
    ready.broken = true;
    bench.camera.acquisition_start();
    wait_until([&] { return lines.lost() == 1; });
    ready.broken = false;
    wait_until([&] { return ready.count() == 1; });
    CHECK(ready.copy().back().active);
    CHECK(ready.opened >= 2);
    lines.stop();
}

TEST_CASE("no lines, no thread") {
    CameraBench bench;
    OutputLines lines(
        bench.camera, bench.clock, {}, [] { return nullptr; }, [] { return nullptr; });
    lines.start();
    CHECK(lines.heartbeat().beats() == 0);
    lines.stop();
}

} // namespace output_lines_test
