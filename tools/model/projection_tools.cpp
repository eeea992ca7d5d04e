// SPDX-License-Identifier: Apache-2.0
#include "tools/model/projection_tools.hpp"

#include "core/error.hpp"
#include "core/units.hpp"
#include "images/writers/raw.hpp"
#include "models/kinds/projection_checks.hpp"
#include "renderer/camera/lens.hpp"
#include "renderer/camera/model_projection.hpp"
#include "renderer/camera/pinhole.hpp"
#include "tools/model/projection_pictures.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

namespace obscura::tools {
namespace {

constexpr std::string_view new_projection = R"(// {0}: the projection of a lens in SuMoL.
//
//   obscura model check {0}.prj            is it one to one?
//   obscura model plot {0}.prj -o {0}.png  what does it see?
//
// In a scene file, beside it:
//   [camera]
//   projection = {{ model = "{0}.prj", k1 = -0.1 }}

// The camera that `obscura model` shows it with; a scene has its own.
property width 1024;
property height 1024;
property pixel_pitch_um 10;
property focal_length_mm 8;

// A parameter is a key of the scene. Its comment gives unit, range and meaning. With the unit deg the key is called
// max_angle_deg, and the text sees radians.
parameter k1 -0.05;     //! , -1..1, Distortion, of the square of the angle
parameter max_angle 80; //! deg, 1..180, Angle to the boresight beyond which nothing is seen

// Where the light of a direction falls, in metres from the optical axis: x to the right, y down.
//   d             unit vector in the camera's frame: x right, y down, z boresight
//   focal_length  of the camera, in metres
//   vec2(M_NAN)   for what is not seen: no two directions may fall on the same point
// The inverse is found by Newton's steps; where there is a formula for it, write
//   vec3 ray(vec2 p)   the direction, of any length, that a point of the focal plane sees
// beside point() or instead of it.
vec2 point(vec3 d)
{{
    scalar across = max(length(d.xy), 1e-300); // not 0: it is a divisor
    scalar t = atan2(across, d.z);
    if (t > max_angle) return vec2(M_NAN);
    return d.xy * (focal_length * t * (1 + k1 * t * t) / across);
}}

// Share of the light from a direction that arrives; without this function, all of it.
scalar transmission(vec3 d)
{{
    return max(0, d.z);
}}
)";

/// The camera that a model names by its properties.
scene::Camera shown_camera(const models::ModelValues& p) {
    const models::Model& model = *p.loaded->model;
    scene::Camera camera;
    camera.width = static_cast<std::int32_t>(property_of(model, "width", 1024, 16, 65536));
    camera.height = static_cast<std::int32_t>(property_of(model, "height", 1024, 16, 65536));
    camera.pixel_pitch_m = 1e-6 * property_of(model, "pixel_pitch_um", 10, 0.1, 1000);
    camera.focal_length_m = 1e-3 * property_of(model, "focal_length_mm", 10, 0.1, 1e6);
    camera.projection = scene::Projection::model;
    camera.own_projection = p;
    return camera;
}

std::string sensor_text(const models::SensorPlane& plane) {
    return fmt::format("{} x {} px of {:g} um, {:g} mm", plane.width, plane.height,
                       std::hypot(plane.column_m[0], plane.column_m[1]) * 1e6, plane.focal_length_m * 1e3);
}

/// Function and operations: "ray() in 64 operations", or "point() inverted by 3 Newton's steps in 500".
std::string way_text(const models::ProjectionProgram& projection, bool ray) {
    const models::BoundProgram& program = ray ? projection.ray_program() : projection.point_program();
    const bool own = projection.model().function(ray ? "ray" : "point") != nullptr;
    return own ? fmt::format("{}() of the text, {} operations", ray ? "ray" : "point",
                             program.program->cost())
               : fmt::format("{}() inverted by {} Newton's steps, {} operations", ray ? "point" : "ray",
                             projection.newton_steps(), program.program->cost());
}

ModelCost projection_cost(const models::ModelValues& p) {
    const models::ProjectionProgram projection = renderer::projection_program(shown_camera(p));
    const models::BoundProgram& rays = projection.ray_program();
    ModelCost cost = cost_of(*rays.program, rays.why_interpreted);
    cost.facts = {{"rays", way_text(projection, true), "rays", way_text(projection, true)},
                  {"points", way_text(projection, false), "points", way_text(projection, false)},
                  {"newton", fmt::format("{} steps", projection.newton_steps()), "newton_steps",
                   projection.newton_steps()},
                  {"shown with", sensor_text(projection.plane()), "camera", sensor_text(projection.plane())}};
    return cost;
}

ModelVerdict check_projection(const models::ModelValues& p) {
    const models::ProjectionProgram projection = renderer::projection_program(shown_camera(p));
    const models::ProjectionReport report = models::report_on(projection);
    const models::Function* const main =
        p.loaded->model->function(p.loaded->model->function("point") != nullptr ? "point" : "ray");
    return {
        main->at, models::refusal_by(report), models::warnings_by(report),
        fmt::format(
            "{} operations a ray, sees {:.0f} % of {}, up to {:.1f} deg from the boresight, round trip {:.1g} px",
            projection.ray_program().program->cost(), report.seen_share * 100,
            sensor_text(projection.plane()), report.field_deg, report.round_trip_px)};
}

ModelFacts eval_projection(const models::ModelValues& p, const ModelPoint& at) {
    const models::ProjectionProgram projection = renderer::projection_program(shown_camera(p));
    const models::SensorPlane& plane = projection.plane();
    const double x = (plane.width - 1) / 2.0 + at.at("right"), y = (plane.height - 1) / 2.0 + at.at("down");
    const ProjectedPoints point(projection, {x}, {y});
    ModelFacts facts{{"pixel", fmt::format("({:g}, {:g})", x, y), "pixel", {x, y}}};
    if (!point.sees(0)) {
        facts.push_back({"direction", "none", "direction", nullptr});
        return facts;
    }
    const std::array<std::vector<double>, 3> rows{
        std::vector<double>(models::Program::lane_step, point.dx[0]),
        std::vector<double>(models::Program::lane_step, point.dy[0]),
        std::vector<double>(models::Program::lane_step, point.dz[0])};
    std::vector<double> fraction(models::Program::lane_step);
    projection.transmission({rows[0].data(), rows[1].data(), rows[2].data()}, fraction.data(),
                            fraction.size());
    const double solid_angle = std::fabs(point.solid_angle[0]);
    facts.push_back({"direction",
                     fmt::format("({:.15g}, {:.15g}, {:.15g})", point.dx[0], point.dy[0], point.dz[0]),
                     "direction",
                     {point.dx[0], point.dy[0], point.dz[0]}});
    facts.push_back(
        {"to the boresight", fmt::format("{:.9g} deg", point.angle_deg(0)), "angle_deg", point.angle_deg(0)});
    facts.push_back({"solid angle", fmt::format("{:.12g} sr", solid_angle), "solid_angle_sr", solid_angle});
    facts.push_back({"transmission", fmt::format("{:.12g}", fraction[0]), "transmission", fraction[0]});
    facts.push_back(
        {"residual", fmt::format("{:.2g} px", point.residual_px[0]), "residual_px", point.residual_px[0]});
    return facts;
}

void plot_projection(const models::ModelValues& p, std::string_view title,
                     const std::filesystem::path& file) {
    const models::ProjectionProgram projection = renderer::projection_program(shown_camera(p));
    if (file.extension() == ".png")
        projection_maps(projection).write(file);
    else if (file.extension() == ".svg")
        images::write_text(file, projection_svg(projection, title));
    else
        images::write_text(file, projection_csv(projection));
}

double ray_nanoseconds(const renderer::Projection& projection, const scene::Camera& camera) {
    constexpr int packets = 256;
    double sum = 0;
    const double ns = nanoseconds_a_sample(packets * renderer::packet_size, [&] {
        for (int k = 0; k < packets; ++k) {
            renderer::Doubles x, y, weight;
            renderer::Vec3s direction;
            for (int i = 0; i < renderer::packet_size; ++i) {
                x[i] = std::fmod(k * 37.0 + 2 * i, camera.width);
                y[i] = camera.height * (k + 0.5) / packets;
            }
            projection.rays(x, y, direction, weight);
            sum += weight[0];
        }
    });
    volatile double sink = sum;
    (void)sink;
    return ns;
}

ModelFacts bench_projection(const models::ModelValues& p) {
    const auto fact = [](std::string label, std::string name, double ns) {
        return ModelFact{std::move(label), fmt::format("{:8.2f}", ns), std::move(name), ns};
    };
    const scene::Camera own = shown_camera(p);
    ModelFacts facts{fact("", "model_ns", ray_nanoseconds(renderer::ModelProjection(own), own))};
    scene::Camera camera = own;
    camera.own_projection = {};
    // A field that all of them have.
    camera.focal_length_m = camera.pixel_pitch_m * std::max(camera.width, camera.height);
    camera.projection = scene::Projection::pinhole;
    facts.push_back(fact("built-in pinhole", "pinhole", ray_nanoseconds(renderer::Pinhole(camera), camera)));
    camera.distortion = {scene::Distortion::Model::opencv, {-0.1, 0.01, 1e-4, 1e-4}, {}, {}};
    facts.push_back(
        fact("built-in pinhole, opencv", "opencv", ray_nanoseconds(renderer::Lens(camera), camera)));
    camera.projection = scene::Projection::equidistant;
    camera.distortion = {scene::Distortion::Model::radial, {-0.02, 0.003}, {}, {}};
    facts.push_back(
        fact("built-in equidistant, radial", "radial", ray_nanoseconds(renderer::Lens(camera), camera)));
    return facts;
}

} // namespace

const KindTools& projection_tools() {
    static const KindTools tools{
        "projection",
        new_projection,
        projection_cost,
        check_projection,
        {{"right", "px", "Image point from the middle of the sensor", 0, -65536, 65536},
         {"down", "px", "Image point from the middle of the sensor", 0, -65536, 65536}},
        eval_projection,
        {{".png",
          "the sensor with lines of equal angles to the boresight, and the angle that each pixel subtends"},
         {".svg",
          "the same lines; the angle of a pixel and the residual of the inverse over the angle to the boresight"},
         {".csv", "a table of directions, solid angles and residuals"}},
        plot_projection,
        bench_projection};
    return tools;
}

} // namespace obscura::tools
