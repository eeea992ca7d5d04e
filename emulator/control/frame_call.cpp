// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/frame_call.hpp"

#include "core/camera/camera.hpp"
#include "core/camera/frame_record.hpp"
#include "host/frame_members.hpp"
#include "transports/watch/watch.hpp"

#include <fmt/format.h>

#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Work;

struct Arguments {
    std::uint32_t camera = 0;
    std::uint64_t after = 0;
    double wait_s = 10;
    service::Codec codec = service::Codec::none;

    Fields fields() {
        return {
            {camera_key(&camera),
             config::key("after", &after)
                 .range(0, 9e15)
                 .help(
                     "Only a frame whose `number` is larger: that of the frame that the client has seen last; 0: any"),
             config::key("wait_s", &wait_s)
                 .unit("s")
                 .range(0, max_frame_wait_s)
                 .help("Longest wait for such a frame; an exposure can last an hour"),
             config::key("codec", &codec).help("How the pixels are compressed")}};
    }
};

Answer answer_of(transports::WatchedFrame& frame, const Arguments& arguments) {
    const FrameInfo& info = frame.info;
    const auto width = static_cast<std::size_t>(info.width), height = static_cast<std::size_t>(info.height);
    Answer answer;
    answer.head = frame_head(info);
    answer.head["number"] = frame.number;
    answer.head["skipped"] = arguments.after > 0 ? frame.number - arguments.after - 1 : 0;
    answer.head["rows"] = frame.rows;
    answer.head["flags"] = frame.flags;
    answer.arrays.push_back({"pixels", {height, width}, std::move(frame.pixels)});
    service::encode(answer.arrays.back(), arguments.codec);
    return answer;
}

/// With what is known of the daemon.
Answer answer_of(transports::WatchedFrame& frame, const CameraCalls::Cameras& cameras,
                 const Arguments& arguments) {
    Answer answer = answer_of(frame, arguments);
    const ControlledCamera& camera = checked_camera(cameras, arguments.camera);
    if (camera.config_sha256) answer.head["config_sha256"] = camera.config_sha256();
    return answer;
}

transports::WatchTransport& watch_of(const CameraCalls::Cameras& cameras, const Arguments& arguments) {
    transports::WatchTransport* const watch = checked_camera(cameras, arguments.camera).watch;
    if (watch == nullptr) throw Failure(FailureCode::not_now, "frame: the daemon keeps no frames for calls");
    return *watch;
}

/// The newest frame whose number is larger than `after`. Throws Failure.
auto next_frame(const CameraCalls::Cameras& cameras, std::uint64_t after, const Arguments& arguments,
                const Work& work) {
    const auto until = std::chrono::steady_clock::now() +
                       std::chrono::microseconds(static_cast<std::int64_t>(arguments.wait_s * 1e6));
    auto newest = watch_of(cameras, arguments).newest(after, until, work.cancelled());
    if (work.cancelled()) throw service::cancelled();
    if (!newest)
        throw Failure(FailureCode::not_now,
                      fmt::format("frame: none came in {} s{}", arguments.wait_s,
                                  checked_camera(cameras, arguments.camera).camera.acquiring()
                                      ? ""
                                      : "; the camera does not acquire until it is started"));
    return newest;
}

struct FrameArguments : Arguments {
    std::uint64_t number = 0;

    Fields fields() {
        Fields all = Arguments::fields();
        all.keys.push_back(
            config::key("number", &number)
                .range(0, 9e15)
                .help(
                    "The frame with this `number`, if it is one of the latest four that anyone has looked at; 0: the newest one"));
        return all;
    }
};

Answer frame(const CameraCalls::Cameras& cameras, const FrameArguments& arguments, const Work& work) {
    auto found = arguments.number == 0 ? next_frame(cameras, arguments.after, arguments, work)
                                       : watch_of(cameras, arguments).numbered(arguments.number);
    if (!found)
        throw Failure(FailureCode::not_now,
                      fmt::format("frame: number {} is not there any more, or yet", arguments.number));
    Answer answer = answer_of(*found, cameras, arguments);
    if (arguments.number != 0) answer.head["skipped"] = 0;
    return answer;
}

struct StreamArguments : Arguments {
    std::uint64_t every = 1, frames = 0;
    std::uint32_t credits = 1;

    Fields fields() {
        Fields all = Arguments::fields();
        for (config::Key& key :
             config::Keys{config::key("every", &every)
                              .range(1, 1e6)
                              .help("Distance of two frames in those of the camera: 10 gives one of ten"),
                          config::key("frames", &frames)
                              .range(0, 9e15)
                              .help("Frames after which the stream ends; 0: it goes on"),
                          config::key("credits", &credits)
                              .range(0, 1000)
                              .help("Frames that it may send before the client grants more with `credit`")})
            all.keys.push_back(std::move(key));
        return all;
    }
};

/// Sends frames until it is cancelled, each of them the newest one at the time at which it may be sent.
Answer stream(const CameraCalls::Cameras& cameras, StreamArguments arguments, Work& work) {
    (void)watch_of(cameras, arguments);
    work.grant(arguments.credits);
    std::uint64_t sent = 0, skipped = 0;
    while (arguments.frames == 0 || sent < arguments.frames) {
        work.await_credit();
        const std::uint64_t after = arguments.after > 0 ? arguments.after + arguments.every - 1 : 0;
        auto newest = next_frame(cameras, after, arguments, work);
        const std::uint64_t number = newest->number;
        work.reserve(sizeof(std::uint16_t) * static_cast<std::uint64_t>(newest->info.width) *
                     static_cast<std::uint64_t>(newest->info.height));
        Answer frame = answer_of(*newest, cameras, arguments);
        skipped += frame.head["skipped"].get<std::uint64_t>();
        arguments.after = number;
        work.push(std::move(frame));
        ++sent;
    }
    return {{{"frames", sent}, {"skipped", skipped}}};
}

std::vector<service::Result> frame_results() {
    std::vector<service::Result> all{
        {"pixels", "array uint16 [height, width]", "DN", "Digital numbers, first row on top"},
        {"number", "integer", "", "Counts the frames that were looked at, for `after`"},
        {"skipped", "integer", "", "Frames between that of `after` and this one"},
        {"rows", "integer", "", "Rows that are there; the others of an abandoned frame are 0"},
        {"flags", "integer", "", "Flags of the frame, see docs/images.md"}};
    for (service::Result& result : frame_head_results())
        all.push_back(std::move(result));
    all.push_back({"config_sha256", "string", "",
                   "SHA-256 of the configuration in use at the request, as in the call configuration"});
    return all;
}

/// Type of a field in the reference of calls.
std::string_view result_type(const RecordField<FrameAnswer>& field) {
    if (field.count == 3) return "array of 3 numbers";
    if (field.count == 4) return "array of 4 numbers";
    return field.form == FieldForm::f64 ? "number" : "integer";
}

} // namespace

json frame_head(const FrameInfo& info) {
    json head;
    host::add_members(head, obscura::answer_of(info));
    return head;
}

std::vector<service::Result> frame_head_results() {
    std::vector<service::Result> results;
    for (const RecordField<FrameAnswer>& field : record_fields<FrameAnswer>())
        results.push_back({field.member, result_type(field), field.unit, field.help});
    return results;
}

service::Call frame_call(const CameraCalls::Cameras& cameras) {
    service::Call call = service::call<FrameArguments>(
        "frame", service::Permission::view,
        "The newest frame of the camera that the client has not seen, as it left the detector. "
        "A client that asks again and again with the `number` of the last one sees the stream; "
        "frames that came meanwhile are skipped, and counted.",
        [&cameras](const FrameArguments& arguments, Work& work) { return frame(cameras, arguments, work); });
    call.results = frame_results();
    return call;
}

service::Call stream_call(const CameraCalls::Cameras& cameras) {
    service::Call call = service::call<StreamArguments>(
        "stream", service::Permission::view,
        "Sends the frames of the camera as they come, until the request is cancelled: events \"frame\", each of which costs a credit. "
        "Without one nothing is sent, and the newest frame follows once there is one again. "
        "The stream ends if no frame comes for wait_s. Other requests go on beside it.",
        [&cameras](const StreamArguments& arguments, Work& work) {
            return stream(cameras, arguments, work);
        });
    call.beside = true;
    call.frames = frame_results();
    call.results = {{"frames", "integer", "", "Frames that were sent"},
                    {"skipped", "integer", "", "Frames of the camera between them"}};
    return call;
}

} // namespace obscura::emulator
