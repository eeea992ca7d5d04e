// SPDX-License-Identifier: Apache-2.0
// Verb `obscura characterise`: EMVA 1288 characterisation of a sensor file, an image series or a camera.
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "images/writers/raw.hpp"
#include "sensors/photometry.hpp"
#include "sensors/sensor_file.hpp"
#include "tools/characterise/characterise_camera.hpp"
#include "tools/characterise/characterise_preset.hpp"
#include "tools/characterise/characterise_series.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>

namespace obscura::tools {
namespace {

class Characterise final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "measures a sensor after EMVA 1288: gain, noise, saturation, patterns";
        line.description =
            "Measures gain, noise, saturation capacity, linearity, DSNU, PRNU and dark current from digital numbers alone. "
            "The images come from one of three sources: --preset simulates bright and dark series of a sensor and compares each result with the value in the sensor file; "
            "--series reads the descriptor and the images of an EMVA 1288 reference set; "
            "--camera takes a series from a running GigE Vision camera in front of a uniform, constant light, with exposure times that rise until the image saturates. "
            "The exit status is 1 when a result deviates from the value in the sensor file by more than its tolerance.";
        line.option("--preset", &preset_, "NAME",
                    "Sensor to simulate: a name that `obscura sensor list` prints, or a .toml file");
        line.option(
            "--series", &series_, "DIR",
            "EMVA 1288 descriptor file, or the folder of one named EMVA1288_Data.txt, with the images that it names");
        line.option("--camera", &camera_.series.receiver.address, "HOST",
                    "GigE Vision camera in front of a uniform, constant light: IPv4 address or host name");
        line.flag(
            "--dark", camera_.dark,
            "With --camera: take a dark series, with the light off, and measure dark noise, DSNU and dark current");
        line.number("--gain", &camera_.gain_dn_per_e, "K",
                    "With --dark: system gain K in DN/e-, as measured without --dark (0: results in DN)", 0,
                    1e6);
        line.number(
            "--photons-per-s", &camera_.photons_per_s, "P",
            "With --camera: photons per pixel and second that the light delivers, needed for the quantum efficiency (0: unknown)",
            0, 1e15);
        line.number("--least-us", &camera_.series.min_us, "US",
                    "With --camera: shortest exposure time in microseconds (0: the camera's minimum)", 0,
                    1e7);
        line.number(
            "--most-us", &camera_.series.max_us, "US",
            "With --camera: longest exposure time in microseconds (0: found by raising it until the image saturates)",
            0, 1e7);
        line.number("--levels", &camera_.series.levels, "N",
                    "With --camera: number of exposure times, evenly spaced", 5, 1000);
        line.option(
            "--pixel-format", &camera_.series.pixel_format, "FORMAT",
            "With --camera: "
            "PixelFormat, one of Mono8 to Mono16, Mono10p and Mono12p (default: the camera's setting)");
        line.number("--packet-size", &camera_.series.receiver.packet_size, "BYTES",
                    "With --camera: GevSCPSPacketSize (0: negotiated)", 0, 65532);
        line.number("--wavelength-nm", &wavelength_nm_, "NM",
                    "With --preset: wavelength of the simulated light in nanometres", 200, 2000);
        line.option("-o,--output", &output_, "FILE", "Also write the report with its plots as one HTML page");
        line.flag("--json", json_, "Print the results as JSON instead of a table");
        line.examples = {"obscura characterise --preset has2 -o has2.html",
                         "obscura characterise --series EMVA1288_ReferenceSet_001_CCD_12Bit --json",
                         "obscura characterise --camera 127.0.0.1 -o lit.html",
                         "obscura characterise --camera 127.0.0.1 --dark --gain 0.041 --most-us 2000000"};
    }

    int run() override {
        const std::string& address = camera_.series.receiver.address;
        if (int{preset_.empty()} + int{series_.empty()} + int{address.empty()} != 2)
            throw host::UsageError(
                "obscura characterise: exactly one of --preset, --series and --camera is wanted");
        if (camera_.dark && !(camera_.series.max_us > 0))
            throw host::UsageError("obscura characterise: --dark needs --most-us, the longest exposure");
        Characterisation result;
        if (!address.empty()) {
            const CameraSeries series = take_camera_series(camera_.series);
            result = camera_.dark ? characterise_dark_camera(series, camera_)
                                  : characterise_lit_camera(series, camera_);
        } else if (series_.empty()) {
            const std::filesystem::path file = config::file_or_shipped(config::shipped_sensors, preset_);
            const SensorDescription sensor = sensors::load_sensor(file);
            if (!(sensors::quantum_efficiency(sensor.detector.quantum_efficiency, wavelength_nm_ * 1e-9) >
                  0) ||
                !(sensor.detector.transmission > 0) || !(sensor.detector.fill_factor > 0))
                throw ConfigError(fmt::format(
                    "{}: the sensor has no sensitivity at {} nm: quantum efficiency, transmission or fill factor is 0",
                    file.string(), wavelength_nm_));
            result = characterise_preset(sensor, wavelength_nm_ * 1e-9);
        } else {
            result = characterise_series(series_);
        }
        result.sort();
        if (!output_.empty()) images::write_text(output_, to_html(result));
        std::fputs((json_ ? to_json(result) : to_text(result)).c_str(), stdout);
        const bool good = std::all_of(result.parameters.begin(), result.parameters.end(),
                                      [](const Parameter& p) { return p.good(); });
        return good ? exit_ok : exit_failure;
    }

private:
    CameraOptions camera_;
    std::string preset_, series_, output_;
    double wavelength_nm_ = 550;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_characterise() {
    return std::make_unique<Characterise>();
}

} // namespace obscura::tools
