// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/camera_file.hpp"

#include "images/writers/raw.hpp"
#include "tools/scene/vector_json.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::tools {
namespace {

using Json = nlohmann::ordered_json;

/// A matrix as cv::FileStorage writes it.
Json matrix(std::size_t rows, std::size_t columns, const std::vector<double>& row_major) {
    return {
        {"type_id", "opencv-matrix"}, {"rows", rows}, {"cols", columns}, {"dt", "d"}, {"data", row_major}};
}

/// OpenCV's function that projects as the camera does, and its coefficients.
struct OpencvModel {
    const char* function = nullptr; ///< null: there is none
    std::vector<double> coefficients{};
};

OpencvModel opencv_model(const scene::Camera& camera) {
    using Model = scene::Distortion::Model;
    const scene::Distortion& d = camera.distortion;
    const auto coefficient = [&](std::size_t i) {
        return i < d.coefficients.size() ? d.coefficients[i] : 0.0;
    };
    const bool pinhole = camera.projection == scene::Projection::pinhole;
    const bool fisheye = camera.projection == scene::Projection::equidistant;
    // OpenCV has no rotation of the sensor: it goes into the poses, which only models that are the same in
    // all directions allow.
    const bool turned = camera.sensor_rotation_rad != 0;
    if (pinhole && d.model == Model::none) return {"cv::projectPoints", std::vector<double>(5)};
    if (pinhole && d.model == Model::radial && coefficient(3) == 0)
        return {"cv::projectPoints", {coefficient(0), coefficient(1), 0, 0, coefficient(2)}};
    if (pinhole && d.model == Model::opencv && !turned) {
        std::size_t count = 5; // the lengths that OpenCV takes: 4, 5, 8, 12, 14
        for (const std::size_t length : {8, 12})
            if (std::any_of(d.coefficients.begin() +
                                static_cast<std::ptrdiff_t>(std::min(count, d.coefficients.size())),
                            d.coefficients.end(), [](double c) { return c != 0; }))
                count = length;
        OpencvModel model{"cv::projectPoints"};
        for (std::size_t i = 0; i < count; ++i)
            model.coefficients.push_back(coefficient(i));
        return model;
    }
    if (fisheye && d.model == Model::none) return {"cv::fisheye::projectPoints", std::vector<double>(4)};
    if (fisheye && d.model == Model::radial)
        return {"cv::fisheye::projectPoints",
                {coefficient(0), coefficient(1), coefficient(2), coefficient(3)}};
    return {};
}

/// Orientation of the camera with the sensor's rotation in it where OpenCV's model needs that.
Quat opencv_orientation(const scene::Camera& camera, Quat orientation) {
    if (camera.sensor_rotation_rad == 0) return orientation;
    return orientation * axis_angle({0, 0, 1}, camera.sensor_rotation_rad);
}

/// `opencv`: camera whose orientation R and t state; null: none is stated.
Json frame_json(const scene::Camera* opencv, const CameraFileFrame& frame) {
    const GroundTruth& truth = frame.truth;
    Json out;
    if (!frame.file.empty()) out["file"] = frame.file;
    out["number"] = frame.number;
    out["time_s"] = frame.time_s;
    out["exposure_s"] = frame.exposure_s;
    out["position_m"] = vector_json(truth.camera.position_m);
    out["orientation_wxyz"] = quaternion_json(truth.camera.orientation);
    if (opencv != nullptr) {
        const Mat3 r = to_matrix(conjugate(opencv_orientation(*opencv, truth.camera.orientation)));
        const Vec3 t = -(r * truth.camera.position_m);
        out["R"] = matrix(3, 3,
                          {r.m[0][0], r.m[0][1], r.m[0][2], r.m[1][0], r.m[1][1], r.m[1][2], r.m[2][0],
                           r.m[2][1], r.m[2][2]});
        out["t"] = matrix(3, 1, {t.x, t.y, t.z});
    }
    out["sun_position_m"] = vector_json(truth.sun_position_m);
    out["bodies"] = Json::array();
    for (std::uint32_t i = 0; i < std::min<std::uint32_t>(truth.body_count, max_truth_bodies); ++i) {
        const BodyTruth& body = truth.bodies[i];
        out["bodies"].push_back({{"name", body.name.data()},
                                 {"position_m", vector_json(body.pose.position_m)},
                                 {"orientation_wxyz", quaternion_json(body.pose.orientation)}});
    }
    return out;
}

} // namespace

PictureCamera PictureCamera::of_scene(const scene::Camera& camera, Region window) {
    return {camera.intrinsics(), camera.width, camera.height, window, {1, 1}, camera};
}

std::string camera_file_text(const PictureCamera& camera, const std::vector<CameraFileFrame>& frames) {
    const Intrinsics& in = camera.intrinsics;
    const Region& window = camera.window;
    const OpencvModel model = camera.lens ? opencv_model(*camera.lens) : OpencvModel{};
    // The first pixel of a binned picture is the mean of its sensor pixels' places.
    const auto principal = [&](std::size_t axis, std::int32_t first) {
        const double binning = camera.binning[axis];
        return (in.principal_point_px[axis] - first + 0.5) / binning - 0.5;
    };
    Json out;
    out["conventions"] = {
        {"pixels", "(0, 0) is the centre of the upper left pixel of the picture; x right, y down"},
        {"camera_axes", "x right, y down, z boresight"},
        {"orientation_wxyz",
         "unit quaternion, scalar first: turns vectors of the camera's (body's) own axes into the inertial frame"},
        {"R_t", "x_camera = R x_inertial + t, metres; with sensor_rotation_deg in R"},
    };
    out["image_width"] = window.width / camera.binning[0];
    out["image_height"] = window.height / camera.binning[1];
    out["camera_matrix"] =
        matrix(3, 3,
               {in.focal_length_px[0] / camera.binning[0], 0, principal(0, window.x), 0,
                in.focal_length_px[1] / camera.binning[1], principal(1, window.y), 0, 0, 1});
    if (model.function != nullptr) {
        out["opencv_function"] = model.function;
        out["distortion_coefficients"] = matrix(1, model.coefficients.size(), model.coefficients);
    }
    out["sensor"] = {{"width", camera.sensor_width},
                     {"height", camera.sensor_height},
                     {"window_x", window.x},
                     {"window_y", window.y},
                     {"pixel_pitch_um", 1e6 * in.pixel_pitch_m[0]},
                     {"pixel_pitch_y_um", 1e6 * in.pixel_pitch_m[1]}};
    if (camera.lens) {
        const scene::Camera& lens = *camera.lens;
        out["lens"] = {{"focal_length_mm", 1e3 * lens.focal_length_m},
                       {"projection", std::string(name_of(lens.projection))},
                       {"distortion", std::string(name_of(lens.distortion.model))},
                       {"distortion_coefficients", lens.distortion.coefficients},
                       {"distortion_ideal_mm", lens.distortion.ideal_mm},
                       {"distortion_real_mm", lens.distortion.real_mm},
                       {"sensor_rotation_deg", lens.sensor_rotation_rad * 180 / std::numbers::pi}};
        if (lens.own_projection.loaded != nullptr)
            out["lens"]["projection_model"] = lens.own_projection.loaded->model->name();
    }
    out["frames"] = Json::array();
    for (const CameraFileFrame& frame : frames)
        out["frames"].push_back(frame_json(model.function != nullptr ? &*camera.lens : nullptr, frame));
    return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_camera_file(const std::filesystem::path& file, const PictureCamera& camera,
                       const std::vector<CameraFileFrame>& frames) {
    images::write_text(file, camera_file_text(camera, frames));
}

} // namespace obscura::tools
