#include "renderer/materials/material.hpp"

#include "core/error.hpp"
#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/hemisphere.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/lunar_lambert.hpp"
#include "renderer/materials/minnaert.hpp"
#include "renderer/materials/mirror.hpp"
#include "renderer/materials/oren_nayar.hpp"
#include "renderer/materials/phong.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Throws unless least <= value <= most; NaN is outside.
void check(const std::string& place, const char* key, double value, double least, double most) {
    if (!(value >= least && value <= most))
        throw ConfigError(fmt::format("{}: {} {}: allowed {} to {}", place, key, value, least, most));
}

/// Checks a description and makes its law.
struct Maker {
    const std::string& place;

    std::unique_ptr<Material> operator()(const scene::Lambert& d) const {
        check(place, "albedo", d.albedo, 0, 1);
        return std::make_unique<Lambert>(d);
    }
    std::unique_ptr<Material> operator()(const scene::LommelSeeliger& d) const {
        check(place, "albedo", d.albedo, 0, 1);
        return std::make_unique<LommelSeeliger>(d);
    }
    std::unique_ptr<Material> operator()(const scene::LunarLambert& d) const {
        check(place, "albedo", d.albedo, 0, 1);
        for (const double w : d.weight)
            check(place, "weight", w, -1e6, 1e6);
        return std::make_unique<LunarLambert>(d);
    }
    std::unique_ptr<Material> operator()(const scene::Minnaert& d) const {
        check(place, "exponent", d.exponent, 0.3, 2);
        // Its Bond albedo is 4 A / (k + 1)^2.
        check(place, "albedo", d.albedo, 0, std::fmin(1.0, (d.exponent + 1) * (d.exponent + 1) / 4));
        return std::make_unique<Minnaert>(d);
    }
    std::unique_ptr<Material> operator()(const scene::OrenNayar& d) const {
        check(place, "albedo", d.albedo, 0, 1);
        check(place, "slope", d.slope_rad, 0, 1);
        return std::make_unique<OrenNayar>(d);
    }
    std::unique_ptr<Material> operator()(const scene::Phong& d) const {
        check(place, "diffuse", d.diffuse, 0, 1);
        check(place, "specular", d.specular, 0, 1 - d.diffuse);
        check(place, "exponent", d.exponent, 0, 1e5);
        return std::make_unique<Phong>(d);
    }
    std::unique_ptr<Material> operator()(const scene::Hapke& d) const {
        check(place, "single_scattering_albedo", d.single_scattering_albedo, 0, 0.9999);
        check(place, "phase_b", d.phase_b, 0, 0.95);
        check(place, "phase_c", d.phase_c, -1, 1);
        check(place, "shadow_hiding_b0", d.shadow_hiding_b0, 0, 10);
        check(place, "shadow_hiding_h", d.shadow_hiding_h, 1e-6, 10);
        check(place, "backscatter_b0", d.backscatter_b0, 0, 10);
        check(place, "backscatter_h", d.backscatter_h, 1e-6, 10);
        check(place, "roughness", d.roughness_rad, 0, std::numbers::pi / 4);
        check(place, "filling_factor", d.filling_factor, 0, 0.74);
        return std::make_unique<Hapke>(d);
    }
    std::unique_ptr<Material> operator()(const scene::Ggx& d) const {
        check(place, "roughness", d.roughness, 0, 1);
        check(place, "reflectance_f0", d.reflectance_f0, 0, 1);
        check(place, "base_albedo", d.base_albedo, 0, 1);
        return std::make_unique<Ggx>(d);
    }
    /// The colours come with the body's SurfaceTextures.
    std::unique_ptr<Material> operator()(const scene::FileMaterials& /*d*/) const {
        return std::make_unique<Lambert>(scene::Lambert{1});
    }
    std::unique_ptr<Material> operator()(const scene::Mirror& d) const {
        check(place, "reflectance", d.reflectance, 0, 1);
        return std::make_unique<Mirror>(d);
    }
};

} // namespace

Vec3 Material::sample(Vec3 /*out*/, double u, double v) const {
    return cosine_hemisphere(u, v);
}

double Material::pdf(Vec3 /*out*/, Vec3 in) const {
    return in.z > 0 ? in.z * std::numbers::inv_pi : 0.0;
}

std::unique_ptr<Material> make_material(const scene::Material& description, const std::string& place) {
    return std::visit(Maker{place}, description);
}

} // namespace obscura::renderer
