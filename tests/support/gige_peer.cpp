// SPDX-License-Identifier: Apache-2.0
// A GigE Vision camera that sends a test pattern until its standard input closes: for tests that drive
// foreign programs (arv-test, tshark) or other network namespaces.
//
//     gige_peer INTERFACE [KEY=VALUE...]
//     keys: width height rate packet_size limit_mbit drop_percent seed history backend serial realtime
//     windows
#include "core/clock.hpp"
#include "core/error.hpp"
#include "tests/support/pattern_camera.hpp"
#include "transports/gige/gige.hpp"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <map>
#include <string>

int main(int argc, char* argv[]) {
    using namespace obscura;
    if (argc < 2) {
        std::fprintf(stderr, "usage: gige_peer INTERFACE [KEY=VALUE...]\n");
        return exit_usage;
    }
    std::map<std::string, std::string> options;
    for (int i = 2; i < argc; ++i) {
        const char* equals = std::strchr(argv[i], '=');
        if (equals != nullptr) options[std::string(static_cast<const char*>(argv[i]), equals)] = equals + 1;
    }
    const auto number = [&](const char* key, double otherwise) {
        const auto found = options.find(key);
        return found == options.end() ? otherwise : std::atof(found->second.c_str());
    };
    try {
        CameraLimits limits;
        limits.sensor_width = static_cast<std::int32_t>(number("width", 640));
        limits.sensor_height = static_cast<std::int32_t>(number("height", 480));
        MonotonicClock clock;
        test::PatternCamera source(limits, 24);
        if (const int windows = static_cast<int>(number("windows", 1)); windows > 1) {
            // The sensor in so many strips, which together look like the whole.
            std::vector<Region> strips;
            for (int i = 0, y = 0; i < windows; ++i) {
                const int next = limits.sensor_height * (i + 1) / windows;
                strips.push_back({0, y, limits.sensor_width, next - y});
                y = next;
            }
            source.set_windows(strips);
        }
        transports::gige::GigeSettings settings;
        settings.interface = argv[1];
        settings.packet_size = static_cast<std::int32_t>(number("packet_size", 1500));
        settings.throughput_limit_mbit_s = number("limit_mbit", 1000);
        settings.drop_percent = number("drop_percent", 0);
        settings.history_frames = static_cast<std::int32_t>(number("history", 4));
        if (options.count("backend") != 0)
            settings.backend = enum_named<transports::gige::SendBackend>(options["backend"]).value();
        if (options.count("serial") != 0) settings.serial = options["serial"];
        transports::gige::GigeCamera camera(settings, source, clock,
                                            {.thread = {static_cast<int>(number("realtime", 0))},
                                             .seed = static_cast<std::uint64_t>(number("seed", 1))});
        source.set_transport(camera);
        CameraSettings reset = source.settings();
        reset.frame_rate_hz = number("rate", 50);
        source.apply(reset);
        camera.start();
        std::printf("ready %s\n", camera.address().c_str());
        std::fflush(stdout);
        char byte = 0;
        while (read(0, &byte, 1) > 0) {
        }
        source.acquisition_stop(true);
        camera.stop();
        const auto c = camera.gige_counters();
        std::printf("submitted %llu delivered %llu dropped %llu packets %llu resent %llu requests %llu\n",
                    static_cast<unsigned long long>(c.frames.submitted),
                    static_cast<unsigned long long>(c.frames.delivered),
                    static_cast<unsigned long long>(c.frames.dropped),
                    static_cast<unsigned long long>(c.packets),
                    static_cast<unsigned long long>(c.resent_packets),
                    static_cast<unsigned long long>(c.resend_requests));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "gige_peer: %s\n", e.what());
        return exit_hardware;
    }
    return 0;
}
