// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura model eval`, `plot` and `bench`: what a scattering law in SuMoL gives, looks like and costs.
#include "core/error.hpp"
#include "images/writers/raw.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/registry.hpp"
#include "tools/model/chosen_law.hpp"
#include "tools/model/law_pictures.hpp"
#include "tools/verbs/model.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <vector>

namespace obscura::tools {
namespace {

/// A law and its parameters on the command line.
struct LawArguments {
    std::string file;
    std::vector<std::string> settings;

    void declare(host::CommandLine& line) {
        line.positional("MODEL", &file, "File, or name of a shipped model");
        line.option("--set", &settings, "NAME=VALUE",
                    "Value of a parameter instead of its default; may be given several times");
    }
    [[nodiscard]] renderer::ModelMaterial law() const {
        return renderer::ModelMaterial(chosen_law(file, settings));
    }
};

class ModelEval final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints the value of a law for one pair of directions";
        line.description =
            "Prints the BRDF times the cosine of incidence, in 1/sr, and the radiance factor I/F, for light and camera at the given angles.";
        arguments_.declare(line);
        line.number("--incidence", &angles_.incidence_deg, "DEG", "Angle between light and normal", 0, 90);
        line.number("--emission", &angles_.emission_deg, "DEG", "Angle between camera and normal", 0, 90);
        line.number("--azimuth", &angles_.azimuth_deg, "DEG",
                    "Angle between their planes; 0: light and camera on one side", 0, 180);
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura model eval akimov --incidence 30 --emission 10",
                         "obscura model eval rock.brdf --set albedo=0.3 --incidence 45"};
    }

    int run() override {
        const double r = law_values(arguments_.law(), {angles_.cosines()})[0];
        const double factor = std::numbers::pi * r;
        if (json_)
            fmt::print("{}\n", nlohmann::json{{"phase_deg", angles_.phase_deg()},
                                              {"r_per_sr", r},
                                              {"radiance_factor", factor}}
                                   .dump());
        else
            fmt::print(
                "phase angle      {:.6g} deg\nBRDF x cos i     {:.12g} 1/sr\nradiance factor  {:.12g}\n",
                angles_.phase_deg(), r, factor);
        return exit_ok;
    }

private:
    LawArguments arguments_;
    LawAngles angles_;
    bool json_ = false;
};

class ModelPlot final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "draws a law: spheres, lobes and phase curve, or a table";
        line.description =
            "FILE.png shows spheres of the law at phase angles of 5, 30, 60 and 100 degrees; FILE.svg its lobes in the plane of incidence for light at 0, 30 and 60 degrees, and the phase curve of a sphere; "
            "FILE.csv is a table over incidence, emission and azimuth.";
        arguments_.declare(line);
        line.option("-o,--output", &output_, "FILE", "File to write: .png, .svg or .csv").required = true;
        line.examples = {"obscura model plot hapke -o hapke.png",
                         "obscura model plot rock.brdf --set gloss=0.3 -o rock.svg"};
    }

    int run() override {
        const renderer::ModelMaterial law = arguments_.law();
        const std::filesystem::path file = output_;
        if (file.extension() == ".png")
            law_spheres(law).write(file);
        else if (file.extension() == ".svg")
            images::write_text(file, law_svg(law, std::filesystem::path(arguments_.file).stem().string()));
        else if (file.extension() == ".csv")
            images::write_text(file, law_csv(law));
        else
            throw host::UsageError(fmt::format("--output {}: allowed endings are .png, .svg, .csv", output_));
        return exit_ok;
    }

private:
    LawArguments arguments_;
    std::string output_;
};

class ModelBench final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "measures what a law costs beside the built-in ones";
        line.description =
            "Prints nanoseconds a sample, least of many repeats, of the law and of the built-in laws in packets of 16 samples, as rendering asks for them. The built-in Hapke is that of a surface with a roughness of 20 degrees.";
        arguments_.declare(line);
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura model bench hapke"};
    }

    int run() override {
        const renderer::ModelMaterialParameters p = chosen_law(arguments_.file, arguments_.settings);
        const renderer::ModelMaterial law(p);
        const double own = nanoseconds(law);
        nlohmann::json report{{"model_ns", own}};
        if (!json_)
            fmt::print("{:28} {:8.2f} ns a sample\n", std::filesystem::path(arguments_.file).stem().string(),
                       own);
        for (const std::string_view name :
             {"lambert", "lommel-seeliger", "minnaert", "oren-nayar", "hapke"}) {
            const auto& kinds = renderer::material_kinds();
            scene::Material description = scene::find_kind(kinds, name)->make_default();
            // A smooth surface would be another law.
            if (auto* const hapke = description.get_if<renderer::HapkeParameters>())
                hapke->roughness_rad = 0.35;
            const auto built_in = renderer::make_material(description, "bench");
            const double ns = nanoseconds(*built_in);
            report["built_in_ns"][std::string(name)] = ns;
            if (!json_) fmt::print("{:28} {:8.2f}\n", fmt::format("built-in {}", name), ns);
        }
        if (json_) fmt::print("{}\n", report.dump());
        return exit_ok;
    }

private:
    /// Least time of 60 repeats, a sample.
    static double nanoseconds(const renderer::Material& law) {
        constexpr int packets = 64;
        constexpr int samples = packets * renderer::packet_size;
        std::vector<LawCosines> directions;
        for (int i = 0; i < samples; ++i) {
            const double share = (i + 0.5) / samples;
            directions.push_back(
                LawAngles{80 * share, 80 * std::fmod(share * 37, 1.0), 180 * std::fmod(share * 91, 1.0)}
                    .cosines());
        }
        const std::vector<renderer::ScatterPacket> in = packets_of(directions);
        double best = std::numeric_limits<double>::infinity();
        volatile double sink = 0;
        for (int repeat = 0; repeat < 60; ++repeat) {
            const auto begin = std::chrono::steady_clock::now();
            renderer::Doubles r;
            double sum = 0;
            for (int k = 0; k < 20 * packets; ++k) {
                law.reflectance(in[static_cast<std::size_t>(k % packets)], r);
                sum += r[0];
            }
            sink = sum;
            const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - begin;
            best = std::min(best, took.count() / (20.0 * samples));
        }
        (void)sink;
        return best;
    }

    LawArguments arguments_;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_model_eval() {
    return std::make_unique<ModelEval>();
}
std::unique_ptr<Verb> make_model_plot() {
    return std::make_unique<ModelPlot>();
}
std::unique_ptr<Verb> make_model_bench() {
    return std::make_unique<ModelBench>();
}

} // namespace obscura::tools
