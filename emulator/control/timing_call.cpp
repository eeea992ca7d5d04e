// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/timing_call.hpp"

#include "emulator/recent_timing.hpp"

#include <utility>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::Failure;
using service::FailureCode;
using service::Fields;

struct Arguments {
    std::uint32_t camera = 0;
    std::uint64_t after = 0, most = 64;

    Fields fields() {
        return {{camera_key(&camera),
                 config::key("after", &after)
                     .range(0, 9e15)
                     .help("Only frames after that of the number, `last` of the answer before; 0: any"),
                 config::key("most", &most).range(1, 256).help("Largest number of rows, the newest ones")}};
    }
};

Answer timing(const CameraCalls::Cameras& cameras, const Arguments& arguments) {
    const ControlledCamera& camera = checked_camera(cameras, arguments.camera);
    const RecentTiming* const timing = camera.timing;
    if (timing == nullptr)
        throw Failure(FailureCode::not_now, "timing: the daemon keeps no time stamps for calls");
    const RecentTiming::Rows found = timing->rows(arguments.after, static_cast<std::size_t>(arguments.most));
    json rows = json::array();
    for (const RecentTiming::Row& row : found.rows) {
        json numbers = json::array();
        for (const std::optional<std::int64_t>& value : row)
            numbers.push_back(value ? json(*value) : json());
        rows.push_back(std::move(numbers));
    }
    return {{{"columns", timing->columns()},
             {"rows", std::move(rows)},
             {"last", found.last},
             {"tai_offset_ns", camera.clock.tai_offset_ns()}}};
}

} // namespace

service::Call timing_call(const CameraCalls::Cameras& cameras) {
    service::Call call = service::call<Arguments>(
        "timing", service::Permission::view,
        "Time stamps of the newest frames, half a second after they have ended: the numbers of the file of "
        "`obscurad --timing`. A client that asks again with `last` gets each frame once.",
        [&cameras](const Arguments& arguments, service::Work& /*work*/) {
            return timing(cameras, arguments);
        });
    call.results = {
        {"columns", "array of strings", "",
         "Names of the numbers of a row, the first one `frame_id`; units stand in the names, instants are of "
         "the machine's monotonic clock"},
        {"rows", "array of arrays", "",
         "Frames, oldest first; nil for an instant that a frame does not have"},
        {"last", "integer", "",
         "Number of the newest frame, counted since the daemon's start: frame ids begin anew at each "
         "acquisition"},
        {"tai_offset_ns", "integer", "ns", "What makes TAI since 1970 of the instants, now"}};
    return call;
}

} // namespace obscura::emulator
