// SPDX-License-Identifier: Apache-2.0
// Verb `obscura new`: commented configuration or scene file to begin with.
#include "config/keys.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "images/writers/raw.hpp"
#include "tools/pages/key_reference.hpp"
#include "tools/pages/new_file.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace obscura::tools {
namespace {

namespace fs = std::filesystem;

/// A camera like that of config/demo.toml, on the loopback interface. `scene` is a file name or that of a
/// shipped scene, as TOML.
NewFile camera_file(const std::string& name, const std::string& scene) {
    NewFile file;
    file.introduction =
        fmt::format("A camera. Keys behind # have the values shown there; remove the # to change one.\n"
                    "  obscura check {0}            is it sound?\n"
                    "  obscura capture {0} -o frames   frames as files, without network\n"
                    "  obscurad --config {0}        the camera; obscura grab -o frames receives from it",
                    name);
    file.set = {
        {"[scene]", "file", scene},
        {"[trigger]", "source", "\"timer\""},
        {"[trigger]", "rate_hz", "5"},
        {"[camera]", "exposure_us", "5000"},
        {"[camera]", "trigger_mode", "\"On\""},
        {"[camera]", "trigger_source", "\"Line0\""},
        {"[[camera.window]]", "width", "64"},
        {"[[camera.window]]", "height", "64"},
        {"[gige]", "interface", "\"lo\""},
        {"[[gige.faults]]", "kind", "\"lose\""},
        {"[[gige.faults]]", "percent", "1"},
        {"[sensor]", "name", "\"640 x 512 pixels\""},
        {"[sensor]", "pixel_pitch_um", "5.5"},
        {"[sensor.readout]", "width", "640"},
        {"[sensor.readout]", "height", "512"},
        {"[sensor.readout]", "shutter", "\"rolling\""},
        {"[sensor.readout]", "pixel_clock_hz", "5e6"},
        {"[sensor.detector]", "quantum_efficiency", "[[400, 0.45], [550, 0.62], [700, 0.45], [900, 0.12]]"},
        {"[sensor.detector]", "dark_current_e_per_s", "5"},
        {"[sensor.detector]", "full_well_e", "50000"},
        {"[sensor.detector]", "read_noise_e", "8"},
        {"[sensor.detector]", "gain_dn_per_e", "0.08"},
        {"[sensor.detector]", "offset_dn", "64"},
        {"[sensor.detector]", "adc_bits", "12"},
    };
    file.absent = {"[trigger.line1]", "[[camera.window]]", "[[gige.faults]]"};
    // These have the keys of [trigger.line1], and of [camera] in the scene file.
    file.left_out = {"[trigger.line2]", "[trigger.line3]", "[camera.view]"};
    return file;
}

/// An ellipsoid before Orion's belt, at a phase angle of 60 degrees; for 5 ms at f/16.
NewFile scene_file(const std::string& name) {
    NewFile file;
    file.introduction = fmt::format(
        "A scene. Keys behind # have the values shown there; remove the # to change one.\n"
        "  obscura check {0}               is it sound?\n"
        "  obscura render {0} -o scene.png    what the camera sees\n"
        "Other shapes and materials have keys of their own: obscura keys mesh, obscura keys hapke.",
        name);
    file.set = {
        {"", "name", "\"new\""},
        {"[sun]", "direction", "[-0.913, -0.408, 0]"},
        {"[sun]", "distance_au", "1"},
        {"[stars]", "catalogue", "\"bright\""},
        {"[stars]", "limiting_magnitude", "6"},
        {"[camera]", "width", "640"},
        {"[camera]", "height", "512"},
        {"[camera]", "pixel_pitch_um", "5.5"},
        {"[camera]", "focal_length_mm", "80"},
        {"[camera]", "aperture_mm", "5"},
        {"[camera]", "psf_sigma_px", "0.7"},
        {"[camera]", "position_m", "[-2073, -19888, 419]"},
        {"[camera]", "look_at_m", "[0, 0, 0]"},
        {"[camera]", "up", "[0, 0, 1]"},
        {"[[body]]", "name", "\"asteroid\""},
        {"[[body]]", "shape", "\"ellipsoid\""},
        {"[[body]]", "radii_m", "[200, 150, 130]"},
        {"[[body]]", "material", "\"lambert\""},
        {"[[body]]", "albedo", "0.1"},
        {"[[body]]", "spin_axis", "[0, 0, 1]"},
        {"[[body]]", "spin_rate_deg_per_s", "1"},
        {"[[lamp]]", "intensity_w_sr", "[100]"},
        {"[[band]]", "from_nm", "400"},
        {"[[band]]", "to_nm", "900"},
        {"[[stray_light]]", "file", "\"stray_light.fits\""},
        {"[[sky_object]]", "ra_deg", "84.05"},
        {"[[sky_object]]", "dec_deg", "-1.2"},
        {"[[sky_object]]", "v_mag", "6"},
        {"[[landmark]]", "name", "\"crater\""},
        {"[[landmark]]", "body", "\"asteroid\""},
        {"[[global]]", "name", "\"gain\""},
        {"[[global]]", "values", "[1.0]"},
    };
    file.absent = {"[[lamp]]", "[[stray_light]]", "[[sky_object]]", "[[landmark]]", "[[global]]"};
    file.left_out = {"[[body.height]]", "[[body.albedo]]", "[body.detail]"}; // of other shapes
    file.variants = {"shape = \"ellipsoid\"", "material = \"lambert\""};
    return file;
}

const KeyReference& reference_named(const std::vector<KeyReference>& references, std::string_view name) {
    for (const KeyReference& reference : references)
        if (reference.name == name) return reference;
    throw std::logic_error("no such reference");
}

class New final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "writes a commented configuration or scene file to begin with";
        line.description =
            "Writes a file with every table and key, its meaning, unit and range in comments: sensible values for what matters first, all else commented out with its default. "
            "The file is complete: obscura check accepts it. "
            "A new camera sees scene.toml of the same folder if there is one, otherwise a shipped scene. "
            "An existing file is kept unless --force is given.";
        line.positional("KIND", &kind_, "What to write").choices = {"camera", "scene"};
        line.positional("FILE", &file_, "File to write (default: camera.toml or scene.toml)").required =
            false;
        line.flag("--force", force_, "Replace FILE if it exists");
        line.examples = {"obscura new scene", "obscura new camera",
                         "obscura new camera bench.toml && obscura check bench.toml"};
    }

    int run() override {
        if (file_.empty()) file_ = kind_ + ".toml";
        std::error_code error;
        if (!force_ && fs::exists(fs::symlink_status(file_, error)))
            throw host::UsageError(fmt::format("obscura new: {} exists; --force replaces it", file_));
        const bool camera = kind_ == "camera";
        const std::vector<KeyReference> references = key_references();
        images::write_text(file_,
                           new_file_text(reference_named(references, camera ? "configuration" : "scene"),
                                         camera ? camera_file(file_, scene()) : scene_file(file_)));
        fmt::print("{0}: written; next: obscura check {0}\n", file_);
        return exit_ok;
    }

private:
    /// The scene that a new camera sees, as TOML.
    [[nodiscard]] std::string scene() const {
        const std::string beside = "scene.toml";
        const fs::path file(file_);
        const bool there = file.filename() != beside && path_exists(file.parent_path() / beside);
        return config::toml_string(there ? beside : "demo");
    }

    std::string kind_, file_;
    bool force_ = false;
};

} // namespace

std::unique_ptr<Verb> make_new() {
    return std::make_unique<New>();
}

} // namespace obscura::tools
