// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/scene_tables.hpp"

#include "renderer/lights/spectrum.hpp"
#include "serve/compatible/client_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

namespace obscura::serve::compatible {
namespace {

using nlohmann::json;

json table_json(const Vec3& v) {
    return {v.x, v.y, v.z};
}
json table_json(const Quat& q) {
    return {q.w, q.x, q.y, q.z};
}

/// The bands of the channels, and the Sun. Its light is free in each channel: the largest sets the factor on
/// the spectrum, transmissions lower the others. Nothing else here depends on them.
void add_sunlight(const ClientState& client_state, json& tree) {
    Channels ratio{};
    for (std::size_t c = 0; c < channels; ++c) {
        const SpectralBand band{client_state.bands[c].from_nm * 1e-9, client_state.bands[c].to_nm * 1e-9};
        ratio[c] = client_state.sun_power_w_sr[c] / (au_m * au_m) / renderer::sun_irradiance_w_m2(band);
    }
    const double largest = *std::max_element(ratio.begin(), ratio.end());
    for (std::size_t c = 0; c < channels; ++c) {
        const ChannelBand& band = client_state.bands[c];
        json row{{"from_nm", band.from_nm}, {"to_nm", band.to_nm}};
        if (ratio[c] < largest) row["transmission"] = json::array({{band.from_nm, ratio[c] / largest}});
        tree["band"].push_back(std::move(row));
    }
    tree["sun"]["irradiance_scale"] = largest;
}

/// An offset in the frame of an object, of the rows at times since the exposure began, between them linear.
Pose offset_at(const std::vector<scene::TimedPose>& rows, double time_s) {
    const auto after = std::find_if(rows.begin(), rows.end(),
                                    [&](const scene::TimedPose& row) { return row.time_s > time_s; });
    if (after == rows.begin()) return rows.empty() ? Pose{} : rows.front().pose;
    const scene::TimedPose& before = *std::prev(after);
    if (after == rows.end()) return before.pose;
    const double share = (time_s - before.time_s) / (after->time_s - before.time_s);
    return interpolate(before.pose, after->pose, share);
}

/// Keys of position and attitude; of a motion during the exposure a table of both. `motion` and `offset_m`
/// are in the frame of the object.
void add_placement(ClientState& client_state, const Placement& p, json& table,
                   const std::vector<scene::TimedPose>& motion = {}, Vec3 offset_m = {}) {
    const double span_s = client_state.camera.exposure_s();
    const double turned_rad = length(p.rate_rad_s) * span_s;
    const auto pose_at = [&](double t) {
        const Quat q =
            turned_rad > 0 ? axis_angle(p.rate_rad_s, length(p.rate_rad_s) * t) * p.attitude : p.attitude;
        const Pose moved = offset_at(motion, t);
        const Quat turned = q * p.element.orientation * moved.orientation;
        return Pose{p.position_m + p.velocity_m_s * t + rotate(q, p.element.position_m) +
                        rotate(q * p.element.orientation, moved.position_m) + rotate(turned, offset_m),
                    turned};
    };
    if (turned_rad == 0 && (span_s == 0 || length(p.velocity_m_s) == 0) && motion.size() < 2) {
        table["position_m"] = table_json(pose_at(0).position_m);
        table["orientation"] = table_json(pose_at(0).orientation);
        return;
    }
    // Attitudes between rows take the shorter way: rows are at most a radian apart.
    const int steps = 1 + static_cast<int>(std::min(turned_rad, 1e5));
    std::vector<double> times;
    for (int i = 0; i <= steps; ++i)
        times.push_back(span_s * i / steps);
    for (const scene::TimedPose& row : motion)
        if (row.time_s > 0 && row.time_s < span_s) times.push_back(row.time_s);
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    std::string text = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n";
    for (const double t : times) {
        const auto [at, q] = pose_at(t);
        text += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", t, at.x,
                            at.y, at.z, q.w, q.x, q.y, q.z);
    }
    table["trajectory"] = client_state.own.file_of(".csv", text);
}

json camera_table(ClientState& client_state) {
    const CameraSettings& c = client_state.camera;
    // The detector of a scanning device has one pixel.
    const bool scans = client_state.rendering.scanning_device;
    const std::int32_t width = scans ? 1 : c.width, height = scans ? 1 : c.height;
    const double fx_px = width / 2.0 / c.lens.radius(c.fov_x_rad / 2);
    const double fy_px = height / 2.0 / c.lens.radius(c.fov_y_rad / 2, true);
    // Any pitch makes the same picture; focal lengths of scene files begin at 0.1 mm, pitches end at 1 mm.
    const double pitch_um = std::clamp(200 / fx_px, 10.0, 1000.0);
    json table{{"width", width},
               {"height", height},
               {"pixel_pitch_um", pitch_um},
               {"focal_length_mm", fx_px * pitch_um * 1e-3},
               {"psf_sigma_px", 0.0}};
    if (fx_px != fy_px) table["pixel_pitch_y_um"] = pitch_um * fx_px / fy_px;
    if (!c.psf.file.empty()) {
        table["psf"] = "table";
        table["psf_file"] = c.psf.file;
        // Half of the diagonal of what it covers, in pitches of the columns.
        const double reach = std::hypot(c.psf.support_w, c.psf.support_h * fx_px / fy_px) / 2 + 1;
        table["psf_core_px"] = std::clamp(reach, 2.0, 128.0);
    }
    if (c.lens.projection == scene::Projection::model)
        table["projection"] = c.lens.own;
    else if (c.lens.projection != scene::Projection::pinhole)
        table["projection"] = name_of(c.lens.projection);
    if (c.lens.distortion != PictureLens{}.distortion) {
        table["distortion"] = "brown-conrady";
        table["distortion_coefficients"] = c.lens.distortion;
    }
    if (c.timing != nullptr && !scans) table["shutter"] = c.shutter;
    // Through each point of the pupil the plane of focus is seen at the same place.
    const auto [x_m, y_m] = c.pupil_point_m;
    if (c.focus_m > 0) table["principal_offset_px"] = {fx_px * x_m / c.focus_m, fy_px * y_m / c.focus_m};
    add_placement(client_state, client_state.objects.at("camera").placement, table, c.motion, {x_m, y_m, 0});
    return table;
}

/// Globals of models that the client has set.
void add_globals(const ClientState& client_state, json& tree) {
    const auto* const given = client_state.remembered.find("global variables");
    const auto* const fields = given != nullptr ? given->as<service::compatible::Fields>() : nullptr;
    if (fields == nullptr) return;
    for (const auto& [name, value] : *fields) {
        std::vector<double> numbers(1);
        if (to_number(value, numbers[0]) || to_numbers(value, numbers))
            tree["global"].push_back({{"name", name}, {"values", numbers}});
    }
}

} // namespace

json scene_tables(ClientState& client_state) {
    json tree{
        {"quantity", client_state.rendering.irradiance ? "irradiance" : "radiance"},
        {"max_bounces", client_state.rendering.path_tracing ? client_state.rendering.secondary_rays : 0}};
    add_sunlight(client_state, tree);
    tree["camera"] = camera_table(client_state);
    for (const auto& [name, object] : client_state.objects) {
        json table = object.keys;
        switch (object.kind) {
        case Object::Kind::camera:
            break;
        case Object::Kind::sun:
            tree["sun"]["position_m"] =
                table_json(to_parent({object.placement.position_m, object.placement.attitude},
                                     object.placement.element.position_m));
            tree["sun"].update(table);
            break;
        case Object::Kind::body:
        case Object::Kind::light:
            table["name"] = name;
            add_placement(client_state, object.placement, table);
            tree[object.kind == Object::Kind::body ? "body" : "lamp"].push_back(std::move(table));
            break;
        }
    }
    if (!client_state.background.file.empty() && !client_state.rendering.scanning_device)
        tree["stars"]["irradiances"] = client_state.background.file;
    add_globals(client_state, tree);
    client_state.own.sweep();
    return tree;
}

} // namespace obscura::serve::compatible
