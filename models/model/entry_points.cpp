// SPDX-License-Identifier: Apache-2.0
#include "models/model/entry_points.hpp"

#include "core/text/suggestion.hpp"
#include "models/model/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::models {
namespace {

EntryPoint brdf() {
    return {
        "brdf",
        Type::vec4,
        {{Type::vec3, "i"},
         {Type::vec3, "e"},
         {Type::vec3, "n"},
         {Type::vec4, "diffuse"},
         {Type::vec4, "specular"},
         {Type::scalar, "shininess"},
         {Type::scalar, "t"},
         {Type::scalar, "duration"},
         {Type::vec3, "uv"},
         {Type::scalar, "lod_bias"}},
        {6, 8, 10},
        true,
        "BRDF times the cosine of incidence, 1/sr, in each channel; i: to the light, e: to the camera, n: "
        "normal, all of unit length"};
}

EntryPoint emission() {
    return {"emission",
            Type::vec4,
            {{Type::vec3, "e"},
             {Type::vec3, "n"},
             {Type::vec4, "emission"},
             {Type::vec4, "diffuse"},
             {Type::vec4, "specular"},
             {Type::scalar, "shininess"},
             {Type::scalar, "t"},
             {Type::scalar, "duration"},
             {Type::vec2, "uv"},
             {Type::scalar, "lod_bias"}},
            {6, 8, 10},
            false,
            "Radiance that the surface emits, W m-2 sr-1, in each channel"};
}

EntryPoint density() {
    return {
        "density",
        Type::scalar,
        {{Type::vec2, "p"},
         {Type::scalar, "wavelength"},
         {Type::vec2, "field"},
         {Type::scalar, "pitch"},
         {Type::scalar, "f_number"}},
        {2, 3, 5},
        true,
        "Light of a point per square of the pitch, 1 in all; p: place from the point in pitches of the "
        "columns, x to the right, y down; wavelength: m; field: the point from the centre of the sensor, px; "
        "pitch: of the columns, m; f_number: focal length over aperture"};
}

EntryPoint lookup_2d() {
    return {
        "lookup2D",
        Type::vec4,
        {{Type::texture, "tex"}, {Type::vec2, "uv"}, {Type::scalar, "lod"}},
        {3},
        false,
        "Value of the texture at uv, 0 to 1, in each channel; vec4(M_NAN): no data; lod: level of detail, "
        "log2 of the sample's width in texels",
        true};
}

EntryPoint lookup_3d() {
    return {"lookup3D",
            Type::vec4,
            {{Type::texture, "tex"}, {Type::vec3, "los"}, {Type::scalar, "lod"}},
            {3},
            false,
            "The same in a direction from the centre of the body, in its frame, m: not of unit length",
            true};
}

EntryPoint texture_size() {
    return {"textureSize", Type::vec2, {}, {0}, false, "Width and height in texels, where no image has them"};
}

EntryPoint compute_3d_lod() {
    return {"compute3DLOD",
            Type::scalar,
            {{Type::texture, "tex"}, {Type::vec3, "xyz"}, {Type::scalar, "sample_size"}},
            {3},
            false,
            "Level of detail of lookup3D() for a sample of that width, m"};
}

EntryPoint projection_entry(std::string_view name, Type type, EntryArgument argument, bool one_of,
                            std::string_view help) {
    return {name, type, {argument}, {1}, false, help, one_of};
}

EntryPoint sensor_entry(std::string_view name, std::string_view value, std::string_view help) {
    return {name, Type::scalar, {{Type::scalar, value}, {Type::scalar, "x"}, {Type::scalar, "y"}}, {3}, false,
            help, true};
}

EntryPoint timing_entry(std::string_view name, std::string_view written, std::string_view help) {
    return {
        name,   Type::scalar, {{Type::scalar, "row"}, {Type::scalar, "column"}, {Type::scalar, "exposure"}},
        {2, 3}, true,         help,
        false,  written};
}

ModelKind timing_kind() {
    return {
        "timing",
        "timing model",
        ".tim",
        "Times at which rows or pixels are exposed.",
        {timing_entry("reset",
                      "scalar reset(scalar row, scalar exposure), or scalar reset(scalar row, scalar column, "
                      "scalar exposure)",
                      "Begin of the exposure of a row, or of a pixel, s after the trigger; row, column: of "
                      "what is read, from 0; exposure: as asked for, s"),
         timing_entry("read",
                      "scalar read(scalar row, scalar exposure), or scalar read(scalar row, scalar column, "
                      "scalar exposure)",
                      "End of it, by the same arguments")},
        {},
        {{Type::scalar, "rows"}, {Type::scalar, "columns"}}};
}

EntryPoint shape_entry(std::string_view name, std::vector<EntryArgument> arguments, bool one_of,
                       std::string_view help) {
    const std::size_t count = arguments.size();
    return {name, Type::scalar, std::move(arguments), {count}, false, help, one_of};
}

std::string signature(const EntryPoint& entry) {
    if (!entry.written.empty()) return std::string(entry.written);
    std::string text = fmt::format("{} {}(", name_of(entry.type), entry.name);
    for (std::size_t i = 0; i < entry.arguments.size(); ++i) {
        const bool opens = i > 0 && std::find(entry.stops.begin(), entry.stops.end(), i) != entry.stops.end();
        text += fmt::format("{}{}{} {}", opens ? " [" : "", i == 0 ? "" : ", ",
                            name_of(entry.arguments[i].type), entry.arguments[i].name);
    }
    text.append(static_cast<std::size_t>(entry.stops.size() - 1), ']');
    return text + ")";
}

} // namespace

const std::vector<ModelKind>& model_kinds() {
    static const std::vector<ModelKind> kinds{
        {"material",
         "material model",
         ".brdf",
         "Scattering law of a surface.",
         {brdf(), emission()},
         {{"lookup3DLOD", {Type::texture, Type::vec3, Type::scalar}, Type::vec4},
          {"lookup3DLOD", {Type::texture, Type::vec2, Type::scalar}, Type::vec4}}},
        {"motion",
         "motion model",
         ".mot",
         "Small motion of the camera, such as jitter.",
         {{"rotation",
           Type::vec3,
           {{Type::scalar, "t"}},
           {1},
           true,
           "Rotation of the camera from its attitude in its own frame, axis times angle in rad; t: scene time, s"},
          {"offset",
           Type::vec3,
           {{Type::scalar, "t"}},
           {1},
           false,
           "Displacement of the camera from its place in its own frame, m"}},
         {}},
        {"texture",
         "texture model",
         ".txr",
         "Texture, an image or computed.",
         {lookup_2d(), lookup_3d(), texture_size(), compute_3d_lod()},
         {{"lookupLOD", {Type::texture, Type::vec2, Type::scalar}, Type::vec4},
          {"size", {Type::texture}, Type::vec2}}},
        {"psf", "PSF model", ".psf", "Point spread function of the optics.", {density()}, {}},
        {"projection",
         "projection model",
         ".prj",
         "Projection of a lens with its distortion.",
         {projection_entry("point", Type::vec2, {Type::vec3, "d"}, true,
                           "Point of the focal plane that a direction falls on, m, right and down from the "
                           "optical axis; d: unit vector in the camera frame, x right, y down, z boresight; "
                           "vec2(M_NAN): not seen"),
          projection_entry(
              "ray", Type::vec3, {Type::vec2, "p"}, true,
              "Direction, of any length, that a point of the focal plane sees; vec3(M_NAN): none"),
          projection_entry("transmission", Type::scalar, {Type::vec3, "d"}, false,
                           "Fraction of the light from a direction that reaches the focal plane")},
         {},
         {{Type::scalar, "focal_length"}}},
        {"sensor",
         "sensor model",
         ".sns",
         "Response of a sensor's pixels.",
         {sensor_entry(
              "light", "mean",
              "Expected charge, e-, from that of light, dark current, blooming and smear, before shot "
              "noise; x, y: column and row of the pixel on the array"),
          sensor_entry("collect", "charge",
                       "Charge that is kept of a charge, e-: in place of full well and non-linearity"),
          sensor_entry("convert", "signal",
                       "Signal at the converter, DN, from that with noise, gain and black level")},
         {{"normal", {Type::scalar}, Type::scalar}},
         {{Type::scalar, "full_well"}}},
        timing_kind(),
        {"shape",
         "shape model",
         ".shp",
         "Surface of a body.",
         {shape_entry("outside", {{Type::vec3, "p"}}, true,
                      "Positive outside of the body, negative inside, m; p: place in its frame, m"),
          shape_entry(
              "height", {{Type::scalar, "longitude"}, {Type::scalar, "latitude"}}, true,
              "Height along the radius over the ellipsoid of radii_m, m; both angles from the centre, "
              "rad"),
          shape_entry("bound_radius", {}, false,
                      "Radius of a ball about the origin that has the surface, m; height() has one without")},
         {}},
    };
    return kinds;
}

const ModelKind* kind_of_file(std::string_view name) {
    for (const ModelKind& kind : model_kinds())
        if (name.ends_with(kind.ending)) return &kind;
    return nullptr;
}

const ModelKind* kind_of(const Model& model) {
    return kind_of_file(model.name());
}

std::string unknown_ending(std::string_view name) {
    if (kind_of_file(name) != nullptr) return "";
    std::vector<std::string_view> endings;
    for (const ModelKind& kind : model_kinds())
        endings.push_back(kind.ending);
    return fmt::format("the ending of the file's name says no kind of model: allowed are {}",
                       fmt::join(endings, ", "));
}

void check_entry_points(const Model& model, Findings& findings) {
    const ModelKind* const kind = kind_of(model);
    if (kind == nullptr) {
        findings.error({}, unknown_ending(model.name()));
        return;
    }
    const auto has_one_of = [&] {
        return std::any_of(kind->entry_points.begin(), kind->entry_points.end(), [&](const EntryPoint& e) {
            return e.one_of && model.function(e.name) != nullptr;
        });
    };
    std::vector<std::string> one_of;
    for (const EntryPoint& entry : kind->entry_points)
        if (entry.one_of) one_of.push_back(signature(entry));
    if (!one_of.empty() && !has_one_of() && !findings.has_errors())
        findings.error({}, fmt::format("a function is missing, one of {}", fmt::join(one_of, ", ")));
    for (const EntryArgument& constant : kind->constants)
        for (const Parameter& p : model.parameters())
            if (p.name == constant.name)
                findings.error(p.at, fmt::format("'{}' is given by the renderer: leave the {} out", p.name,
                                                 p.global ? "global" : "parameter"));
    for (const EntryPoint& entry : kind->entry_points) {
        const Function* const f = model.function(entry.name);
        if (f == nullptr) {
            // A text that cannot be read may have the function.
            if (entry.required && !findings.has_errors())
                findings.error({}, fmt::format("the function {} is missing", signature(entry)));
            continue;
        }
        bool fits = f->type == entry.type && std::find(entry.stops.begin(), entry.stops.end(),
                                                       f->arguments.size()) != entry.stops.end();
        for (std::size_t i = 0; fits && i < f->arguments.size(); ++i)
            fits = f->arguments[i].type == entry.arguments[i].type;
        if (!fits) findings.error(f->at, fmt::format("'{}' must be {}", f->name, signature(entry)));
    }
}

std::optional<Value> look_up_stand_in(const Model& model, std::string_view name,
                                      const std::vector<Value>& arguments, std::string& why,
                                      const std::function<Value(Type)>& placed) {
    const ModelKind* const kind = kind_of(model);
    if (kind == nullptr) return {};
    for (const LookUpFunction& f : kind->look_ups) {
        if (f.name != name) continue;
        bool fits = arguments.size() == f.arguments.size();
        for (std::size_t i = 0; fits && i < arguments.size(); ++i)
            fits = arguments[i].type == f.arguments[i];
        if (fits) {
            why.clear();
            return placed(f.type);
        }
        if (!why.empty()) continue;
        std::vector<std::string_view> types;
        for (const Type type : f.arguments)
            types.push_back(name_of(type));
        why = fmt::format("{}() takes {}", name, fmt::join(types, ", "));
    }
    return {};
}

} // namespace obscura::models
