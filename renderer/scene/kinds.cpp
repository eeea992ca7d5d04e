#include "renderer/scene/kinds.hpp"

#include "renderer/materials/presets.hpp"

#include <numbers>

namespace obscura::scene {
namespace {

constexpr double degree = std::numbers::pi / 180;

template<typename Variant, typename Alternative>
Variant make() {
    return Alternative{};
}
/// Keys of one alternative as keys of the variant that holds it.
template<typename Variant, typename Alternative, config::Keys (*keys)(Alternative&)>
config::Keys keys_in(Variant& variant) {
    return keys(std::get<Alternative>(variant));
}
template<typename Alternative, config::Keys (*keys)(Alternative&)>
Kind<scene::Shape> shape(std::string_view name, std::vector<std::string_view> required = {}) {
    return {name, make<scene::Shape, Alternative>, keys_in<scene::Shape, Alternative, keys>,
            std::move(required)};
}
template<typename Alternative, config::Keys (*keys)(Alternative&)>
Kind<scene::Material> material(std::string_view name, std::vector<std::string_view> required = {}) {
    return {name, make<scene::Material, Alternative>, keys_in<scene::Material, Alternative, keys>,
            std::move(required)};
}

template<typename Alternative, config::Keys (*keys)(Alternative&)>
Kind<scene::Material> named(std::string_view name, scene::Material (*made)()) {
    return {name, made, keys_in<scene::Material, Alternative, keys>, {}};
}

config::Keys ellipsoid(scene::Ellipsoid& s) {
    return {{"radii_m", &s.radii_m, "m", {1e-6, 1e12}, {}, "Its three radii"}};
}
config::Keys mesh(scene::MeshFile& s) {
    return {
        {"file",
         config::Path{&s.path},
         {},
         {},
         {},
         "OBJ, STL, PLY, 3DS, Collada, glTF, or PDS plate model (.tab, .plt)"},
        {"metres_per_unit", &s.metres_per_unit, "m", {1e-9, 1e12}, {}, "Length of the file's unit"},
        {"smooth_normals",
         &s.smooth_normals,
         {},
         {},
         {},
         "The file's normals, else interpolated; false: flat facets"},
    };
}
config::Keys procedural(scene::ProceduralBody& s) {
    return {
        {"mean_radius_m", &s.mean_radius_m, "m", {1e-3, 1e9}, {}, "Mean radius"},
        {"axis_ratios", &s.axis_ratios, {}, {0.1, 10}, {}, "Proportions of the axes"},
        {"seed", &s.seed, {}, {0, 9e15}, {}, "Same seed, same body"},
        {"subdivisions", &s.subdivisions, {}, {0, 9}, {}, "20 * 4^n facets"},
    };
}

config::Keys polygons(scene::Polygons& s) {
    return {{"faces_m",
             config::Faces{&s.faces_m},
             "m",
             {-1e12, 1e12},
             {},
             "Flat convex faces, corners counter-clockwise seen from outside"}};
}

config::Keys box(scene::Box& s) {
    return {{"size_m", &s.size_m, "m", {1e-6, 1e12}, {}, "Its three edges"}};
}
config::Keys disc(scene::Disc& s) {
    return {
        {"radius_m", &s.radius_m, "m", {1e-6, 1e12}, {}, "Outer radius"},
        {"inner_radius_m", &s.inner_radius_m, "m", {0, 1e12}, {}, "Radius of the hole; 0: none"},
    };
}
config::Keys cone(scene::Cone& s) {
    return {
        {"bottom_radius_m", &s.bottom_radius_m, "m", {0, 1e12}, {}, "Radius at the lower end"},
        {"top_radius_m", &s.top_radius_m, "m", {0, 1e12}, {}, "Radius at the upper end"},
        {"height_m", &s.height_m, "m", {1e-6, 1e12}, {}, "Length along z, its middle at the origin"},
    };
}

config::Keys lambert(scene::Lambert& m) {
    return {{"albedo", &m.albedo, {}, {0, 1}, {}, "Hemispherical reflectance"}};
}
config::Keys lommel_seeliger(scene::LommelSeeliger& m) {
    return {{"albedo", &m.albedo, {}, {0, 1}, {}, "Single-scattering albedo"}};
}
config::Keys lunar_lambert(scene::LunarLambert& m) {
    return {
        {"albedo", &m.albedo, {}, {0, 1}, {}, "Albedo"},
        {"weight",
         config::Numbers{m.weight.data(), m.weight.size()},
         {},
         {-1e6, 1e6},
         {},
         "L(g): coefficients of the phase angle in degrees, constant term first (McEwen); the Moon's by "
         "default"},
    };
}
config::Keys minnaert(scene::Minnaert& m) {
    return {
        {"albedo", &m.albedo, {}, {0, 1}, {}, "Albedo"},
        {"exponent", &m.exponent, {}, {0.3, 2}, {}, "k"},
    };
}
config::Keys oren_nayar(scene::OrenNayar& m) {
    return {
        {"albedo", &m.albedo, {}, {0, 1}, {}, "Albedo of the facets"},
        {"slope_deg",
         config::Scaled{&m.slope_rad, degree},
         "deg",
         {0, 57},
         {},
         "Standard deviation of the facets' slopes"},
    };
}
config::Keys phong(scene::Phong& m) {
    return {
        {"diffuse", &m.diffuse, {}, {0, 1}, {}, "Diffuse reflectance; diffuse + specular <= 1"},
        {"specular", &m.specular, {}, {0, 1}, {}, "Specular reflectance"},
        {"exponent", &m.exponent, {}, {0, 1e5}, {}, "Sharpness of the highlight"},
    };
}
config::Keys hapke(scene::Hapke& m) {
    return {
        {"single_scattering_albedo", &m.single_scattering_albedo, {}, {0, 0.9999}, {}, "w"},
        {"phase_b", &m.phase_b, {}, {0, 0.95}, {}, "Width of the two-lobed Henyey-Greenstein function"},
        {"phase_c", &m.phase_c, {}, {-1, 1}, {}, "Its balance; 1: all backwards"},
        {"shadow_hiding_b0",
         &m.shadow_hiding_b0,
         {},
         {0, 10},
         {},
         "Strength of the shadow-hiding surge; 0: none"},
        {"shadow_hiding_h", &m.shadow_hiding_h, {}, {1e-6, 10}, {}, "Its width"},
        {"backscatter_b0",
         &m.backscatter_b0,
         {},
         {0, 10},
         {},
         "Strength of the coherent backscatter; 0: none"},
        {"backscatter_h", &m.backscatter_h, {}, {1e-6, 10}, {}, "Its width"},
        {"roughness_deg",
         config::Scaled{&m.roughness_rad, degree},
         "deg",
         {0, 45},
         {},
         "Mean slope angle, theta-bar"},
        {"filling_factor", &m.filling_factor, {}, {0, 0.74}, {}, "phi; 0: no porosity correction"},
    };
}
config::Keys ggx(scene::Ggx& m) {
    return {
        {"roughness", &m.roughness, {}, {0, 1}, {}, "Perceptual; alpha is its square"},
        {"reflectance_f0", &m.reflectance_f0, {}, {0, 1}, {}, "Reflectance at normal incidence"},
        {"base_albedo", &m.base_albedo, {}, {0, 1}, {}, "Of the diffuse base; 0 for metals"},
    };
}
config::Keys mirror(scene::Mirror& m) {
    return {{"reflectance", &m.reflectance, {}, {0, 1}, {}, "Seen only where light may bounce: max_bounces"}};
}

config::Keys file_materials(scene::FileMaterials& /*m*/) {
    return {};
}

} // namespace

const std::vector<Kind<scene::Shape>>& shape_kinds() {
    static const std::vector<Kind<scene::Shape>> table{
        shape<scene::Ellipsoid, ellipsoid>("ellipsoid", {"radii_m"}),
        shape<scene::MeshFile, mesh>("mesh", {"file"}),
        shape<scene::ProceduralBody, procedural>("procedural", {"mean_radius_m"}),
        shape<scene::Polygons, polygons>("polygons", {"faces_m"}),
        shape<scene::Box, box>("box", {"size_m"}),
        shape<scene::Disc, disc>("disc", {"radius_m"}),
        shape<scene::Cone, cone>("cone", {"bottom_radius_m", "top_radius_m", "height_m"}),
    };
    return table;
}

const std::vector<Kind<scene::Material>>& material_kinds() {
    static const std::vector<Kind<scene::Material>> table{
        material<scene::Lambert, lambert>("lambert", {"albedo"}),
        material<scene::LommelSeeliger, lommel_seeliger>("lommel-seeliger", {"albedo"}),
        material<scene::LunarLambert, lunar_lambert>("lunar-lambert", {"albedo"}),
        material<scene::Minnaert, minnaert>("minnaert", {"albedo"}),
        material<scene::OrenNayar, oren_nayar>("oren-nayar", {"albedo"}),
        material<scene::Phong, phong>("phong"),
        material<scene::Hapke, hapke>("hapke", {"single_scattering_albedo"}),
        material<scene::Ggx, ggx>("ggx"),
        material<scene::Mirror, mirror>("mirror"),
        material<scene::FileMaterials, file_materials>("file"),
        // Real ones by name, each with the keys of its law.
        named<scene::Hapke, hapke>("moon", moon),
        named<scene::Hapke, hapke>("eros", eros),
        named<scene::Hapke, hapke>("itokawa", itokawa),
        named<scene::Hapke, hapke>("67p", comet_67p),
        named<scene::Ggx, ggx>("mli", mli),
        named<scene::Ggx, ggx>("solar-cell", solar_cell),
        named<scene::Lambert, lambert>("white-paint", white_paint),
    };
    return table;
}

} // namespace obscura::scene
