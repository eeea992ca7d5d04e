// SPDX-License-Identifier: Apache-2.0
// Commands that create models by name: BRDFs and shapes. Built-in ones stand for the model files of the
// published program, which are not public.
#include "tools/serve/compatible/handlers.hpp"
#include "tools/serve/compatible/objects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace obscura::tools::compatible {
namespace {

using nlohmann::json;
using service::compatible::Fields;
using service::compatible::find;

/// Parameters of a model. A bare value instead of a map stands for the one parameter that most have.
class Parameters {
public:
    Parameters(Request& r, std::string_view only) : r_(r), only_(only) {
        const Value& value = r.arguments.value("parameters");
        fields_ = value.as<Fields>();
        double number = 0;
        if (fields_ != nullptr || value.as<std::monostate>() != nullptr) return;
        if (const List* const list = value.as<List>(); list != nullptr && list->empty()) return;
        if (!to_number(value, number))
            throw r.arguments.refused("parameters", "are no map", "a map of names and numbers");
        bare_ = &value;
        r.reply.warn(fmt::format("parameters: a number is taken for {}", only));
    }

    [[nodiscard]] const Value* value(std::string_view name) {
        used_.emplace_back(name);
        if (bare_ != nullptr) return name == only_ ? bare_ : nullptr;
        return fields_ == nullptr ? nullptr : find(*fields_, name);
    }
    /// A number, of a vector its first.
    [[nodiscard]] double number(std::string_view name, double otherwise, double least, double most) {
        const Value* const found = value(name);
        if (found == nullptr) return otherwise;
        double got = 0;
        if (!to_number(*found, got) || !(got >= least && got <= most))
            throw r_.arguments.refused("parameters", std::string(name),
                                       fmt::format("a number from {} to {}", least, most));
        return got;
    }
    /// Numbers of the channels; a single one is that of all.
    [[nodiscard]] Channels channels_of(std::string_view name, double otherwise, double most) {
        Channels all{};
        all.fill(otherwise);
        const Value* const found = value(name);
        if (found == nullptr) return all;
        std::vector<double> got(1);
        if (to_number(*found, got[0]))
            got.resize(channels, got[0]);
        else if (!to_numbers(*found, got))
            got.clear();
        if (got.size() == 3) got.push_back((got[0] + got[1] + got[2]) / 3);
        if (got.size() != channels ||
            !std::all_of(got.begin(), got.end(), [&](double v) { return v >= 0 && v <= most; }))
            throw r_.arguments.refused("parameters", std::string(name),
                                       fmt::format("a number or {} of 0 to {}", channels, most));
        std::copy(got.begin(), got.end(), all.begin());
        return all;
    }
    /// Warns of parameters that nobody has asked for.
    void check_rest() const {
        if (fields_ == nullptr) return;
        for (const auto& [name, value] : *fields_)
            if (std::find(used_.begin(), used_.end(), name) == used_.end())
                r_.reply.warn(fmt::format("parameters: \"{}\" has no effect", config::printable(name, 60)));
    }

private:
    Request& r_;
    std::string_view only_;
    const Fields* fields_ = nullptr;
    const Value* bare_ = nullptr;
    std::vector<std::string> used_;
};

json list_of_numbers(const Channels& values) {
    return json(values);
}

/// The name of a model file without folders and the ending.
std::string model_name(const std::string& filename, std::string_view ending) {
    std::string name = filename.substr(filename.find_last_of('/') + 1);
    if (name.ends_with(ending)) name.resize(name.size() - ending.size());
    return name;
}

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
        "filename",
        fmt::format("\"{}\" is no built-in model, and model files are not read", config::printable(name, 60)),
        "mate.brdf, hapke.brdf, oren_nayar.brdf, phong.brdf, mirror.brdf, raw.brdf, sun.brdf");
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
        "filename",
        fmt::format("\"{}\" is no built-in model, and model files are not read", config::printable(name, 60)),
        "sphere.shp, spheroid.shp, ellipsoid.shp");
}

} // namespace

void add_model_calls(Handlers& handlers) {
    handlers["createBRDF"] = [](Request& r) {
        Parameters parameters(r, "albedo");
        Model model{reflection_of(r, model_name(r.arguments.text("filename"), ".brdf"), parameters)};
        parameters.check_rest();
        put(r.door.reflections, r.arguments, "name", std::move(model));
    };
    handlers["createShape"] = [](Request& r) {
        Parameters parameters(r, "radius");
        Model model = shape_of(r, model_name(r.arguments.text("filename"), ".shp"), parameters);
        parameters.check_rest();
        put(r.door.shapes, r.arguments, "name", std::move(model));
    };
}

} // namespace obscura::tools::compatible
