// SPDX-License-Identifier: Apache-2.0
// Verb `obscura bench`: benchmark of rendering, detector, GigE Vision stream and trigger latency.
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/text/printable.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/daemon/daemon.hpp"
#include "emulator/unit/assemble.hpp"
#include "host/interrupt.hpp"
#include "tools/check/report.hpp"
#include "tools/receive/bench_stream.hpp"
#include "tools/receive/receiver.hpp"
#include "tools/scene/bench_scene.hpp"
#include "tools/scene/progress.hpp"
#include "tools/verbs/verb.hpp"
#include "transports/file/settings.hpp"
#include "transports/gige/settings.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <thread>
#include <vector>

namespace obscura::tools {
namespace {

using BenchClock = std::chrono::steady_clock;

double ms_since(BenchClock::time_point start) {
    return std::chrono::duration<double, std::milli>(BenchClock::now() - start).count();
}

class Bench final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "measures rendering, detector, transmission and trigger latency";
        line.description =
            "Measures three parts: rendering and detector offline; "
            "the GigE Vision stream with frames made in advance; "
            "and the whole camera in this process, triggered by a timer, with libaravis as the client on a loopback address that no other camera uses. "
            "Without --config a built-in workload is measured: a procedural asteroid that covers a third of a field of 1024 x 1024 pixels, and 200 stars. "
            "The exit status is 1 when a frame was lost.";
        line.option("--config", &config_, "FILE",
                    "Daemon configuration to measure (default: built-in workload)");
        line.number("--frames", &frames_, "N", "Frames of each measurement", 2, 100000);
        line.number("--rate", &rate_hz_, "HZ", "Trigger rate of the measurement of the whole camera", 0.1,
                    1000);
        line.number("--threads", &threads_, "N", "Render threads; 0: as configured, one per core by default",
                    0, 1024);
        line.flag("--json", json_, "Print one JSON object instead of a table");
        line.examples = {"obscura bench", "obscura bench --json --frames 50 --rate 10",
                         "obscura bench --config config/demo.toml"};
    }

    int run() override {
        set_log_level(LogLevel::error);
        emulator::DaemonConfig config = config_.empty() ? bench_config() : emulator::load_config(config_);
        if (threads_ > 0) config.render.threads = threads_;
        config.trigger.lines[0].source = "timer";
        config.trigger.lines[0].rate_hz = rate_hz_;
        config.camera.settings.frame_trigger.enabled = true;
        config.camera.settings.frame_trigger.source = TriggerSource::line0;
        config.camera.settings.pixel_format = PixelFormat::mono16;
        config.transports.get<transports::FileSinkSettings>().enabled = false;
        auto& gige = config.transports.get<transports::gige::GigeSettings>();
        gige.enabled = true;
        gige.drop_percent = 0;
        // A loopback address of this process: other cameras on this machine keep port 3956 of theirs.
        gige.interface =
            fmt::format("127.{}.{}.{}", 64 + getpid() / 62500 % 64, getpid() / 250 % 250, 1 + getpid() % 250);

        report_.add("workload", "workload", config_.empty() ? std::string_view("built in") : config_);
        report_.add("width", "width", static_cast<std::int64_t>(config.sensor.readout.width));
        report_.add("height", "height", static_cast<std::int64_t>(config.sensor.readout.height));
        report_.add("samples_per_pixel", "samples per pixel",
                    static_cast<std::int64_t>(config.render.samples_per_pixel));
        report_.add("cores", "cores", static_cast<std::int64_t>(std::thread::hardware_concurrency()));
        const bool done = measure_imaging(config) && measure_stream(config) && measure_camera(config);
        if (!done) {
            print_message("obscura bench: interrupted");
            return exit_failure;
        }
        report_.print(json_);
        return lost_ == 0 ? exit_ok : exit_failure;
    }

private:
    bool measure_imaging(const emulator::DaemonConfig& config) {
        emulator::Imaging imaging(config, 1);
        FrameRef frame;
        const auto make = [&](std::uint64_t id) {
            frame = {}; // the pool has one, which it empties
            frame = imaging.pool->acquire();
            const std::string refusal = imaging.maker->make(imaging.nominal_order(id), *frame);
            if (!refusal.empty()) throw ConfigError(fmt::format("{}: {}", config_, refusal));
        };
        make(1); // makes the readout plan too, and warms the caches

        const sensors::ReadoutPlan plan = imaging.maker->plan();
        const std::size_t pixels =
            static_cast<std::size_t>(plan.width) * static_cast<std::size_t>(plan.height);
        std::vector<float> light(pixels * config.scene.bands.size());
        renderer::RenderRequest request;
        request.window = frame->info.windows[0].sensor;
        request.rows = plan.height;
        request.row_times = plan.rows;
        request.common_mid = renderer::common_mid(plan.rows);
        const sensors::IrradianceBand band{0, plan.height, plan.width, light};

        std::vector<double> render_ms, detector_ms, frame_ms;
        double render_s = 0;
        const std::uint64_t rays = imaging.renderer->rays_traced();
        const std::uint64_t samples = imaging.renderer->samples_taken();
        Progress progress("bench: imaging", 2 * frames_);
        for (std::uint64_t i = 1; i <= frames_; ++i) {
            if (host::interrupted()) return false;
            request.frame_id = i;
            const auto start = BenchClock::now();
            imaging.renderer->render(request, light);
            render_ms.push_back(ms_since(start));
            render_s += render_ms.back() * 1e-3;
            const auto rendered = BenchClock::now();
            imaging.detector->expose(plan, band, i, config.camera.settings.gain_db, frame->pixels());
            detector_ms.push_back(ms_since(rendered));
            progress.done(i);
        }
        const auto traced = static_cast<double>(imaging.renderer->rays_traced() - rays);
        const auto sampled = static_cast<double>(imaging.renderer->samples_taken() - samples);
        for (std::uint64_t i = 1; i <= frames_; ++i) {
            if (host::interrupted()) return false;
            const auto start = BenchClock::now();
            make(i);
            frame_ms.push_back(ms_since(start));
            progress.done(frames_ + i);
        }
        report_.add("rays_per_s", "rays", traced / render_s, "/s", 0);
        report_.add("samples_per_s", "samples", sampled / render_s, "/s", 0);
        report_.add("render_ms_p50", "render, p50", percentile(render_ms, 50), "ms", 2);
        report_.add("detector_ms_p50", "detector (one thread), p50", percentile(detector_ms, 50), "ms", 2);
        report_.add("frame_ms_p50", "render and detector in bands, p50", percentile(frame_ms, 50), "ms", 2);
        return true;
    }

    bool measure_stream(const emulator::DaemonConfig& config) {
        const StreamFigures figures = bench_stream(config, frames_);
        report_.add("transmit_ms_p50", "transmit at the default limit, p50",
                    percentile(figures.limited_ms, 50), "ms", 2);
        report_.add("transmit_unlimited_ms_p50", "transmit without limit, p50",
                    percentile(figures.unlimited_ms, 50), "ms", 2);
        return !host::interrupted();
    }

    bool measure_camera(const emulator::DaemonConfig& config) {
        emulator::Daemon daemon(config);
        daemon.start();
        std::vector<double> to_first, to_complete;
        std::uint64_t received = 0;
        {
            Receiver receiver({config.transports.get<transports::gige::GigeSettings>().interface, 0, -1, 16});
            const auto before = receiver.read_clock();
            receiver.start();
            Progress progress("bench: camera", frames_);
            std::vector<ReceivedFrame> frames;
            while (received < frames_ && !host::interrupted()) {
                const auto frame = receiver.receive(5.0);
                daemon.tick();
                if (!frame) break;
                ++received;
                if (!frame->complete) {
                    ++lost_;
                    continue;
                }
                frames.push_back(*frame);
                progress.done(received);
            }
            lost_ += frames_ - received;
            const auto after = receiver.read_clock();
            receiver.stop();
            for (const ReceivedFrame& f : frames) {
                if (!before || !after) break;
                const std::int64_t offset = before->offset_ns + (after->offset_ns - before->offset_ns) / 2;
                const auto device_ns = static_cast<std::int64_t>(f.device_ns);
                to_first.push_back(static_cast<double>(f.first_packet_ns - device_ns - offset) * 1e-6);
                to_complete.push_back(static_cast<double>(f.complete_ns - device_ns - offset) * 1e-6);
            }
        }
        const CameraCounters counters = daemon.camera().counters();
        daemon.stop();
        report_.add("rate_hz", "triggers", std::optional(rate_hz_), "Hz", 1);
        report_.add("frames", "frames received", static_cast<std::int64_t>(received));
        report_.add("lost", "lost", static_cast<std::int64_t>(lost_));
        report_.add("missed_triggers", "triggers missed while the camera was busy",
                    static_cast<std::int64_t>(counters.missed_triggers));
        report_.add("late", "frames with late rows", static_cast<std::int64_t>(counters.late));
        report_.add("trigger_to_first_packet_ms_p50", "trigger to first packet, p50",
                    percentile(to_first, 50), "ms", 3);
        report_.add("trigger_to_first_packet_ms_p99", "trigger to first packet, p99",
                    percentile(to_first, 99), "ms", 3);
        report_.add("trigger_to_complete_ms_p50", "trigger to complete, p50", percentile(to_complete, 50),
                    "ms", 3);
        report_.add("trigger_to_complete_ms_p99", "trigger to complete, p99", percentile(to_complete, 99),
                    "ms", 3);
        return !host::interrupted();
    }

    std::string config_;
    std::uint64_t frames_ = 20;
    double rate_hz_ = 5;
    std::int32_t threads_ = 0;
    bool json_ = false;

    Report report_;
    std::uint64_t lost_ = 0;
};

} // namespace

std::unique_ptr<Verb> make_bench() {
    return std::make_unique<Bench>();
}

} // namespace obscura::tools
