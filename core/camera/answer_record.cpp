// SPDX-License-Identifier: Apache-2.0
#include "core/camera/frame_record.hpp"

#include <array>

namespace obscura {
namespace {

using A = FrameAnswer;
constexpr std::array answer_fields{
    field<&A::frame>("frame")
        .as_member()
        .with_help("Number of the frame in its acquisition")
        .as_card("FRAMEID", "counts from 1 at acquisition start")
        .as_header("Frame"),
    field<&A::trigger>("trigger")
        .as_member()
        .with_help("Number of the trigger")
        .as_card("TRIGID", "trigger that asked for the frame")
        .as_header("Trigger"),
    field<&A::edge_tai_ns>("edge_tai_ns")
        .as_member()
        .in("ns")
        .with_help("Instant of the trigger's edge, TAI")
        .as_card("T_EDGE", "[ns] trigger edge, TAI", 3)
        .as_header("Edge-TAI-ns"),
    field<&A::exposure_us>("exposure_us")
        .as_member()
        .in("us")
        .with_help("ExposureTime")
        .as_card("EXPOSURE", "[s] requested exposure time", 2)
        .in_cards_over(1e6)
        .as_header("Exposure-us"),
    field<&A::gain_db>("gain_db")
        .as_member()
        .in("dB")
        .with_help("Gain")
        .as_card("GAIN", "[dB]", 2)
        .as_header("Gain-dB"),
    field<&A::bits>("bits")
        .as_member()
        .with_help("Digital numbers are less than 2^bits")
        .as_card("BITS", "depth of the converter", 1)
        .as_header("Bits"),
    field<&A::mid_exposure_tai_ns>("mid_exposure_tai_ns")
        .as_member()
        .in("ns")
        .with_help("Middle of the exposure, TAI")
        .as_card("T_MID", "[ns] mid-exposure, TAI", 3),
    field<&A::camera_position_m>("camera_position_m")
        .as_member()
        .in("m")
        .with_help("True position of the camera then, inertial")
        .as_cards("CAM_", "XYZ", "[m] position of the camera", 4),
    field<&A::camera_orientation>("camera_orientation")
        .as_member()
        .with_help("Quaternion w, x, y, z: from camera to inertial axes")
        .as_cards("CAM_Q", "WXYZ", "own axes to inertial, the camera", 4),
};

} // namespace

template<>
std::span<const RecordField<FrameAnswer>> record_fields() noexcept {
    return answer_fields;
}

FrameAnswer answer_of(const FrameInfo& info) noexcept {
    const Vec3& p = info.truth.camera.position_m;
    const Quat& q = info.truth.camera.orientation;
    return {.frame = info.frame_id,
            .trigger = info.trigger_id,
            .edge_tai_ns = info.trigger_edge.ns + info.tai_offset_ns,
            .exposure_us = static_cast<double>(info.exposure_ns) / 1e3,
            .gain_db = info.gain_db,
            .bits = static_cast<std::uint32_t>(info.bits_per_pixel),
            .mid_exposure_tai_ns = info.truth.mid_exposure.ns + info.tai_offset_ns,
            .camera_position_m = {p.x, p.y, p.z},
            .camera_orientation = {q.w, q.x, q.y, q.z}};
}

} // namespace obscura
