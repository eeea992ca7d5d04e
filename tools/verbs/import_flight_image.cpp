// SPDX-License-Identifier: Apache-2.0
// Verb `obscura import flight-image`: scene file from the header of a flight image.
#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/raw.hpp"
#include "tools/import/near_msi.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <cstdio>

namespace obscura::tools {
namespace {

class ImportFlightImage final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "makes a scene file from the header of a flight image";
        line.description =
            "Reads camera pose, Sun position, time and filter from the header of a flight image and writes a scene file that reproduces the image: render it and compare the two. "
            "Supported are NEAR MSI frames of 433 Eros: "
            "FITS files, each with its detached PDS3 label (.lbl) in the same folder; "
            "raw frames of 537 x 244 pixels, 16 by 27 um, and frames resampled to 537 x 412 square pixels.";
        line.positional("FILE", &file_, "Flight image (FITS)");
        line.option("--shape", &shape_, "MESH", "Shape model of the target: Wavefront OBJ in body-fixed axes")
            .required = true;
        line.number("--metres-per-unit", &metres_per_unit_, "M", "Length of one unit of the mesh in metres",
                    1e-9, 1e12);
        line.option("--utc", &utc_, "TIME",
                    "UTC of mid-exposure, for example 2001-02-08T17:24:42.25 (default: from the label)");
        line.option("-o,--output", &output_, "FILE", "Scene file to write").required = true;
        line.examples = {
            "obscura import flight-image m0157063318f4_2p_iof_gbl.fit --shape eros.obj -o eros.toml",
            "obscura render eros.toml -o eros.fits --samples 16",
            "obscura compare m0157063318f4_2p_iof_gbl.fit eros.fits --scene eros.toml --pointing",
        };
    }

    int run() override {
        const std::filesystem::path mesh = absolute_path(shape_);
        require_permission(mesh);
        if (!is_file_at(mesh))
            throw InputError(fmt::format("{}: no such file, a mesh in Wavefront OBJ is wanted", shape_));
        const std::string scene = near_msi_scene(file_, {mesh.string(), metres_per_unit_, utc_});
        images::write_text(output_, scene);
        fmt::print("{}: written; next: obscura render {} -o render.fits && obscura compare {} render.fits\n",
                   output_, output_, file_);
        return exit_ok;
    }

private:
    std::string file_, shape_, utc_, output_;
    double metres_per_unit_ = 1000;
};

} // namespace

std::unique_ptr<Verb> make_import_flight_image() {
    return std::make_unique<ImportFlightImage>();
}

} // namespace obscura::tools
