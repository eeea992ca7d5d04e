// SPDX-License-Identifier: Apache-2.0
// Main program of obscurad: command line, signals, start-up in order, shut-down in reverse.
#include "core/capabilities.hpp"
#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/io/memory_budget.hpp"
#include "core/io/stop_reading.hpp"
#include "core/io/temporary_name.hpp"
#include "core/realtime/log.hpp"
#include "core/text/printable.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/control/call_server.hpp"
#include "emulator/control/configuration_call.hpp"
#include "emulator/daemon/daemon.hpp"
#include "emulator/daemon/start_progress.hpp"
#include "emulator/daemon/start_watch.hpp"
#include "emulator/monitor/monitor.hpp"
#include "emulator/version.hpp"
#include "host/service_notify.hpp"
#include "host/standard_output.hpp"
#include "images/writers/raw.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace {

using namespace obscura;

struct Options {
    std::string config_file;
    std::string ready_file;
    std::string statistics_file;
    double statistics_interval_s = 0; ///< 0: only when asked and at the end
    std::string timing_file;
    bool check = false;
    bool print_config = false;
};

// Signals are taken one by one in serve(); every thread made later inherits the mask.
sigset_t block_signals() {
    sigset_t set;
    sigemptyset(&set);
    for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2})
        sigaddset(&set, signal);
    pthread_sigmask(SIG_BLOCK, &set, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    return set;
}

/// Whether a signal that ends the daemon waits to be taken.
bool stop_is_pending() {
    sigset_t pending;
    sigemptyset(&pending);
    sigpending(&pending);
    return sigismember(&pending, SIGTERM) == 1 || sigismember(&pending, SIGINT) == 1;
}

/// Makes what the first frames need. False: the daemon is to stop.
bool load_tiles(emulator::Daemon& daemon, emulator::StartProgress& progress) {
    const MonotonicClock clock;
    constexpr std::int64_t between_ns = 5 * ns_per_s;
    Time next = clock.now() + ns_per_s;
    bool advised = false;
    return daemon.load_tiles([&](const char* step, double share) {
        const Time now = clock.now();
        progress.note(step, share, now);
        if (now >= next) {
            const emulator::StartProgress::Report report = progress.report();
            log_info("starting: {}", report.words());
            next = now + between_ns;
            constexpr double long_s = 60;
            if (report.left_s.value_or(0) > long_s && !std::exchange(advised, true))
                log_warning(
                    "starting takes {:.0f} s more: less with cell_px 1 or more, sun_visibility \"traced\" or a larger detail.crater_least_m of the scene's bodies",
                    *report.left_s);
        }
        return !stop_is_pending();
    });
}

// Takes on another configuration as a whole; the old one stays in use if the new one is not valid or not
// reloadable. `by`: who wants it; `what`: the words for it. Returns why nothing has changed; empty: it is in
// use.
std::string reload(emulator::Daemon& daemon, const std::function<emulator::DaemonConfig()>& make,
                   std::string_view by, std::string_view what, const std::function<bool()>& meanwhile) {
    std::string why;
    host::notify_service_manager(
        fmt::format("RELOADING=1\nMONOTONIC_USEC={}", MonotonicClock().now().ns / ns_per_us));
    try {
        const emulator::DaemonConfig next = make();
        const std::string refusal = daemon.reload(next, meanwhile);
        if (refusal.empty()) {
            set_log_level(next.daemon.log_level);
            log_notice("{}: {} taken on", by, what);
        } else {
            why = refusal;
        }
    } catch (const std::bad_alloc&) {
        why = fmt::format("out of memory; {} are left", describe(memory_left()));
    } catch (const std::exception& e) {
        why = e.what();
    }
    if (!why.empty()) log_error("{}: nothing changed: {}", by, why);
    host::notify_service_manager("READY=1");
    return why;
}

/// The file of counters and latencies; empty: none.
class StatisticsFile {
public:
    explicit StatisticsFile(std::string file) : file_(std::move(file)) {
        if (!file_.empty()) remove_left_temporaries(file_);
    }
    /// A file that cannot be written now does not end a daemon that serves; a cause is logged once.
    void write(const emulator::Daemon& daemon) {
        if (file_.empty()) return;
        std::string complaint;
        try {
            images::write_text(file_, daemon.statistics_json());
        } catch (const OutputError& e) {
            complaint = e.what();
        }
        if (complaint == complaint_) return;
        if (complaint.empty())
            log_notice("statistics: {}: written again", file_);
        else
            log_error("statistics: {}", complaint);
        complaint_ = complaint;
    }

private:
    std::string file_, complaint_;
};

// Serves until SIGTERM or SIGINT.
void serve(emulator::Daemon& daemon, emulator::Monitor& monitor, emulator::CallServer& calls,
           const sigset_t& signals, const Options& options) {
    const MonotonicClock clock;
    const std::int64_t watchdog_ns = host::watchdog_interval_ns();
    Time next_beat = clock.now();
    const auto between_statistics_ns =
        static_cast<std::int64_t>(options.statistics_interval_s * static_cast<double>(ns_per_s));
    Time next_statistics = clock.now() + between_statistics_ns;
    StatisticsFile statistics(options.statistics_file);
    const auto mind = [&] {
        daemon.tick();
        monitor.tick();
        calls.tick();
        // Notify the watchdog after a third of its interval, so that one notification may be lost; withhold
        // it when a thread hangs.
        if (watchdog_ns > 0 && clock.now() >= next_beat && daemon.alive()) {
            host::notify_service_manager("WATCHDOG=1");
            next_beat = clock.now() + watchdog_ns / 3;
        }
    };
    for (;;) {
        const timespec tick{0, 100 * ns_per_ms};
        const int signal = sigtimedwait(&signals, nullptr, &tick);
        mind();
        if (signal == SIGTERM || signal == SIGINT) {
            log_notice("{}: stopping", signal == SIGTERM ? "SIGTERM" : "SIGINT");
            return;
        }
        const auto file_again = [&] { return emulator::load_config(options.config_file); };
        if (signal == SIGHUP)
            (void)reload(daemon, file_again, "SIGHUP", options.config_file, [&] {
                mind();
                return !stop_is_pending();
            });
        const auto until = [&](const std::function<bool()>& wanted) {
            return [&mind, &wanted] {
                mind();
                return wanted() && !stop_is_pending();
            };
        };
        calls.serve_requests(
            [&](const std::filesystem::path& file, const std::function<bool()>& wanted) {
                return file == emulator::SceneRequests::configured
                           ? reload(daemon, file_again, "reload", options.config_file, until(wanted))
                           : daemon.reload(emulator::with_scene(daemon.config(), file), until(wanted));
            },
            [&](const config::Value& tables, const std::function<bool()>& wanted) {
                const char* const by = emulator::set_configuration_name;
                return reload(
                    daemon, [&] { return emulator::with_values(daemon.config(), tables, by); }, by,
                    "other values", until(wanted));
            });
        if (signal == SIGUSR1) {
            log_notice("SIGUSR1: {}", daemon.summary());
            statistics.write(daemon);
        }
        if (between_statistics_ns > 0 && clock.now() >= next_statistics) {
            statistics.write(daemon);
            next_statistics = clock.now() + between_statistics_ns;
        }
        if (signal == SIGUSR2) {
            log_notice("SIGUSR2: clients lose control of the cameras");
            daemon.release_control();
        }
    }
}

// Drops the capabilities, after reading files and before opening sockets: devices and addresses need only the
// user's rights and the resource limits.
void give_up_capabilities(const emulator::ThreadPlan& threads) {
    const CapabilityReport report =
        drop_capabilities(replace_by_limits(emulator::highest_priority(threads), threads.render.nice));
    if (!report.why.empty())
        log_warning("capabilities: not all given up: {}", report.why);
    else if (report.had_any)
        log_info("capabilities: given up{}",
                 report.kept != 0 ? " except those for real time, for which no limit could be set instead"
                                  : "");
}

int run(const Options& options) {
    const sigset_t signals = block_signals();
    std::optional<StopReading> stop_reading(stop_is_pending);
    const emulator::DaemonConfig config = emulator::load_config(options.config_file);
    if (options.print_config) {
        std::fputs(emulator::print_config(config).c_str(), stdout);
        return exit_ok;
    }
    set_log_level(config.daemon.log_level);
    // Without a limit of its own, sizes are compared with that of the control group (require_memory).
    if (config.daemon.memory_limit_mib > 0)
        limit_memory(static_cast<std::uint64_t>(config.daemon.memory_limit_mib) << 20);
    if (options.check) {
        for (const emulator::DaemonConfig* camera : config.cameras())
            const emulator::Imaging everything_loads(*camera, 1);
        fmt::print("{}: good\n", options.config_file);
        return exit_ok;
    }
    log_info("obscurad {} starting with {}", emulator::version, config.source.string());
    emulator::StartProgress progress;
    emulator::CallServer calls(config, progress, emulator::version);
    calls.open();
    std::optional<emulator::StartWatch> watch(std::in_place, progress, stop_is_pending);
    progress.note("scene", std::nullopt, MonotonicClock().now());
    emulator::Daemon daemon(config);
    for (std::size_t i = 0; !options.timing_file.empty() && i < daemon.camera_count(); ++i)
        daemon.write_timing_to(options.timing_file + (i == 0 ? "" : fmt::format(".{}", i)), i);
    if (config.daemon.drop_capabilities) calls.pause_for([&] { give_up_capabilities(daemon.threads()); });
    if (!load_tiles(daemon, progress)) {
        log_notice("stopped while tiles were made");
        return exit_ok;
    }
    progress.note("cameras", std::nullopt, MonotonicClock().now());
    daemon.start();
    emulator::Monitor monitor(daemon, emulator::version);
    calls.start(daemon, monitor);
    // Calls end before what they reach, whatever happens.
    const std::unique_ptr<emulator::CallServer, void (*)(emulator::CallServer*)> ends(
        &calls, [](emulator::CallServer* server) { server->stop(); });
    watch.reset();
    const std::string ready = fmt::format("ready {}\n", daemon.address());
    std::fputs(ready.c_str(), stdout);
    std::fflush(stdout);
    if (!options.ready_file.empty()) images::write_text(options.ready_file, ready);
    host::notify_service_manager("READY=1");

    stop_reading.reset();
    serve(daemon, monitor, calls, signals, options);

    host::notify_service_manager("STOPPING=1");
    calls.stop();
    daemon.stop();
    log_line(LogLevel::notice, daemon.summary(), "COUNTERS");
    if (!options.statistics_file.empty())
        images::write_text(options.statistics_file, daemon.statistics_json());
    if (const std::uint64_t lost = daemon.lost_timing_rows(); lost > 0)
        throw OutputError(fmt::format("{}: {} rows are missing, see the log", options.timing_file, lost));
    return exit_ok;
}

} // namespace

int main(int argc, char* argv[]) {
    CLI::App app{
        "The camera emulator: renders a scene on every trigger and streams the frames.\n"
        "Stops on SIGTERM or SIGINT, reloads its configuration on SIGHUP, logs its counters and writes its\n"
        "statistics on SIGUSR1, takes control of its cameras away from their clients on SIGUSR2 (obscura\n"
        "release). "
        "Exit status: 0 success, 64 bad command line, 66 bad input file, 69 interface or\n"
        "device not available, 70 internal error, 74 output cannot be written, 78 bad configuration.",
        "obscurad"};
    Options options;
    app.add_option("-c,--config", options.config_file, "Configuration file (TOML)")
        ->type_name("FILE")
        ->required();
    app.add_flag(
        "--check", options.check,
        "Check the configuration and every file that it names, then exit; opens no device or socket");
    app.add_flag(
        "--print-config", options.print_config,
        "Print the effective configuration: every key with its value, unit, range and meaning; then exit");
    app.add_option("--ready-file", options.ready_file,
                   "Write \"ready ADDRESS:PORT\" to FILE when the cameras accept clients")
        ->type_name("FILE");
    CLI::Option* statistics =
        app.add_option("--stats", options.statistics_file,
                       "Write counters and latencies to FILE (JSON) on SIGUSR1 and when the daemon ends")
            ->type_name("FILE");
    app.add_option("--stats-interval", options.statistics_interval_s,
                   "Write them every SECONDS too; FILE is replaced as a whole")
        ->type_name("SECONDS")
        ->check(CLI::Range(0.1, 86400.0))
        ->needs(statistics);
    app.add_option(
           "--timing", options.timing_file,
           "Write the time stamps of every frame to FILE (CSV, for obscura timing); those of camera[1] to FILE.1 and so on")
        ->type_name("FILE");
    app.set_version_flag("-V,--version", fmt::format("obscurad {}", emulator::version));
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? exit_ok : exit_usage;
    }
    try {
        return host::with_standard_output([&] { return run(options); });
    } catch (const Error& e) {
        // What reads a file may say in words of its own that it was stopped.
        if (stop_is_pending()) {
            log_notice("stopped while files were read");
            return exit_ok;
        }
        print_message(e.what());
        return e.status();
    } catch (const std::bad_alloc&) {
        print_message(
            "out of memory: fewer pool frames (daemon.pool_frames), a smaller sensor or a larger daemon.memory_limit_mib may help");
        return exit_hardware;
    } catch (const std::exception& e) {
        print_message(fmt::format("internal error: {}", e.what()));
        return exit_software;
    }
}
