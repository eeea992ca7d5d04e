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
    return {config::key("radii_m", &s.radii_m).unit("m").range(1e-6, 1e12).help("Its three radii")};
}
config::Keys mesh(scene::MeshFile& s) {
    return {
        config::key("file", config::Path{&s.path})
            .help("OBJ, STL, PLY, 3DS, Collada, glTF, or PDS plate model (.tab, .plt)"),
        config::key("metres_per_unit", &s.metres_per_unit)
            .unit("m")
            .range(1e-9, 1e12)
            .help("Length of the file's unit"),
        config::key("smooth_normals", &s.smooth_normals)
            .help("The file's normals, else interpolated; false: flat facets"),
    };
}
config::Keys procedural(scene::ProceduralBody& s) {
    return {
        config::key("mean_radius_m", &s.mean_radius_m).unit("m").range(1e-3, 1e9).help("Mean radius"),
        config::key("axis_ratios", &s.axis_ratios).range(0.1, 10).help("Proportions of the axes"),
        config::key("seed", &s.seed).range(0, 9e15).help("Same seed, same body"),
        config::key("subdivisions", &s.subdivisions).range(0, 9).help("20 * 4^n facets"),
    };
}

config::Keys polygons(scene::Polygons& s) {
    return {config::key("faces_m", config::Faces{&s.faces_m})
                .unit("m")
                .range(-1e12, 1e12)
                .help("Flat convex faces, corners counter-clockwise seen from outside")};
}

config::Keys box(scene::Box& s) {
    return {config::key("size_m", &s.size_m).unit("m").range(1e-6, 1e12).help("Its three edges")};
}
config::Keys disc(scene::Disc& s) {
    return {
        config::key("radius_m", &s.radius_m).unit("m").range(1e-6, 1e12).help("Outer radius"),
        config::key("inner_radius_m", &s.inner_radius_m)
            .unit("m")
            .range(0, 1e12)
            .help("Radius of the hole; 0: none"),
    };
}
config::Keys cone(scene::Cone& s) {
    return {
        config::key("bottom_radius_m", &s.bottom_radius_m)
            .unit("m")
            .range(0, 1e12)
            .help("Radius at the lower end"),
        config::key("top_radius_m", &s.top_radius_m).unit("m").range(0, 1e12).help("Radius at the upper end"),
        config::key("height_m", &s.height_m)
            .unit("m")
            .range(1e-6, 1e12)
            .help("Length along z, its middle at the origin"),
    };
}

config::Keys lambert(scene::Lambert& m) {
    return {config::key("albedo", &m.albedo).range(0, 1).help("Hemispherical reflectance")};
}
config::Keys lommel_seeliger(scene::LommelSeeliger& m) {
    return {config::key("albedo", &m.albedo).range(0, 1).help("Single-scattering albedo")};
}
config::Keys lunar_lambert(scene::LunarLambert& m) {
    return {
        config::key("albedo", &m.albedo).range(0, 1).help("Albedo"),
        config::key("weight", config::Numbers{m.weight.data(), m.weight.size()})
            .range(-1e6, 1e6)
            .help("L(g): coefficients of the phase angle in degrees, constant term first (McEwen); the "
                  "Moon's by default"),
    };
}
config::Keys minnaert(scene::Minnaert& m) {
    return {
        config::key("albedo", &m.albedo).range(0, 1).help("Albedo"),
        config::key("exponent", &m.exponent).range(0.3, 2).help("k"),
    };
}
config::Keys oren_nayar(scene::OrenNayar& m) {
    return {
        config::key("albedo", &m.albedo).range(0, 1).help("Albedo of the facets"),
        config::key("slope_deg", config::Scaled{&m.slope_rad, degree})
            .unit("deg")
            .range(0, 57)
            .help("Standard deviation of the facets' slopes"),
    };
}
config::Keys phong(scene::Phong& m) {
    return {
        config::key("diffuse", &m.diffuse).range(0, 1).help("Diffuse reflectance; diffuse + specular <= 1"),
        config::key("specular", &m.specular).range(0, 1).help("Specular reflectance"),
        config::key("exponent", &m.exponent).range(0, 1e5).help("Sharpness of the highlight"),
    };
}
config::Keys hapke(scene::Hapke& m) {
    return {
        config::key("single_scattering_albedo", &m.single_scattering_albedo).range(0, 0.9999).help("w"),
        config::key("phase_b", &m.phase_b)
            .range(0, 0.95)
            .help("Width of the two-lobed Henyey-Greenstein function"),
        config::key("phase_c", &m.phase_c).range(-1, 1).help("Its balance; 1: all backwards"),
        config::key("shadow_hiding_b0", &m.shadow_hiding_b0)
            .range(0, 10)
            .help("Strength of the shadow-hiding surge; 0: none"),
        config::key("shadow_hiding_h", &m.shadow_hiding_h).range(1e-6, 10).help("Its width"),
        config::key("backscatter_b0", &m.backscatter_b0)
            .range(0, 10)
            .help("Strength of the coherent backscatter; 0: none"),
        config::key("backscatter_h", &m.backscatter_h).range(1e-6, 10).help("Its width"),
        config::key("roughness_deg", config::Scaled{&m.roughness_rad, degree})
            .unit("deg")
            .range(0, 45)
            .help("Mean slope angle, theta-bar"),
        config::key("filling_factor", &m.filling_factor)
            .range(0, 0.74)
            .help("phi; 0: no porosity correction"),
    };
}
config::Keys ggx(scene::Ggx& m) {
    return {
        config::key("roughness", &m.roughness).range(0, 1).help("Perceptual; alpha is its square"),
        config::key("reflectance_f0", &m.reflectance_f0).range(0, 1).help("Reflectance at normal incidence"),
        config::key("base_albedo", &m.base_albedo).range(0, 1).help("Of the diffuse base; 0 for metals"),
    };
}
config::Keys mirror(scene::Mirror& m) {
    return {config::key("reflectance", &m.reflectance)
                .range(0, 1)
                .help("Seen only where light may bounce: max_bounces")};
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
