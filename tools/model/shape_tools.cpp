// SPDX-License-Identifier: Apache-2.0
#include "tools/model/shape_tools.hpp"

#include "core/units.hpp"
#include "images/writers/raw.hpp"
#include "models/kinds/shape_checks.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/model_shape.hpp"
#include "renderer/shapes/single_ray.hpp"
#include "tools/pictures/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::string_view new_shape = R"(// {0}: a shape in SuMoL.
//
//   obscura model check {0}.shp            is it sound?
//   obscura model plot {0}.shp -o {0}.png  what does it look like?
//
// In a scene file, beside it:
//   [[body]]
//   shape = {{ model = "{0}.shp", radius = 250 }}

// A parameter is a key of the scene. Its comment gives unit, range and meaning.
parameter radius 100;    //! m, 1e-3..1e9, Mean radius
parameter stretch 1.3;   //! , 0.5..2, Length along x over that along y and z
parameter depth 0.06;    //! , 0..0.2, Depth of the hollows in radii
parameter hollows 5;     //! , 0..50, Hollows around the body

// Radius of a ball about the origin that has the whole surface, m. Rays are followed within it.
scalar bound_radius()
{{
    return radius * max(stretch, 1) * (1 + depth) * 1.01;
}}

// Positive outside of the body, negative inside, 0 on its surface, m.
//   p  place in the frame of the body, m
// It need not be the distance: the bounds on its slope come of the text, so it must have a slope wherever the
// surface may be. A body that is a height over an ellipsoid has
//   scalar height(scalar longitude, scalar latitude)
// instead, and the scene gives radii_m = [...] beside the parameters.
scalar outside(vec3 p)
{{
    vec3 q = vec3(p.x / stretch, p.y, p.z);
    scalar waves = sin(hollows * q.x / radius) * sin(hollows * q.y / radius + 1) * sin(hollows * q.z / radius + 2);
    return length(q) - radius * (1 + depth * waves);
}}
)";

renderer::ModelShapeParameters parameters_of(const models::ModelValues& p) {
    renderer::ModelShapeParameters parameters{p};
    // Shown over a ball; a scene has its own.
    if (p.loaded->model->function("height") != nullptr) {
        constexpr double shown_radius_m = 1000;
        parameters.radii_m = {shown_radius_m, shown_radius_m, shown_radius_m};
    }
    return parameters;
}

ModelCost shape_cost(const models::ModelValues& p) {
    const auto program = shape_program(parameters_of(p));
    ModelCost cost = cost_of(program->program(), program->why_interpreted());
    cost.facts.push_back({"bound", fmt::format("{:.6g} m", program->bounding_radius_m()), "bound_radius_m",
                          program->bounding_radius_m()});
    const double claim = program->claimed_slope();
    cost.facts.push_back(
        {"slope",
         claim > 0 ? fmt::format("at most {:g}, by the property lipschitz", claim) : "bounded by cell",
         "lipschitz", claim > 0 ? nlohmann::json(claim) : nlohmann::json(nullptr)});
    cost.facts.push_back({"cells", fmt::format("{} with the surface", program->cells().surface_cells()),
                          "surface_cells", program->cells().surface_cells()});
    return cost;
}

ModelVerdict check_shape(const models::ModelValues& p) {
    const auto program = shape_program(parameters_of(p));
    const models::ShapeReport report = models::report_on(*program);
    return {
        program->place(), models::refusal_by(report, *program), models::warnings_by(report, *program),
        fmt::format("{} operations a point, {} cells with the surface within {:.6g} m of {:.6g} m, {:.1f} "
                    "points a ray in 16 lanes",
                    program->program().cost(), program->cells().surface_cells(), report.largest_m,
                    program->bounding_radius_m(), report.evaluations_a_ray)};
}

ModelFacts eval_shape(const models::ModelValues& p, const ModelPoint& at) {
    const auto program = shape_program(parameters_of(p));
    const std::array<double, 3> point{at.at("x"), at.at("y"), at.at("z")};
    renderer::Doubles value;
    renderer::Vec3s place, gradient;
    for (int i = 0; i < renderer::packet_size; ++i)
        place.set(i, {point[0], point[1], point[2]});
    program->run({place.x.v, place.y.v, place.z.v}, {value.v, gradient.x.v, gradient.y.v, gradient.z.v},
                 renderer::packet_size);
    const Vec3 g = gradient.lane(0);
    return {
        {"outside", fmt::format("{:.15g} m", value[0]), "outside_m", value[0]},
        {"gradient", fmt::format("({:.12g}, {:.12g}, {:.12g})", g.x, g.y, g.z), "gradient", {g.x, g.y, g.z}},
        {"slope", fmt::format("{:.12g}", length(g)), "slope", length(g)}};
}

/// Where a picture is taken from, and its x and y axes, unit vectors.
struct ShapeView {
    std::string title;
    Vec3 from, right, up;
};
ShapeView view_from(std::string title, Vec3 from, Vec3 up) {
    const Vec3 z = normalized(from), right = normalized(cross(up, z));
    return {std::move(title), z, right, cross(z, right)};
}

/// Parallel rays, lit from the upper left: grey Lambert with shadows.
Panel picture_of(const renderer::Shape& shape, const ShapeView& view) {
    constexpr int side = 208;
    const double reach = shape.bounding_radius_m() * 1.02;
    const Vec3 light = normalized(view.from - 0.9 * view.right + 0.8 * view.up);
    constexpr Rgb sky{18, 20, 26};
    Panel panel;
    panel.title = view.title;
    panel.width = panel.height = side;
    panel.pixels.assign(static_cast<std::size_t>(side) * side, sky);
    for (std::size_t first = 0; first < panel.pixels.size(); first += renderer::packet_size) {
        renderer::RayPacket rays;
        renderer::HitPacket hits;
        hits.clear();
        for (int i = 0; i < renderer::packet_size; ++i) {
            const auto pixel = static_cast<int>(first) + i;
            const double x = reach * (2.0 * (pixel % side + 0.5) / side - 1);
            const double y = reach * (1 - 2.0 * (pixel / side + 0.5) / side);
            rays.origin.set(i, 2 * reach * view.from + x * view.right + y * view.up);
            rays.direction.set(i, -view.from);
            rays.t_max[i] = renderer::no_hit;
            rays.active.on[i] = -1;
        }
        shape.intersect(rays, 0, hits);
        renderer::SurfacePacket surface;
        shape.surface(rays, hits, 0, surface);
        renderer::RayPacket shadow = rays;
        shadow.origin = surface.shadow_origin;
        for (int i = 0; i < renderer::packet_size; ++i) {
            shadow.direction.set(i, light);
            shadow.active.on[i] = hits.body[i] == 0 && dot(surface.normal.lane(i), light) > 0 ? -1 : 0;
        }
        shape.occlude(shadow);
        for (int i = 0; i < renderer::packet_size; ++i) {
            if (hits.body[i] != 0) continue;
            const double lit = shadow.active.on[i] != 0 ? dot(surface.normal.lane(i), light) : 0;
            const auto grey = static_cast<std::uint8_t>(
                std::lround(255 * std::pow(0.06 + 0.94 * std::max(0.0, lit), 1 / 2.2)));
            panel.pixels[first + static_cast<std::size_t>(i)] = {grey, grey, grey};
        }
    }
    return panel;
}

/// Distance of the surface from the origin by longitude and latitude, of the outermost point.
std::string radii_csv(const renderer::Shape& shape) {
    std::string text = "longitude_deg,latitude_deg,radius_m\n";
    const double far = 2 * shape.bounding_radius_m();
    for (int latitude = -90; latitude <= 90; latitude += 5)
        for (int longitude = -180; longitude < 180; longitude += 5) {
            const double c = std::cos(latitude * degree);
            const Vec3 u{c * std::cos(longitude * degree), c * std::sin(longitude * degree),
                         std::sin(latitude * degree)};
            const double t = renderer::distance_along(shape, far * u, -u);
            fmt::format_to(std::back_inserter(text), "{},{},{}\n", longitude, latitude,
                           t < far ? fmt::format("{:.17g}", far - t) : "");
        }
    return text;
}

void plot_shape(const models::ModelValues& p, std::string_view /*title*/, const std::filesystem::path& file) {
    const renderer::ModelShape shape(parameters_of(p));
    if (file.extension() == ".csv") {
        images::write_text(file, radii_csv(shape));
        return;
    }
    const Vec3 z{0, 0, 1};
    draw_panels({picture_of(shape, view_from("from +x", {1, 0, 0}, z)),
                 picture_of(shape, view_from("from +y", {0, 1, 0}, z)),
                 picture_of(shape, view_from("from +z", z, {0, 1, 0})),
                 picture_of(shape, view_from("from above", {0.8, -0.9, 0.7}, z))})
        .write(file);
}

double nanoseconds_a_ray(const renderer::Shape& shape, double reach_m) {
    constexpr int packets = 256;
    std::vector<renderer::RayPacket> rays(packets);
    for (int k = 0; k < packets; ++k)
        for (int i = 0; i < renderer::packet_size; ++i) {
            // Neighbouring pixels, as pictures ask for them.
            const double x = reach_m * (2.0 * (k % 16 * 16 + i) / 256 - 1);
            const double y = reach_m * (2.0 * (k / 16 + 0.5) / 16 - 1);
            rays[static_cast<std::size_t>(k)].origin.set(i, {x, y, 10 * reach_m});
            rays[static_cast<std::size_t>(k)].direction.set(i, {0, 0, -1});
            rays[static_cast<std::size_t>(k)].t_max[i] = renderer::no_hit;
            rays[static_cast<std::size_t>(k)].active.on[i] = -1;
        }
    double sum = 0;
    const double ns = nanoseconds_a_sample(packets * renderer::packet_size, [&] {
        for (const renderer::RayPacket& packet : rays) {
            renderer::HitPacket hits;
            hits.clear();
            shape.intersect(packet, 0, hits);
            sum += hits.t[0] < 1e300 ? hits.t[0] : 0;
        }
    });
    volatile double sink = sum;
    (void)sink;
    return ns;
}

ModelFacts bench_shape(const models::ModelValues& p) {
    const auto fact = [](std::string label, std::string name, double ns) {
        return ModelFact{std::move(label), fmt::format("{:8.2f}", ns), std::move(name), ns};
    };
    const renderer::ModelShape shape(parameters_of(p));
    const double r = shape.bounding_radius_m();
    const renderer::EllipsoidParameters ball{{r, r, r}};
    return {fact("", "model_ns", nanoseconds_a_ray(shape, r)),
            fact("built-in ellipsoid", "ellipsoid", nanoseconds_a_ray(renderer::Ellipsoid(ball), r))};
}

} // namespace

const KindTools& shape_tools() {
    constexpr double far = 1e12;
    static const KindTools tools{
        "shape",
        new_shape,
        shape_cost,
        check_shape,
        {{"x", "m", "Place in the frame of the body", 0, -far, far},
         {"y", "m", "Place in the frame of the body", 0, -far, far},
         {"z", "m", "Place in the frame of the body", 0, -far, far}},
        eval_shape,
        {{".png", "the body from +x, +y, +z and from above, of one grey with its shadows"},
         {".csv", "a table of the distance of the surface from the origin by longitude and latitude"}},
        plot_shape,
        bench_shape};
    return tools;
}

} // namespace obscura::tools
