#include "renderer/build.hpp"

#include "core/error.hpp"
#include "renderer/ellipsoid.hpp"
#include "renderer/mesh_shape.hpp"
#include "renderer/motion.hpp"
#include "renderer/obj_reader.hpp"
#include "renderer/procedural_body.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <optional>
#include <tuple>

namespace obscura::renderer {
namespace {

bool positive(double x) {
    return x > 0 && std::isfinite(x);
}

std::string name_of(const scene::Body& body) {
    return fmt::format("body '{}'", body.name);
}

/// Makes shapes; remembers meshes, so that bodies of the same file share one.
class ShapeMaker {
public:
    std::shared_ptr<const Shape> make(const scene::Body& body) {
        const std::string place = name_of(body);
        if (const auto* e = std::get_if<scene::Ellipsoid>(&body.shape)) {
            if (!positive(e->radii_m.x) || !positive(e->radii_m.y) || !positive(e->radii_m.z))
                throw ConfigError(fmt::format("{}: radii {} {} {} m: allowed are positive numbers", place,
                                              e->radii_m.x, e->radii_m.y, e->radii_m.z));
            return std::make_shared<Ellipsoid>(*e);
        }
        if (const auto* p = std::get_if<scene::ProceduralBody>(&body.shape)) {
            try {
                return mesh_shape(make_procedural_body(*p));
            } catch (const ConfigError& e) {
                throw ConfigError(fmt::format("{}: {}", place, e.what()));
            }
        }
        const auto& file = std::get<scene::MeshFile>(body.shape);
        if (!positive(file.metres_per_unit))
            throw ConfigError(fmt::format("{}: {} metres per unit: allowed are positive numbers", place,
                                          file.metres_per_unit));
        auto& shape = files_[{file.path, file.metres_per_unit, file.smooth_normals}];
        if (!shape) {
            TriangleMesh mesh = read_obj(file.path, file.metres_per_unit);
            if (file.smooth_normals) smooth_normals(mesh);
            shape = mesh_shape(std::move(mesh));
        }
        return shape;
    }

private:
    std::shared_ptr<const Shape> mesh_shape(TriangleMesh mesh) {
        if (!device_) device_ = std::make_shared<const EmbreeDevice>();
        return std::make_shared<MeshShape>(device_, std::move(mesh));
    }

    std::shared_ptr<const EmbreeDevice> device_;
    std::map<std::tuple<std::string, double, bool>, std::shared_ptr<const Shape>> files_;
};

} // namespace

void validate(const scene::Scene& scene) {
    const scene::Camera& c = scene.camera;
    constexpr std::int32_t largest = 65536;
    if (c.width < 1 || c.width > largest || c.height < 1 || c.height > largest)
        throw ConfigError(
            fmt::format("camera: {} x {} pixels: allowed 1 to {} each", c.width, c.height, largest));
    if (!positive(c.pixel_pitch_m) || !positive(c.focal_length_m))
        throw ConfigError(fmt::format("camera: pixel pitch {} m and focal length {} m: allowed are positive "
                                      "numbers",
                                      c.pixel_pitch_m, c.focal_length_m));
    if (!(c.psf_sigma_px >= 0 && c.psf_sigma_px <= 100))
        throw ConfigError(fmt::format("camera: PSF sigma {} px: allowed 0 to 100", c.psf_sigma_px));
    validate(c.motion, "camera");
    if (!is_finite(scene.sun.position_m) || !positive(scene.sun.radius_m))
        throw ConfigError("sun: the position must be finite and the radius positive");
    if (!(scene.sun.irradiance_scale >= 0 && std::isfinite(scene.sun.irradiance_scale)))
        throw ConfigError(fmt::format("sun: irradiance scale {}: allowed are numbers from 0 up",
                                      scene.sun.irradiance_scale));
    if (scene.bands.empty()) throw ConfigError("bands: none: at least one spectral band is wanted");
    for (std::size_t i = 0; i < scene.bands.size(); ++i)
        if (!(scene.bands[i].from_m > 0 && scene.bands[i].to_m > scene.bands[i].from_m &&
              std::isfinite(scene.bands[i].to_m)))
            throw ConfigError(fmt::format("bands: band {} from {} to {} m: allowed 0 < from < to", i + 1,
                                          scene.bands[i].from_m, scene.bands[i].to_m));
    for (const scene::Body& body : scene.bodies)
        validate(body.motion, name_of(body));
}

std::vector<BuiltBody> build_bodies(const scene::Scene& scene) {
    ShapeMaker shapes;
    std::vector<BuiltBody> built;
    for (const scene::Body& body : scene.bodies) {
        auto material = make_material(body.material, name_of(body));
        built.push_back({shapes.make(body), std::move(material), body.motion});
    }
    scene::Motion sun_motion;
    sun_motion.samples[0].pose.position_m = scene.sun.position_m;
    const double r = scene.sun.radius_m;
    built.push_back({std::make_shared<Ellipsoid>(scene::Ellipsoid{{r, r, r}}), nullptr, sun_motion});
    return built;
}

} // namespace obscura::renderer
