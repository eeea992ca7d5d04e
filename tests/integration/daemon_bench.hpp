// SPDX-License-Identifier: Apache-2.0
// Configurations for daemons under test, and the daemon as a child process.
#pragma once

#include "tests/support/child_process.hpp"
#include "tests/support/temp_folder.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace obscura::test {

/// A loopback address that no other test program uses at the same time.
inline std::string own_address(int number) {
    const int pid = getpid();
    return "127." + std::to_string(100 + (pid >> 16) % 100) + "." + std::to_string((pid >> 8) & 255) + "." +
           std::to_string(1 + (pid + 37 * number) % 250);
}

/// A scene light enough to be rendered many times a second on a busy machine.
inline const char* light_scene = R"(name = "light"
[sun]
direction = [-1, -1, 0.3]
distance_au = 2
[stars]
catalogue = "STARS"
limiting_magnitude = 5
[camera]
focal_length_mm = 50
aperture_mm = 25
psf_sigma_px = 0.7
position_m = [-20000, 0, 0]
boresight = [1, 0, 0]
up = [0, 0, 1]
[[body]]
name = "moonlet"
shape = "ellipsoid"
radii_m = [500, 400, 300]
material = "lommel-seeliger"
albedo = 0.1
spin_axis = [0.0, 0.2, 1.0]
spin_rate_deg_per_s = 30
)";

struct DaemonOptions {
    std::string address; ///< empty: no control port
    int size = 1024;     ///< the sensor is square,
    int height = 0;      ///< unless its rows are given
    double rate_hz = 10;
    std::string frames_folder; ///< empty: no files
    std::string more;          ///< further TOML, at the end
    std::string gige_more;     ///< further keys of [gige]
    std::string camera_more;   ///< further keys of [camera]
    std::string scene;         ///< another scene file; empty: the light one
    std::string daemon_more;   ///< further keys of [daemon]
    std::int64_t run = 0;      ///< run word; -1: random
    std::string trigger_more;  ///< further keys of [trigger]
    std::string render_more;   ///< further keys of [render]
    bool several = false;      ///< no [camera]: `more` has [[camera]] elements
};

/// Writes configuration and scene into `folder`; returns the configuration's path.
inline std::filesystem::path write_configuration(const TempFolder& folder, const DaemonOptions& o) {
    std::string scene = o.scene;
    if (scene.empty()) {
        scene = light_scene;
        scene.replace(scene.find("STARS"), 5, OBSCURA_SOURCE_DIR "/config/stars/bright.csv");
        scene = folder.write("scene.toml", scene).string();
    }
    std::string text = "[scene]\nfile = \"" + scene + "\"\n";
    text +=
        "[daemon]\nseed = 11\npool_frames = 16\n" + o.daemon_more + "\nrun = " + std::to_string(o.run) + "\n";
    text += "[render]\nsamples_per_pixel = 1\n" + o.render_more;
    text += "[trigger]\nrate_hz = " + std::to_string(o.rate_hz) + "\n" + o.trigger_more;
    if (!o.several) text += "[camera]\nexposure_us = 5000\n" + o.camera_more;
    text += o.address.empty()
                ? "[gige]\nenabled = false\n"
                : "[gige]\ninterface = \"" + o.address + "\"\npacket_size = 8000\n" + o.gige_more + "\n";
    if (!o.frames_folder.empty())
        text += "[file]\nenabled = true\nformat = \"raw\"\ndirectory = \"" + o.frames_folder + "\"\n";
    text += "[sensor.readout]\nwidth = " + std::to_string(o.size) +
            "\nheight = " + std::to_string(o.height > 0 ? o.height : o.size) + "\n";
    text += o.more;
    return folder.write("obscurad.toml", text);
}

/// obscurad as a child process.
/// Waits for what must come true soon; a minute or two: only a test that fails waits that long.
inline bool eventually(const std::function<bool()>& condition) {
    for (int i = 0; i < 12'000 && !condition(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return condition();
}
inline bool wait_for_file(const std::filesystem::path& file) {
    return eventually([&file] { return std::filesystem::exists(file); });
}

class DaemonProcess {
public:
    DaemonProcess(const TempFolder& folder, const std::filesystem::path& configuration,
                  const std::vector<std::string>& environment = {}, const std::string& name = "obscurad")
        : ready_(folder.path() / (name + ".ready")),
          statistics_(folder.path() / (name + ".json")),
          process_(folder.path(), name,
                   {OBSCURA_BINARY_DIR "/emulator/obscurad", "--config", configuration.string(),
                    "--ready-file", ready_.string(), "--stats", statistics_.string()},
                   environment) {}

    /// Waits until it serves; false when it ended or took too long.
    bool wait_ready() {
        eventually([this] { return std::filesystem::exists(ready_) || !process_.running(); });
        return std::filesystem::exists(ready_);
    }
    ChildProcess& process() { return process_; }
    [[nodiscard]] std::string ready_text() const { return text_of(ready_); }
    [[nodiscard]] std::string statistics() const { return text_of(statistics_); }
    [[nodiscard]] std::string log() const { return process_.err(); }

private:
    std::filesystem::path ready_, statistics_;
    ChildProcess process_;
};

} // namespace obscura::test
