// obscura import: a scene from the header of a picture that a spacecraft took.
#include "core/error.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/raw.hpp"
#include "tools/import/near_msi.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <cstdio>

namespace obscura::tools {
namespace {

class Import final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "makes a scene file from the header of a flight image";
        line.description = "Reads pose, Sun, time and camera from the header of a spacecraft's picture and "
                           "writes the scene that shows "
                           "the same: render it and compare. So far: NEAR MSI frames (FITS with their PDS3 "
                           "label beside) of 433 Eros.";
        line.positional("FILE", &file_, "Picture with its header");
        line.option("--shape", &shape_, "MESH", "Wavefront OBJ of the target, body-fixed axes").required =
            true;
        line.number("--metres-per-unit", &metres_per_unit_, "M", "Length of the mesh's unit", 1e-9, 1e12);
        line.option("--utc", &utc_, "TIME",
                    "Mid-exposure, for example 2001-02-08T17:24:42.25 (default: the label's)");
        line.option("-o,--output", &output_, "FILE", "Scene file to write").required = true;
        line.examples = {
            "obscura import m0157063318f4_2p_iof_gbl.fit --shape eros.obj -o eros.toml",
            "obscura render eros.toml -o eros.fits --samples 16",
            "obscura compare m0157063318f4_2p_iof_gbl.fit eros.fits",
        };
    }

    int run() override {
        const std::filesystem::path mesh = std::filesystem::absolute(shape_).lexically_normal();
        if (!std::filesystem::is_regular_file(mesh))
            throw InputError(fmt::format("{}: no such mesh", shape_));
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

std::unique_ptr<Verb> make_import() {
    return std::make_unique<Import>();
}

} // namespace obscura::tools
