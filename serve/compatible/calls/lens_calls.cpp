// SPDX-License-Identifier: Apache-2.0
// Commands of the camera's models: projection, focus, motion, times of the rows, wavelengths of the channels.
// The published program has them in files that are not public; the names and parameters here are ours.
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "models/kinds/timing_program.hpp"
#include "models/values/model_values.hpp"
#include "renderer/scene/trajectory.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/model_files.hpp"
#include "serve/compatible/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace obscura::serve::compatible {
namespace {

/// Refuses a field of view that the lens does not show.
void check_field(const Request& r, const PictureLens& lens, std::string_view argument, double fov_x_rad,
                 double fov_y_rad) {
    if (std::isfinite(lens.radius(fov_x_rad / 2)) && std::isfinite(lens.radius(fov_y_rad / 2, true))) return;
    throw r.arguments.refused(
        argument, fmt::format("the field of view of {} x {} rad is too wide for it", fov_x_rad, fov_y_rad),
        "one that the projection shows");
}

/// The values of a model's table, as the scene of a picture will read them.
models::ModelValues values_of(const nlohmann::json& table, const std::filesystem::path& file,
                              std::string_view kind) {
    models::ModelValues values = models::defaults_of(models::load_model(file.string(), kind));
    const auto& known = values.loaded->model->parameters();
    for (std::size_t i = 0; i < known.size(); ++i) {
        const auto given = table.find(values.loaded->keys[i]);
        if (given == table.end()) continue;
        const std::vector<double> numbers =
            given->is_array() ? given->get<std::vector<double>>() : std::vector{given->get<double>()};
        for (std::size_t c = 0; c < numbers.size(); ++c)
            values.values[i][c] = numbers[c] * known[i].si();
    }
    return values;
}

/// A projection in SuMoL.
void load_own_projection(Request& r, const std::filesystem::path& file) {
    Parameters parameters(r);
    PictureLens lens{scene::Projection::model, {}};
    lens.own = table_of_model(r, file, "projection", "a projection in SuMoL", parameters);
    parameters.check_rest();
    const models::ModelValues values = values_of(lens.own, file, "projection");
    lens.unit = std::make_shared<const models::ProjectionProgram>(
        values.loaded->model, models::program_parameters(values), unit_plane());
    check_field(r, lens, "filename", r.client_state.camera.fov_x_rad, r.client_state.camera.fov_y_rad);
    r.client_state.camera.lens = std::move(lens);
}

void load_projection(Request& r) {
    const std::string& file = r.arguments.text("filename");
    if (file.ends_with(".prj"))
        if (const auto own = r.client_state.files.find(file)) return load_own_projection(r, *own);
    const auto projection =
        file.empty() ? scene::Projection::pinhole : enum_named<scene::Projection>(model_name(file));
    if (!projection || *projection == scene::Projection::model) {
        std::vector<std::string_view> names = names_of_enum<scene::Projection>();
        std::erase(names, name_of(scene::Projection::model));
        throw r.arguments.refused(
            "filename", fmt::format("\"{}\" is neither a file nor a built-in model", printable(file, 60)),
            fmt::format("files that end in .prj, and {}, with any ending", fmt::join(names, ", ")));
    }
    PictureLens lens{*projection, {}};
    Parameters parameters(r);
    constexpr std::array names{"k1", "k2", "k3", "p1", "p2"};
    for (std::size_t i = 0; i < names.size(); ++i)
        lens.distortion[i] = parameters.number(names[i], 0, -1e6, 1e6);
    parameters.check_rest();
    const double half_rad = std::max(r.client_state.camera.fov_x_rad, r.client_state.camera.fov_y_rad) / 2;
    if (half_rad >= lens.max_angle_rad())
        throw r.arguments.refused("filename",
                                  fmt::format("the field of view of {} rad is too wide for it", 2 * half_rad),
                                  fmt::format("less than {} rad", 2 * lens.max_angle_rad()));
    r.client_state.camera.lens = lens;
}

void set_focus(Request& r) {
    // Whether cameras that look along -z have negative distances is not known.
    const double focus_m = std::abs(r.arguments.number("focus_plane_Z", -1e12, 1e12));
    const double radius_m = r.arguments.number("pupil_radius", 0, 100);
    const bool sharp = focus_m == 0 || radius_m == 0;
    r.client_state.camera.focus_m = sharp ? 0 : focus_m;
    r.client_state.camera.pupil_radius_m = sharp ? 0 : radius_m;
}

void load_motion(Request& r) {
    const std::string& file = r.arguments.text("filename");
    Parameters parameters(r);
    parameters.check_rest();
    if (file.empty()) return r.client_state.camera.motion.clear();
    if (!file.ends_with(".csv"))
        throw r.arguments.refused("filename",
                                  fmt::format("\"{}\": model files are not read", printable(file, 60)),
                                  fmt::format("a table .csv of {}", scene::trajectory_columns));
    r.client_state.camera.motion = scene::read_trajectory(r.client_state.files.existing(file)).samples;
}

/// Times of rows or pixels in SuMoL.
void load_own_timing(Request& r, const std::filesystem::path& file) {
    Parameters parameters(r);
    nlohmann::json table = table_of_model(r, file, "timing", "times in SuMoL", parameters);
    parameters.check_rest();
    const models::ModelValues values = values_of(table, file, "timing");
    CameraSettings& camera = r.client_state.camera;
    try {
        camera.timing = std::make_shared<const models::TimingProgram>(values.loaded->model,
                                                                      models::program_parameters(values));
    } catch (const Error& error) {
        throw r.arguments.refused("filename", r.client_state.files.without_folders(error.what()),
                                  "times in SuMoL");
    }
    camera.shutter = std::move(table);
    camera.line_s = 0;
}

void load_time_sampling(Request& r) {
    const std::string& file = r.arguments.text("filename");
    if (file.ends_with(".tim"))
        if (const auto own = r.client_state.files.find(file)) return load_own_timing(r, *own);
    const std::string name = model_name(file);
    Parameters parameters(r);
    double line_s = 0;
    if (name == "rolling_shutter")
        line_s = parameters.number("line_addressing_time", 0, 0, 1e3);
    else if (!file.empty() && name != "global_shutter")
        throw r.arguments.refused(
            "filename", fmt::format("\"{}\" is neither a file nor a built-in model", printable(file, 60)),
            "files that end in .tim, and global_shutter, rolling_shutter, with any ending");
    parameters.check_rest();
    r.client_state.camera.line_s = line_s;
    r.client_state.camera.timing = nullptr;
}

void load_spectrum(Request& r) {
    const std::string& file = r.arguments.text("filename");
    if (file.empty()) {
        r.client_state.bands = usual_bands;
        return;
    }
    if (model_name(file) != "bands")
        throw r.arguments.refused(
            "filename",
            fmt::format("\"{}\" is no built-in model, and model files are not read", printable(file, 60)),
            "bands, with any ending");
    Parameters parameters(r);
    std::array<std::vector<double>, 2> edges;
    for (const auto& [name, numbers] : {std::pair{"from", &edges[0]}, std::pair{"to", &edges[1]}}) {
        const Value* const value = parameters.value(name);
        if (value == nullptr || !to_numbers(*value, *numbers) || numbers->size() != channels)
            throw r.arguments.refused("parameters", name, "4 wavelengths in m");
    }
    std::array<ChannelBand, channels> bands{};
    for (std::size_t c = 0; c < channels; ++c) {
        bands[c] = {edges[0][c] * 1e9, edges[1][c] * 1e9};
        if (!(bands[c].from_nm >= 200 && bands[c].to_nm <= 4000 && bands[c].to_nm - bands[c].from_nm >= 1))
            throw r.arguments.refused("parameters", fmt::format("from {} to {} m", edges[0][c], edges[1][c]),
                                      "200e-9 to 4000e-9 m, at least 1e-9 m wide");
    }
    parameters.check_rest();
    r.client_state.bands = bands;
}

} // namespace

void add_lens_calls(Handlers& handlers) {
    handlers["loadProjectionModel"] = load_projection;
    handlers["setFocus"] = set_focus;
    handlers["loadMotionModel"] = load_motion;
    handlers["loadTimeSamplingModel"] = load_time_sampling;
    handlers["loadSpectrumModel"] = load_spectrum;
}

} // namespace obscura::serve::compatible
