// SPDX-License-Identifier: Apache-2.0
#include "core/camera/frame_record.hpp"

#include <array>

namespace obscura {
namespace {

using G = GroundTruth;
constexpr std::array truth_fields{
    field<&G::mid_exposure>("mid_exposure_ns").at(0x000).as_feature("ChunkMidExposure").in("ns"),
    field<&G::seed>("seed").at(0x058).as_feature("ChunkSceneSeed"),
    field<&G::run>("run").at(0x064).as_feature("ChunkSceneRun",
                                               "Run word of the temporal noise, beside the seed"),
    field<&G::camera, &Pose::position_m, &Vec3::x>("camera_position_x")
        .at(0x008)
        .as_feature("ChunkCameraPositionX")
        .in("m"),
    field<&G::camera, &Pose::position_m, &Vec3::y>("camera_position_y")
        .at(0x010)
        .as_feature("ChunkCameraPositionY")
        .in("m"),
    field<&G::camera, &Pose::position_m, &Vec3::z>("camera_position_z")
        .at(0x018)
        .as_feature("ChunkCameraPositionZ")
        .in("m"),
    field<&G::camera, &Pose::orientation, &Quat::w>("camera_attitude_w")
        .at(0x020)
        .as_feature("ChunkCameraAttitudeW"),
    field<&G::camera, &Pose::orientation, &Quat::x>("camera_attitude_x")
        .at(0x028)
        .as_feature("ChunkCameraAttitudeX"),
    field<&G::camera, &Pose::orientation, &Quat::y>("camera_attitude_y")
        .at(0x030)
        .as_feature("ChunkCameraAttitudeY"),
    field<&G::camera, &Pose::orientation, &Quat::z>("camera_attitude_z")
        .at(0x038)
        .as_feature("ChunkCameraAttitudeZ"),
    field<&G::sun_position_m, &Vec3::x>("sun_position_x").at(0x040).as_feature("ChunkSunPositionX").in("m"),
    field<&G::sun_position_m, &Vec3::y>("sun_position_y").at(0x048).as_feature("ChunkSunPositionY").in("m"),
    field<&G::sun_position_m, &Vec3::z>("sun_position_z").at(0x050).as_feature("ChunkSunPositionZ").in("m"),
    field<&G::body_count>("body_count").at(0x060).as_feature("ChunkBodyCount"),
    field<&G::intrinsics, &Intrinsics::focal_length_px>("focal_length_x")
        .element(0)
        .at(0x5e8)
        .as_feature("ChunkFocalLengthX",
                    "Focal length over the pitch of the columns, in pixels of the sensor")
        .in("px"),
    field<&G::intrinsics, &Intrinsics::focal_length_px>("focal_length_y")
        .element(1)
        .at(0x5f0)
        .as_feature("ChunkFocalLengthY", "Focal length over the pitch of the rows, in pixels of the sensor")
        .in("px"),
    field<&G::intrinsics, &Intrinsics::principal_point_px>("principal_point_x")
        .element(0)
        .at(0x5f8)
        .as_feature("ChunkPrincipalPointX", "Column of the sensor that the optical axis meets")
        .in("px"),
    field<&G::intrinsics, &Intrinsics::principal_point_px>("principal_point_y")
        .element(1)
        .at(0x600)
        .as_feature("ChunkPrincipalPointY", "Row of the sensor that the optical axis meets")
        .in("px"),
    field<&G::intrinsics, &Intrinsics::pixel_pitch_m>("pixel_pitch_x")
        .element(0)
        .at(0x608, 1e6)
        .as_feature("ChunkSensorPixelWidth", "Pitch of the columns of the sensor")
        .in("um"),
    field<&G::intrinsics, &Intrinsics::pixel_pitch_m>("pixel_pitch_y")
        .element(1)
        .at(0x610, 1e6)
        .as_feature("ChunkSensorPixelHeight", "Pitch of the rows of the sensor")
        .in("um"),
    field<&G::camera_pose_age_s>("camera_pose_age_s")
        .at(0x618)
        .as_feature("ChunkCameraPoseAge",
                    "Time by which mid-exposure is later than the newest pose of the camera that is known")
        .in("s"),
};
static_assert(is_disjoint<G>(truth_fields));
static_assert(record_bytes<G>(truth_fields) == truth_ages_offset);

using B = BodyTruth;
constexpr std::array body_fields{
    field<&B::name>("name").at(0x00).as_feature("ChunkBodyName"),
    field<&B::pose, &Pose::position_m, &Vec3::x>("position_x")
        .at(0x20)
        .as_feature("ChunkBodyPositionX")
        .in("m"),
    field<&B::pose, &Pose::position_m, &Vec3::y>("position_y")
        .at(0x28)
        .as_feature("ChunkBodyPositionY")
        .in("m"),
    field<&B::pose, &Pose::position_m, &Vec3::z>("position_z")
        .at(0x30)
        .as_feature("ChunkBodyPositionZ")
        .in("m"),
    field<&B::pose, &Pose::orientation, &Quat::w>("attitude_w").at(0x38).as_feature("ChunkBodyAttitudeW"),
    field<&B::pose, &Pose::orientation, &Quat::x>("attitude_x").at(0x40).as_feature("ChunkBodyAttitudeX"),
    field<&B::pose, &Pose::orientation, &Quat::y>("attitude_y").at(0x48).as_feature("ChunkBodyAttitudeY"),
    field<&B::pose, &Pose::orientation, &Quat::z>("attitude_z").at(0x50).as_feature("ChunkBodyAttitudeZ"),
};
static_assert(truth_bodies_offset + max_truth_bodies * record_bytes<B>(body_fields) == 0x5e8,
              "the bodies end where the intrinsics begin");

constexpr std::array age_fields{field<&BodyAge::pose_age_s>("pose_age_s")
                                    .at(0)
                                    .as_feature("ChunkBodyPoseAge", "As ChunkCameraPoseAge, of the body")
                                    .in("s")};

using E = TruthEntry;
/// Bit 0: lit, bit 1: saturated.
constexpr RecordField<E> entry_flags{.name = "flags",
                                     .get = [](const E& e, std::size_t /*element*/) -> FieldValue {
                                         return std::uint64_t{(e.lit ? 1U : 0U) | (e.saturated ? 2U : 0U)};
                                     },
                                     .set =
                                         [](E& e, std::size_t /*element*/, const FieldValue& value) {
                                             const std::uint64_t flags = *std::get_if<std::uint64_t>(&value);
                                             e.lit = (flags & 1) != 0, e.saturated = (flags & 2) != 0;
                                         }};
constexpr std::array entry_fields{
    field<&E::kind>("kind").at(0x00).as_feature(
        "ChunkTruthKind", "0 star, 1 body, 2 landmark, 3 limb, 4 terminator, 5 galaxy, 6 crater, 7 boulder"),
    field<&E::visibility>("visibility")
        .at(0x04)
        .as_feature("ChunkTruthVisibility", "0 visible, 1 partly, 2 hidden, 3 outside"),
    entry_flags.at(0x08).as_feature("ChunkTruthFlags", "1 lit by the Sun, 2 saturated"),
    field<&E::window>("window").at(0x0c).as_feature("ChunkTruthWindow",
                                                    "Window of the image in which it lands"),
    field<&E::object>("object").at(0x10).as_feature("ChunkTruthObject",
                                                    "Number of the star or body in the scene"),
    field<&E::item>("item").at(0x14).as_feature(
        "ChunkTruthItem", "Number of the landmark, crater or boulder, or of the point along the curve"),
    field<&E::name>("name").at(0x18).as_feature("ChunkTruthName"),
    field<&E::x_px>("x_px")
        .at(0x38)
        .as_feature("ChunkTruthX", "Centroid of its light in the image; centre of the first pixel: 0")
        .in("px"),
    field<&E::y_px>("y_px").at(0x40).as_feature("ChunkTruthY").in("px"),
    field<&E::time>("time_ns")
        .at(0x48)
        .as_feature("ChunkTruthTime", "Middle of the exposure of the row on which it lands")
        .in("ns"),
    field<&E::exposure_ns>("exposure_ns")
        .at(0x50)
        .as_feature("ChunkTruthExposureTime", "Of that row")
        .in("ns"),
    field<&E::range_m>("range_m").at(0x58).as_feature("ChunkTruthRange").in("m"),
    field<&E::visible_share>("visible_share").at(0x60).as_feature("ChunkTruthVisibleShare"),
    field<&E::magnitude_v>("magnitude_v")
        .at(0x68)
        .as_feature("ChunkTruthMagnitude", "Of a star, Johnson V")
        .in("mag"),
    field<&E::irradiance_w_m2>("irradiance_w_m2").at(0x70).as_feature("ChunkTruthIrradiance").in("W/m2"),
    field<&E::signal_e>("signal_e")
        .at(0x78)
        .as_feature("ChunkTruthSignal", "Expected electrons in all its pixels")
        .in("e-"),
    field<&E::peak_e>("peak_e")
        .at(0x80)
        .as_feature("ChunkTruthPeak", "Expected electrons in its brightest pixel")
        .in("e-"),
    field<&E::snr>("snr").at(0x88).as_feature("ChunkTruthSNR"),
    field<&E::psf_x_px>("psf_x_px")
        .at(0x90)
        .as_feature("ChunkTruthPsfX", "Part of the position that the asymmetry of the PSF makes")
        .in("px"),
    field<&E::psf_y_px>("psf_y_px").at(0x98).as_feature("ChunkTruthPsfY").in("px"),
};
static_assert(is_disjoint<E>(entry_fields));

} // namespace

template<>
std::span<const RecordField<GroundTruth>> record_fields() noexcept {
    return truth_fields;
}
template<>
std::span<const RecordField<BodyTruth>> record_fields() noexcept {
    return body_fields;
}
template<>
std::span<const RecordField<BodyAge>> record_fields() noexcept {
    return age_fields;
}
template<>
std::span<const RecordField<TruthEntry>> record_fields() noexcept {
    return entry_fields;
}

} // namespace obscura
