// SPDX-License-Identifier: Apache-2.0
// Verb `obscura import ephemeris`: SPK kernel from casacore's DE405, or from a kernel in another form.
#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "ephemeris/kernels/daf.hpp"
#include "ephemeris/kernels/daf_writer.hpp"
#include "ephemeris/kernels/default_ephemeris.hpp"
#include "ephemeris/kernels/ephemeris.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/raw.hpp"
#include "tools/import/ephemeris/casacore_ephemeris.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <filesystem>

namespace obscura::tools {
namespace {

class ImportEphemeris final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "makes a kernel of planets, Moon and Sun from Debian's DE405";
        line.description =
            "Writes an SPK kernel in the form that is used without loading it (binary, little-endian) for the key kernels of a scene and for obscura ephemeris. "
            "Without --output it becomes the default ephemeris, which scenes use that name no kernels: $XDG_DATA_HOME/obscura/de405.bsp (~/.local/share), of root /usr/local/share/obscura/de405.bsp. "
            "FILE is the folder of casacore's table of JPL's DE405, which Debian's package casacore-data-jpl-de405 installs (planets, Moon and Sun, 1959 to 2060), or an SPK, CK or binary PCK kernel: big-endian ones and transfer files (.xsp, .xc, .xpc) are converted. "
            "Binary kernels of either byte order and transfer files can also be used as they are.";
        line.positional("FILE", &file_, "Folder of the table, or kernel").required = false;
        line.option("-o,--output", &output_, "FILE", "Kernel to write; none: the default ephemeris");
        line.examples = {
            "obscura import ephemeris",
            "obscura import ephemeris -o de405.bsp",
            "obscura import ephemeris new_horizons.xsp -o new_horizons.bsp",
            "obscura ephemeris de405.bsp",
        };
    }

    int run() override {
        const std::filesystem::path file(file_);
        require_permission(file);
        const bool is_default = output_.empty();
        if (is_default && !is_folder_at(file) && path_exists(file))
            throw host::UsageError(
                "obscura import ephemeris: --output is wanted where a kernel is converted");
        std::string bytes;
        std::string source = file_;
        if (is_folder_at(file)) {
            const CasacoreEphemeris table = read_casacore_ephemeris(file);
            source = fmt::format("{} ({})", table.name, file_);
            bytes = ephemeris::daf_bytes("SPK", table.name, "Made by obscura import ephemeris from " + source,
                                         table.segments);
        } else {
            if (!path_exists(file))
                throw InputError(fmt::format(
                    "{}: no such file or folder; Debian's package casacore-data-jpl-de405 installs {}", file_,
                    casacore_de405));
            bytes = converted(file);
        }
        if (is_default) {
            const std::filesystem::path place = ephemeris::place_of_new_default_ephemeris();
            std::error_code ignored; // the message is that of the file
            std::filesystem::create_directories(place.parent_path(), ignored);
            output_ = place.string();
        }
        images::PendingFile pending(output_);
        images::write_text(pending.path(), bytes);
        const ephemeris::Ephemeris written = read_again(pending.path(), source);
        pending.commit();
        fmt::print("{}: written from {}, bodies: {}, orientations: {}; next: {}\n", output_, source,
                   written.bodies().size(), written.frame_coverage().size(),
                   is_default ? "epoch and ephemeris in a scene, without kernels"
                              : "obscura ephemeris " + output_);
        return exit_ok;
    }

private:
    /// What was written must be readable as a whole, before it takes the place of another file. Throws
    /// InputError.
    static ephemeris::Ephemeris read_again(const std::filesystem::path& file, const std::string& source) {
        const auto refuse = [&](std::string why) -> InputError {
            const std::string name = file.string();
            for (std::size_t at; (at = why.find(name)) != std::string::npos;)
                why.replace(at, name.size(), "the kernel");
            return InputError(fmt::format("{}: cannot be read once converted: {}", source, why));
        };
        try {
            ephemeris::Ephemeris written({file});
            if (const auto& unusable = written.unusable(); !unusable.empty()) throw refuse(unusable.front());
            return written;
        } catch (const ConfigError& error) {
            throw refuse(error.what());
        }
    }

    static std::string converted(const std::filesystem::path& file) {
        (void)open_input(file); // says why it cannot be read, if so
        if (!ephemeris::Daf::starts_as_daf(file))
            throw InputError(fmt::format("{}: neither a casacore table nor an SPK, CK or binary PCK kernel",
                                         file.string()));
        const ephemeris::Daf daf(file);
        std::vector<ephemeris::DafArrayData> arrays;
        for (const ephemeris::Daf::Array& a : daf.arrays())
            arrays.push_back({a.name, a.doubles, a.integers, {a.words.begin(), a.words.end()}});
        return ephemeris::daf_bytes(daf.kind(), file.filename().string(),
                                    "Converted by obscura import ephemeris from " + file.filename().string(),
                                    arrays);
    }

    std::string file_ = casacore_de405;
    std::string output_;
};

} // namespace

std::unique_ptr<Verb> make_import_ephemeris() {
    return std::make_unique<ImportEphemeris>();
}

} // namespace obscura::tools
