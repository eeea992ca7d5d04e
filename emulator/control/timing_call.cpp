// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/timing_call.hpp"

#include "core/clock.hpp"
#include "emulator/record/recent_timing.hpp"
#include "transports/watch/watch.hpp"

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::Failure;
using service::FailureCode;
using service::Fields;

struct TimingArguments {
    std::uint32_t camera = 0;
    std::uint64_t after = 0, most = 64;
    bool early = false, saturated = false;

    Fields fields() {
        return {
            {camera_key(&camera),
             config::key("after", &after)
                 .range(0, 9e15)
                 .help("Only frames after that of the number, `last` of the answer before; 0: any"),
             config::key("most", &most).range(1, 1024).help("Largest number of rows, the newest ones"),
             config::key("early", &early)
                 .help(
                     "Also frames that ended less than half a second ago: instants of transports that are still sending are nil"),
             config::key("saturated", &saturated)
                 .help(
                     "Another column, `saturated`: pixels at the largest digital number. "
                     "They are counted from the first request on while one comes every two seconds; "
                     "with `early` a frame waits for its count, a quarter of a second at most. nil: not counted")}};
    }
};

/// Longest time that a frame waits for its count.
constexpr std::int64_t count_timeout_ns = 250 * ns_per_ms;

/// Adds the column to the rows, and leaves out those from the first on whose count is still to come.
void add_saturated(RecentTiming::Rows& found, const transports::WatchTransport* watch, Time now) {
    for (std::size_t i = 0; i < found.rows.size(); ++i) {
        const RecentTiming::Frame& frame = found.frames[i];
        const std::optional<std::uint32_t> pixels =
            watch != nullptr ? watch->saturated().of(frame.id, frame.edge) : std::nullopt;
        if (!pixels && watch != nullptr && now - frame.ended < count_timeout_ns) {
            found.last -= found.rows.size() - i;
            found.rows.resize(i);
            return;
        }
        found.rows[i].push_back(pixels ? std::optional<std::int64_t>(*pixels) : std::nullopt);
    }
}

const RecentTiming& timing_of(const ControlledCamera& camera) {
    if (camera.timing == nullptr)
        throw Failure(FailureCode::not_now, "timing: the daemon keeps no time stamps for calls");
    return *camera.timing;
}

Answer timing(const CameraCalls::Cameras& cameras, const TimingArguments& arguments) {
    const ControlledCamera& camera = checked_camera(cameras, arguments.camera);
    const RecentTiming& timing = timing_of(camera);
    // Before the rows, so that one that is there has been copied, or will be.
    if (arguments.saturated && camera.watch != nullptr) camera.watch->count_saturated();
    RecentTiming::Rows found =
        timing.rows(arguments.after, static_cast<std::size_t>(arguments.most), arguments.early);
    std::vector<std::string> columns = timing.columns();
    if (arguments.saturated) {
        columns.emplace_back("saturated");
        add_saturated(found, camera.watch, MonotonicClock().now());
    }
    json rows = json::array();
    for (const RecentTiming::Row& row : found.rows) {
        json numbers = json::array();
        for (const std::optional<std::int64_t>& value : row)
            numbers.push_back(value ? json(*value) : json());
        rows.push_back(std::move(numbers));
    }
    return {{{"columns", std::move(columns)},
             {"rows", std::move(rows)},
             {"last", found.last},
             {"tai_offset_ns", camera.clock.tai_offset_ns()}}};
}

struct RowArguments {
    std::uint32_t camera = 0;
    std::uint64_t frame = 0;

    Fields fields() {
        return {
            {camera_key(&camera),
             config::key("frame", &frame)
                 .range(0, 9e15)
                 .help(
                     "Number of the frame, one of the newest 1024, that of the latest acquisition which has one; 0: the newest")}};
    }
};

Answer timing_rows(const CameraCalls::Cameras& cameras, const RowArguments& arguments) {
    const auto found = timing_of(checked_camera(cameras, arguments.camera)).row_lateness(arguments.frame);
    if (!found)
        throw Failure(FailureCode::not_now,
                      arguments.frame == 0
                          ? "timing.rows: no frame has ended yet"
                          : fmt::format("timing.rows: frame {} is not one of the latest that have ended",
                                        arguments.frame));
    json rows = json::array();
    for (const std::int32_t us : found->us)
        rows.push_back(us != FrameTiming::not_released ? json(us) : json());
    return {
        {{"frame", found->frame_id}, {"acquisition", found->acquisition}, {"lateness_us", std::move(rows)}}};
}

} // namespace

service::Call timing_call(const CameraCalls::Cameras& cameras) {
    service::Call call = service::call<TimingArguments>(
        "timing", service::Permission::view,
        "Time stamps of the newest frames, half a second after they have ended, when transports have finished them: the numbers of the file of `obscurad --timing`. "
        "A client that asks again with `last` gets each frame once.",
        [&cameras](const TimingArguments& arguments, service::Work& /*work*/) {
            return timing(cameras, arguments);
        });
    call.results = {
        {"columns", "array of strings", "",
         "Names of the numbers of a row, the first one `frame_id`; "
         "units stand in the names, instants are of the machine's monotonic clock"},
        {"rows", "array of arrays", "",
         "Frames, oldest first; nil for an instant that a frame does not have"},
        {"last", "integer", "",
         "Number of the newest frame, counted since the daemon's start: frame ids begin anew at each acquisition"},
        {"tai_offset_ns", "integer", "ns", "What makes TAI since 1970 of the instants, now"}};
    return call;
}

service::Call timing_rows_call(const CameraCalls::Cameras& cameras) {
    service::Call call = service::call<RowArguments>(
        "timing.rows", service::Permission::view,
        "How late each row of a frame left, half a second after the frame has ended: "
        "`row_lateness_us` of the file of `obscurad --timing`.",
        [&cameras](const RowArguments& arguments, service::Work& /*work*/) {
            return timing_rows(cameras, arguments);
        });
    call.results = {
        {"frame", "integer", "", "Number of the frame"},
        {"acquisition", "integer", "", "Number of its acquisition"},
        {"lateness_us", "array of integers", "us",
         "Release of each row after its time, whole ones, first row first; nil for a row that did not leave"}};
    return call;
}

} // namespace obscura::emulator
