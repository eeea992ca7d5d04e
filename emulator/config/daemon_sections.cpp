// SPDX-License-Identifier: Apache-2.0
#include "emulator/config/daemon_sections.hpp"

#include "core/realtime/realtime.hpp"
#include "host/monitor_paths.hpp"
#include "sync/inputs/ipv4_endpoint.hpp"

#include <fmt/format.h>
#include <netinet/in.h>

#include <cstdlib>
#include <stdexcept>
#include <string_view>

namespace obscura::emulator {
namespace {

constexpr std::string_view automatic_models = "auto";

/// Throws std::invalid_argument unless `listen` is an address like `example`, of the loopback interface if
/// clients need no token.
void check_reach(const std::string& listen, const char* example, bool open) {
    const sockaddr_in address = sync::parse_ipv4_endpoint(listen, 0, example);
    if (open && ntohl(address.sin_addr.s_addr) >> 24 != IN_LOOPBACKNET)
        throw std::invalid_argument(fmt::format(
            "{}: without token_file only addresses of the loopback interface are allowed", listen));
}

} // namespace

using config::key;

config::Section section_of(DaemonSection& s) {
    config::Section section;
    section.name = "daemon";
    section.help = "The service as a whole; shared by all cameras of the file.";
    section.keys = {
        key("log_level", &s.log_level).reloadable().help("Least important log lines that are written"),
        key("realtime", &s.realtime)
            .help(
                "SCHED_FIFO and locked memory. off: never; auto: where permitted; required: do not start without"),
        key("pool_frames", &s.pool_frames).range(3, 256).help("Frames whose memory is allocated at start"),
        key("seed", &s.seed)
            .range(0, 9e15)
            .help(
                "Seed of rendering and temporal noise: the same seed, run and triggers give the same bytes"),
        key("run", &s.run)
            .range(-1, 4294967295)
            .help(
                "Run word of 32 bits, which keys the temporal noise beside the seed and is stated with every frame; "
                "-1: a random one at each start, and the next one at each further acquisition, so that no two acquisitions share their noise"),
        key("scene_time", &s.scene_time)
            .help(
                "Clock of the scene. nominal: frame k shows the scene k - 1 nominal trigger periods after its start, so that it can be rendered again offline; "
                "clock: frames show the scene at the time that has passed since the start; "
                "tai: at the TAI of their trigger edge, from the scene's epoch on; "
                "replay: frame k shows the k-th of scene_times"),
        key("scene_start_s", &s.scene_start_s)
            .unit("s")
            .range(-1e9, 1e9)
            .help("Scene time at which the acquisition starts with scene_time nominal or clock; "
                  "with tai it is added to every scene time"),
        key("scene_rate", &s.scene_rate)
            .range(1e-6, 1e6)
            .help(
                "Seconds of the scene that pass in one second, with scene_time nominal or clock; motion blur grows with it"),
        key("scene_times", config::Path{&s.scene_times, true, true})
            .help(
                "CSV table time_s of the scene times that frames 1, 2, ... show with scene_time = \"replay\"; "
                "after its end the last one holds; empty: none"),
        key("drop_capabilities", &s.drop_capabilities)
            .help("Drop the capabilities of root before the first socket is opened; "
                  "false: keep them, to write to folders of other users or listen on ports below 1024"),
        key("autostart", &s.autostart)
            .help(
                "Start the acquisition with the daemon, as always if no control port is enabled. "
                "A GigE Vision client that takes control stops it and has the camera; "
                "when the client has left or lost control, the settings of the start return and the acquisition runs again"),
        key("memory_limit_mib", &s.memory_limit_mib)
            .unit("MiB")
            .range(0, 1048576)
            .help(
                "Memory that the daemon may take. A scene that needs more is refused; "
                "after a reload the old one stays in use. 0: what the control group of the service allows (MemoryMax=)"),
    };
    section.check = [&s](const config::ReadTable& table) {
        const auto only_with = [&](std::string_view key, bool fits, const char* modes) {
            if (table.has(key) && !fits) table.refuse(key, fmt::format("belongs to scene_time = {}", modes));
        };
        const bool runs = s.scene_time == SceneTime::nominal || s.scene_time == SceneTime::clock;
        only_with("scene_start_s", s.scene_time != SceneTime::replay || s.scene_start_s == 0,
                  "\"nominal\", \"clock\" or \"tai\"");
        only_with("scene_rate", runs || s.scene_rate == 1, "\"nominal\" or \"clock\"");
        only_with("scene_times", s.scene_time == SceneTime::replay || s.scene_times.empty(), "\"replay\"");
        if (s.scene_time != SceneTime::replay) return;
        if (s.scene_times.empty())
            table.refuse("scene_time", "\"replay\" needs scene_times");
        else
            table.refuse_if_thrown("scene_times", [&s] { (void)read_scene_times(s.scene_times); });
    };
    return section;
}

config::Section section_of(RenderSection& s) {
    config::Section section;
    section.name = "render";
    section.help = "Quality and parallelism of the renderer; shared by all cameras of the file.";
    section.keys = {
        key("samples_per_pixel", &s.samples_per_pixel)
            .range(1, 65536)
            .help("Camera rays per pixel that a body may cover"),
        key("target_error", &s.target_error)
            .range(0, 1)
            .help(
                "Relative standard error of a pixel below which no more samples are taken; 0: samples_per_pixel everywhere"),
        key("max_samples_per_pixel", &s.max_samples_per_pixel)
            .range(1, 65536)
            .help("Largest number of samples per pixel with target_error"),
        key("max_instants", &s.max_instants)
            .range(1, 4096)
            .help("Largest number of instants that an exposure is sampled at where something moves; "
                  "1: the middle of the exposure only"),
        key("threads", &s.threads).range(0, 1024).help("Render threads; 0: one per core"),
        key("band_rows", &s.band_rows)
            .range(1, 16384)
            .help("Rows that are rendered together; they are exposed and sent up to 64 at a time"),
        key("ahead", &s.ahead)
            .help(
                "auto: frames are rendered on a thread of their own, and the next one before its trigger where what it shows is known: not with exposure as long as a pulse, or in lockstep; "
                "with automatic exposure once the frame before has been measured. "
                "With scene time nominal or replayed the frames are the same bytes; "
                "with clock or tai the edge is predicted, and poses of a simulator are extrapolated (ahead_tolerance_px). "
                "Takes memory for the light of two frames, of four where edges or poses are predicted. off: rendering begins at the trigger"),
        key("ahead_ms", &s.ahead_ms)
            .unit("ms")
            .range(0, 1e5)
            .help(
                "Rendering begins at most so long before the expected edge, for a simulator whose poses come late: those that have come by then are rendered. "
                "No less than rendering takes, or rows are late. 0: as soon as the frame before is rendered, as are frames whose edge is not known"),
        key("ahead_tolerance_px", &s.ahead_tolerance_px)
            .unit("px")
            .range(0, 10)
            .help(
                "A frame that was rendered for a predicted edge or extrapolated poses is shown if nothing in it has moved by more than this at the true edge and by newer poses; "
                "if by more, but at most a pixel, bodies are reprojected in the groups of 16 rows in which they have, which the frame's quality says; "
                "else it is rendered anew. "
                "Stars and small bodies are always where they are at the true edge"),
    };
    return section;
}

config::Section section_of(DeadlineSection& s) {
    config::Section section;
    section.name = "deadline";
    section.help = "Handling of rows that are not ready when the chip would have read them.";
    section.keys = {
        key("policy", &s.policy)
            .reloadable()
            .help("Effect of a late row on its frame. late: rows leave when they are ready; "
                  "repeat: the rest is copied from the last complete frame; drop: the frame is abandoned; "
                  "partial: the frame ends before the late row"),
        key("grace_us", &s.grace_us)
            .reloadable()
            .unit("us")
            .range(0, 1e7)
            .help("Time after a row's due time before the policy applies; without effect under \"late\""),
        key("spin_us", &s.spin_us)
            .unit("us")
            .range(0, 1000)
            .help(
                "Time before a frame's first row for which the release thread polls the clock instead of sleeping; "
                "under SCHED_FIFO only"),
        key("quality", &s.quality)
            .help(
                "What gives way when rendering takes longer than there is time. hold: the time, rows may be late; "
                "adapt: the quality, groups of 16 rows are rendered at levels from full down to one ray for 16 pixels, each stated with its frame. "
                "Frames of several windows, push-broom sensors, lockstep, camera.readout_timing \"fast\" and offline capture always hold. "
                "Takes memory for the light of four more frames"),
        key("floor", &s.floor)
            .range(0, 10)
            .help(
                "With quality \"adapt\": degraded frames whose estimated error, root mean square over that of the lit pixels, is larger count as failed in the statistics; "
                "0: none"),
        key("reserve_us", &s.reserve_us)
            .unit("us")
            .range(0, 1e6)
            .help(
                "With quality \"adapt\": rows are rendered so much earlier than the detector needs them, at least. "
                "The daemon measures at its start what a frame takes on this machine and keeps an eighth of that, "
                "a tenth of the period at most"),
    };
    return section;
}

config::Section section_of(ThreadsSection& s) {
    const config::Range fifo{0, 98};
    config::Section section;
    section.name = "threads";
    section.help = "SCHED_FIFO priorities (0: SCHED_OTHER) and cores of the threads; shared by all cameras.";
    section.keys = {
        key("trigger_priority", &s.trigger_priority)
            .range(fifo)
            .help("SCHED_FIFO priority of the threads that wait for trigger edges; 0: SCHED_OTHER"),
        key("release_priority", &s.release_priority)
            .range(fifo)
            .help("SCHED_FIFO priority of the row release thread; 0: SCHED_OTHER"),
        key("transmit_priority", &s.transmit_priority)
            .range(fifo)
            .help("SCHED_FIFO priority of the GigE Vision stream thread, the control thread has one more; 0: "
                  "SCHED_OTHER"),
        key("detector_priority", &s.detector_priority)
            .range(fifo)
            .help("SCHED_FIFO priority of the detector thread; 0: SCHED_OTHER"),
        key("pipeline_priority", &s.pipeline_priority)
            .range(fifo)
            .help(
                "SCHED_FIFO priority of the pipeline thread, which takes triggers and plans frames; "
                "0: that of the detector thread, or, if it renders too (render.ahead off), the class of rendering"),
        key("display_priority", &s.display_priority)
            .range(fifo)
            .help("SCHED_FIFO priority of the V4L2 and stimulator threads; 0: SCHED_OTHER"),
        key("trigger_cores", &s.trigger_cores)
            .help("Cores of the trigger threads, like \"2-3,5\"; empty: any"),
        key("release_cores", &s.release_cores)
            .help("Cores of the row release thread, like \"2-3,5\"; empty: any"),
        key("transmit_cores", &s.transmit_cores)
            .help("Cores of the GigE Vision threads, like \"2-3,5\"; empty: any"),
        key("detector_cores", &s.detector_cores)
            .help("Cores of the detector thread, like \"2-3,5\"; empty: any"),
        key("pipeline_cores", &s.pipeline_cores)
            .help("Cores of the pipeline thread, like \"2-3,5\"; empty: those of the render threads"),
        key("display_cores", &s.display_cores)
            .help("Cores of the V4L2 and stimulator threads, like \"2-3,5\"; empty: any"),
        key("render_class", &s.render_class)
            .help(
                "Scheduling class of the threads that render. other, batch: beside other programs, with the share that render_nice gives; "
                "rr, fifo: before all of them, with render_priority"),
        key("render_nice", &s.render_nice)
            .range(-20, 19)
            .help("Nice level of rendering with render_class other or batch; 0: that of the daemon"),
        key("render_priority", &s.render_priority)
            .range(1, 97)
            .help("Priority of rendering with render_class rr or fifo, below those of the other threads"),
        key("render_cores", &s.render_cores)
            .help("Cores of the render threads, like \"2-3,5\"; "
                  "empty: those that no thread with a priority has been given, or any if there are none"),
        key("render_share", &s.render_share)
            .range(0.5, 1)
            .help(
                "With render_class rr or fifo: share of its time that each render thread is at work at most. "
                "Other programs get the rest, a millisecond at a time; "
                "if they got nothing, Linux would take 50 ms of each second from all threads with a priority, and rows would leave late. 1: no rest"),
        key("tiles_share", &s.tiles_share)
            .range(0, 0.5)
            .help(
                "With render_class rr or fifo: share of a core that the thread which makes tiles of terrains takes while frames are rendered, at one priority above them; "
                "0: ordinary scheduling, with what rendering leaves"),
    };
    section.check = [&s, keys = section.keys](const config::ReadTable& table) {
        for (const config::Key& key : keys)
            if (const auto* cores = std::get_if<std::string*>(&key.target);
                cores != nullptr && !parse_cores(**cores))
                table.refuse(key.name, fmt::format("\"{}\" is no list of cores like \"2-3,5\"", **cores));
        if (s.render_class != RenderClass::rr && s.render_class != RenderClass::fifo) return;
        for (const int priority : {s.trigger_priority, s.release_priority, s.transmit_priority,
                                   s.detector_priority, s.display_priority})
            if (priority > 0 && s.render_priority >= priority) {
                table.refuse("render_priority",
                             fmt::format("{} is not below the priorities of the other threads, {}",
                                         s.render_priority, priority));
                break;
            }
    };
    return section;
}

config::Section section_of(SimulatorSection& s) {
    config::Section section;
    section.name = "simulator";
    section.help = "A port through which another program moves the scene and steps the camera in lockstep.";
    section.keys = {
        key("enabled", &s.enabled).help("Accept poses and steps of a dynamics simulator"),
        key("listen", &s.listen)
            .help(
                "IPv4 address and port: "
                "TCP for commands, UDP for poses; of another interface than the loopback only with token_file"),
        key("token_file", config::Path{&s.token_file, true, true})
            .help("File of the token that clients must have, made by obscura serve --make-token; "
                  "no poses come by UDP then; empty: they need none"),
        key("max_extrapolation_ms", &s.max_extrapolation_ms)
            .unit("ms")
            .range(0, 1e6)
            .help("Time for which a motion is extrapolated past its last pose; after that the pose holds"),
    };
    section.check = [&s](const config::ReadTable& table) {
        table.refuse_if_thrown(
            "listen", [&s] { check_reach(s.listen, "127.0.0.1:5003", s.enabled && s.token_file.empty()); });
    };
    return section;
}

config::Section section_of(OutputsSection& s) {
    config::Section section;
    section.name = "outputs";
    section.help = "GPIO lines that the camera drives.";
    section.keys = {
        key("trigger_ready", &s.trigger_ready)
            .help(
                "GPIO line that is active while a trigger would be accepted, by name or \"gpiochipN:OFFSET\"; empty: none"),
        key("exposure", &s.exposure)
            .help(
                "GPIO line that is active from the first row's reset to the last row's readout, by name or \"gpiochipN:OFFSET\"; "
                "empty: none"),
        key("active_low", &s.active_low).help("The active state of these lines is the low level"),
    };
    section.check = [&s](const config::ReadTable& table) {
        if (!s.exposure.empty() && s.exposure == s.trigger_ready)
            table.refuse("exposure", "the same line as trigger_ready");
    };
    return section;
}

bool MonitorSection::keeps_frames() const {
    return frames && socket != host::no_monitor;
}

config::Section section_of(MonitorSection& s) {
    config::Section section;
    section.name = "monitor";
    section.help =
        "The local socket through which programs of this machine look at the daemon, and change nothing.";
    section.keys = {
        key("socket", &s.socket)
            .help(
                "Absolute path of a Unix socket for the user and the group of the daemon, at which clients may make the calls of the permission view, as obscura status and obscura-web do; "
                "auto: a name of its own in the runtime folder, where they find it; off: none"),
        key("frames", &s.frames)
            .help("Hand the newest frames to programs that ask there, for the page of obscura-web; "
                  "takes memory for seven frames more of each camera"),
    };
    section.check = [&s](const config::ReadTable& table) {
        if (s.socket == host::automatic_monitor || s.socket == host::no_monitor) return;
        if (s.socket.empty() || s.socket.front() != '/' || s.socket.size() > host::max_socket_path_bytes())
            table.refuse(
                "socket",
                fmt::format("\"{}\"; allowed are \"auto\", \"off\" and an absolute path of at most {} bytes",
                            s.socket, host::max_socket_path_bytes()));
    };
    return section;
}

std::filesystem::path models_folder(const ModelsSection& section) {
    if (section.folder != automatic_models) return section.folder;
    const char* const state = std::getenv("STATE_DIRECTORY");
    const std::string_view folders = state == nullptr ? "" : state;
    // systemd lists several folders with colons between them.
    return folders.empty() ? std::filesystem::path()
                           : std::filesystem::path(folders.substr(0, folders.find(':'))) / "models";
}

config::Section section_of(ModelsSection& s) {
    config::Section section;
    section.name = "models";
    section.help = "Models written in SuMoL, which scenes name; shared by all cameras of the file.";
    section.keys = {
        key("folder", &s.folder)
            .help(
                "Absolute path of the folder where a scene's models are searched that do not stand beside it, before the shipped ones, and where the call model.put stores them; "
                "auto: the folder models in the state folder of the service, none without a service; empty: none"),
        key("native", &s.native)
            .help(
                "auto: machine code is made of models where the processor has AVX2 or AVX-512 and the system allows it; "
                "off: they are interpreted, which gives the same frames"),
        key("max_ns_per_evaluation", &s.max_ns_per_evaluation)
            .unit("ns")
            .range(0, 1e6)
            .help(
                "Processor time that one evaluation of a model may take, as measured when it is loaded; a scene with a dearer model is refused; "
                "0: any"),
    };
    section.check = [&s](const config::ReadTable& table) {
        if (s.folder.empty() || s.folder == automatic_models || s.folder.front() == '/') return;
        table.refuse("folder",
                     fmt::format("\"{}\"; allowed are \"auto\", \"\" and an absolute path", s.folder));
    };
    return section;
}

config::Section section_of(ControlSection& s) {
    config::Section section;
    section.name = "control";
    section.help = "Where programs call the daemon: they read and change its cameras while these run.";
    section.keys = {
        key("listen", &s.listen)
            .help("IPv4 address and port, like 127.0.0.1:5153; "
                  "of another interface than the loopback only with token_file; empty: none"),
        key("token_file", config::Path{&s.token_file, true, true})
            .help("File of the token that clients of listen must have, made by obscura serve --make-token; "
                  "empty: they need none and may do what scene permits"),
        key("token_permission", &s.token_permission).help("What clients with the token may do"),
        key("unix_socket", &s.unix_socket)
            .help(
                "Absolute path of a Unix socket for the user and the group of the daemon; "
                "auto: calls in the runtime folder of the service, else a name of its own beside the monitor's, where the verbs of obscura find it; "
                "empty: none"),
        key("admin_group", &s.admin_group)
            .help(
                "Group whose members have the permission admin at the Unix socket, as the daemon's user has: they may set features by force while a client of GigE Vision has control, take control away from it, and reload this configuration; "
                "empty: none"),
        key("scenes", config::Path{&s.scenes, false, true})
            .help(
                "Folder below which the scene files stand that the call scene.show may name, beside the shipped ones; "
                "empty: the folder of the scene file"),
        key("clients", &s.clients)
            .range(1, 1000)
            .help("Clients at a time, and two more over the Unix socket; further ones are refused"),
    };
    section.check = [&s](const config::ReadTable& table) {
        if (!s.listen.empty())
            table.refuse_if_thrown("listen",
                                   [&s] { check_reach(s.listen, "127.0.0.1:5153", s.token_file.empty()); });
        if (s.unix_socket.empty() || s.unix_socket == host::automatic_calls) return;
        if (s.unix_socket.front() != '/' || s.unix_socket.size() > host::max_socket_path_bytes())
            table.refuse("unix_socket",
                         fmt::format("\"{}\"; allowed are \"auto\" and an absolute path of at most {} bytes",
                                     s.unix_socket, host::max_socket_path_bytes()));
    };
    return section;
}

} // namespace obscura::emulator
