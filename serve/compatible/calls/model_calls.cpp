// SPDX-License-Identifier: Apache-2.0
// Commands that create models by name: BRDFs and shapes. They are files that a client has sent or that lie in
// the resource path; built-in ones stand for those of the published program, which are not public.
#include "core/text/printable.hpp"
#include "renderer/scene/model_texture.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/model_files.hpp"
#include "serve/compatible/objects.hpp"
#include "serve/compatible/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::serve::compatible {
namespace {

using nlohmann::json;

json list_of_numbers(const Channels& values) {
    return json(values);
}

/// The argument of a texture's functions that is an image, beside its parameters.
constexpr std::string_view own_image = scene::ModelTexture::own_image;

json reflection_of(Request& r, const std::string& name, Parameters& parameters) {
    const auto albedo = [&](double otherwise) { return parameters.channels_of("albedo", otherwise, 1); };
    if (name == "mate" || name == "lambert")
        return {{"material", "lambert"}, {"albedo", 1.0}, {"colour", list_of_numbers(albedo(1))}};
    if (name == "hapke") return {{"material", "moon"}, {"colour", list_of_numbers(albedo(1))}};
    if (name == "oren_nayar") {
        const double slope_deg = parameters.number("sigma", 0.3, 0, 1) * 180 / std::numbers::pi;
        return {{"material", "oren-nayar"},
                {"albedo", 1.0},
                {"slope_deg", std::min(slope_deg, 57.29)},
                {"colour", list_of_numbers(albedo(1))}};
    }
    if (name == "phong")
        return {{"material", "phong"},
                {"diffuse", parameters.number("diffuse", 0.5, 0, 1)},
                {"specular", parameters.number("specular", 0.5, 0, 1)},
                {"exponent", parameters.number("shininess", 20, 0, 1e5)}};
    if (name == "mirror")
        return {{"material", "mirror"}, {"reflectance", parameters.number("albedo", 1, 0, 1)}};
    // Textures as radiances, without any light.
    if (name == "raw" || name == "sun")
        return {{"material", "lambert"},
                {"albedo", 0.0},
                {"emission_w_m2_sr", list_of_numbers(parameters.channels_of("emission", 1, 1e15))}};
    throw r.arguments.refused(
        "filename", fmt::format("\"{}\" is neither a file nor a built-in model", printable(name, 60)),
        "files that end in .brdf, and mate.brdf, hapke.brdf, oren_nayar.brdf, phong.brdf, mirror.brdf, raw.brdf, sun.brdf");
}

/// A surface of a file; heights are over the ellipsoid of the parameter radii_m.
Model shape_of_file(Request& r, const std::filesystem::path& file, Parameters& parameters) {
    json table = table_of_model(r, file, "shape", "a shape in SuMoL", parameters);
    std::vector<double> radii_m;
    if (const Value* const value = parameters.value("radii_m"); value != nullptr) {
        if (!to_numbers(*value, radii_m) || radii_m.size() != 3)
            throw r.arguments.refused("parameters", "radii_m", "3 numbers");
        table["radii_m"] = radii_m;
    }
    return {{{"shape", std::move(table)}}};
}

Model shape_of(Request& r, const std::string& name, Parameters& parameters) {
    constexpr double least = 1e-6, most = 1e12;
    if (name == "sphere") {
        const double radius_m = parameters.number("radius", 1, least, most);
        return {{{"shape", "ellipsoid"}, {"radii_m", {radius_m, radius_m, radius_m}}}, radius_m};
    }
    if (name == "spheroid" || name == "ellipsoid") {
        const double all = parameters.number("radius", 1, least, most);
        double x = parameters.number("radius_x", parameters.number("a", all, least, most), least, most);
        double y = parameters.number("radius_y", parameters.number("b", x, least, most), least, most);
        double z = parameters.number(
            "radius_z",
            parameters.number("c", name == "spheroid" && parameters.value("b") != nullptr ? y : all, least,
                              most),
            least, most);
        if (name == "spheroid") {
            // Two radii: that of the equator and that of the poles.
            x = y = parameters.number("equatorial_radius", x, least, most);
            z = parameters.number("polar_radius", z, least, most);
        }
        return {{{"shape", "ellipsoid"}, {"radii_m", {x, y, z}}}, std::cbrt(x * y * z)};
    }
    throw r.arguments.refused(
        "filename", fmt::format("\"{}\" is neither a file nor a built-in model", printable(name, 60)),
        "files that end in .shp, and sphere.shp, spheroid.shp, ellipsoid.shp");
}

} // namespace

json texture_of_file(Request& r, const std::filesystem::path& file) {
    Parameters parameters(r);
    json table = table_of_model(r, file, "texture", "a texture in SuMoL", parameters);
    if (const Value* const image = parameters.value(own_image);
        image != nullptr && !table.contains(own_image)) {
        const auto* const name = image->as<std::string>();
        if (name == nullptr)
            throw r.arguments.refused("parameters", std::string(own_image), "the name of a texture");
        table[std::string(own_image)] = texture_key(r, *name);
    }
    parameters.check_rest();
    return table;
}

void add_model_calls(Handlers& handlers) {
    handlers["createBRDF"] = [](Request& r) {
        Parameters parameters(r, "albedo");
        const std::string& filename = r.arguments.text("filename");
        const auto file = r.client_state.files.find(filename);
        Model model{file ? json{{"material", table_of_model(r, *file, "material", "a scattering law in SuMoL",
                                                            parameters)}}
                         : reflection_of(r, model_name(filename), parameters)};
        parameters.check_rest();
        put(r.client_state.reflections, r.arguments, "name", std::move(model));
    };
    handlers["createShape"] = [](Request& r) {
        Parameters parameters(r, "radius");
        const std::string& filename = r.arguments.text("filename");
        const auto file = r.client_state.files.find(filename);
        Model model =
            file ? shape_of_file(r, *file, parameters) : shape_of(r, model_name(filename), parameters);
        parameters.check_rest();
        put(r.client_state.shapes, r.arguments, "name", std::move(model));
    };
}

} // namespace obscura::serve::compatible
