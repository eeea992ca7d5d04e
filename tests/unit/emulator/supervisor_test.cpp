// SPDX-License-Identifier: Apache-2.0
// Who feeds the watchdog, and which threads get what they ask for.
#include "core/error.hpp"
#include "emulator/daemon/supervisor.hpp"
#include "emulator/unit/thread_plan.hpp"
#include "tests/support/catch.hpp"

#include <sched.h>

namespace supervisor_test {

using namespace obscura;
using namespace obscura::emulator;

TEST_CASE("the watchdog is fed when every worker has beaten since it was fed last") {
    Heartbeat a("a"), b("b"), idle("never started");
    const Heartbeats workers{&a, &b, &idle};
    Supervisor supervisor;
    a.beat();
    b.beat();
    REQUIRE(supervisor.all_alive(workers, true, Time{0}));
    // One after the other, in several looks: what was seen once counts until all are there.
    a.beat();
    CHECK_FALSE(supervisor.all_alive(workers, true, Time{1}));
    CHECK(supervisor.missed() == "b");
    CHECK_FALSE(supervisor.all_alive(workers, false, Time{2}));
    b.beat();
    CHECK(supervisor.all_alive(workers, false, Time{3}));
    // Anew for the next time.
    CHECK_FALSE(supervisor.all_alive(workers, false, Time{4}));
    CHECK(supervisor.missed() == "pipeline, a, b");
    a.beat();
    b.beat();
    CHECK_FALSE(supervisor.all_alive(workers, false, Time{5}));
    CHECK(supervisor.missed() == "pipeline");
    CHECK(supervisor.all_alive(workers, true, Time{6}));
}

TEST_CASE("a worker in a long call is excused for as long as it said, one that has ended for good") {
    Heartbeat a("a");
    const Heartbeats workers{&a};
    Supervisor supervisor;
    a.beat();
    REQUIRE(supervisor.all_alive(workers, true, Time{0}));
    a.allow_silence_until(Time{100});
    REQUIRE(supervisor.all_alive(workers, true, Time{10}));
    CHECK(supervisor.all_alive(workers, true, Time{99}));
    CHECK_FALSE(supervisor.all_alive(workers, true, Time{100}));
    a.beat();
    CHECK(supervisor.all_alive(workers, true, Time{101}));
    CHECK_FALSE(supervisor.all_alive(workers, true, Time{102}));
    a.rest();
    CHECK(supervisor.all_alive(workers, true, Time{103}));
    // Another one takes its place, as after a reload.
    Heartbeat next("next");
    next.beat();
    CHECK(supervisor.all_alive({&next}, true, Time{104}));
    CHECK_FALSE(supervisor.all_alive({&next}, true, Time{105}));
}

TEST_CASE("lists of cores") {
    CHECK(parse_cores("").value().none());
    CHECK(parse_cores("2-4,7").value().to_ullong() == 0b10011100);
    CHECK(cores_text(parse_cores("7,2-3,4").value()) == "2-4,7");
    CHECK(cores_text({}) == "any");
    for (const char* bad : {"a", "1-", "-1", "1,,2", "1,", "3-1", "1024", "1 2", "99999999999999999999"})
        CHECK_FALSE(parse_cores(bad).has_value());
}

TEST_CASE("threads get the cores they ask for, and it is said when they cannot") {
    const CoreSet permitted = permitted_cores();
    REQUIRE(permitted.any());
    std::size_t core = 0;
    while (!permitted[core])
        ++core;
    CoreSet one;
    one.set(core);
    {
        const PinnedHere pinned(one);
        CHECK(permitted_cores() == one);
        CHECK(sched_getcpu() == static_cast<int>(core));
    }
    CHECK(permitted_cores() == permitted);
    if (permitted[1000]) return;
    CoreSet absent;
    absent.set(1000);
    const RealtimeGrant grant = pin_this_thread(absent);
    CHECK_FALSE(grant.granted);
    CHECK(grant.why.find("1000") != std::string::npos);

    emulator::DaemonConfig config;
    config.daemon.realtime = emulator::RealtimeMode::off;
    config.threads.release_cores = std::to_string(core) + ",1000";
    const ThreadPlan plan = granted_threads(config);
    CHECK(plan.release.cores == one);
    CHECK(highest_priority(plan) == 0);
    config.daemon.realtime = emulator::RealtimeMode::required;
    CHECK_THROWS_AS(granted_threads(config), HardwareError);
    CHECK(highest_priority(configured_threads(config)) == 80);
    config.threads.trigger_priority = 0;
    config.threads.transmit_priority = 90;
    CHECK(highest_priority(configured_threads(config)) == 91); // its control thread
}

TEST_CASE("rendering keeps off the cores of threads with a priority, if any are left") {
    if (!realtime_permitted(81).granted) {
        WARN("skipped: this process may not use SCHED_FIFO");
        return;
    }
    const CoreSet four = parse_cores("0-3").value();
    emulator::DaemonConfig config;
    CHECK(granted_threads(config, four).render.cores.none());
    config.threads.release_cores = "3";
    config.threads.transmit_cores = "2-3";
    CHECK(cores_text(granted_threads(config, four).render.cores) == "0-1");
    // The pipeline thread has the detector's priority, unless it renders itself.
    CHECK(granted_threads(config, four).pipeline.priority == 65);
    CHECK(granted_threads(config, four).pipeline.cores.none());
    config.render.ahead = RenderAhead::off;
    CHECK(granted_threads(config, four).pipeline.priority == 0);
    CHECK(cores_text(granted_threads(config, four).pipeline.cores) == "0-1");
    config.threads.pipeline_cores = "1";
    CHECK(cores_text(granted_threads(config, four).pipeline.cores) == "1");
    // Threads without a priority give way by themselves.
    config.threads.transmit_priority = 0;
    CHECK(cores_text(granted_threads(config, four).render.cores) == "0-2");
    config.threads.detector_cores = "0-2";
    CHECK(granted_threads(config, four).render.cores.none());
    config.threads.render_cores = "3";
    CHECK(cores_text(granted_threads(config, four).render.cores) == "3");
}

TEST_CASE("the class of rendering is as configured, and ordinary without real time") {
    emulator::DaemonConfig config;
    config.daemon.realtime = emulator::RealtimeMode::off;
    config.threads.render_cores = "0";
    RenderScheduling render = granted_threads(config, parse_cores("0").value()).render;
    CHECK(render.policy == RenderClass::other);
    CHECK(render.nice == 0);
    CHECK(cores_text(render.cores) == "0");
    render = configured_threads(config).render;
    CHECK(render.nice == -10);
    CHECK(highest_priority(configured_threads(config)) == 80);
    config.threads.render_class = RenderClass::rr;
    config.threads.render_priority = 90;
    render = configured_threads(config).render;
    CHECK(render.priority == 90);
    CHECK(render.nice == 0);
    CHECK(render.share == 0.93);
    // Tiles are made one above, by a thread that takes its share.
    CHECK(configured_threads(config).tiles.priority == 91);
    CHECK(configured_threads(config).tiles_share == 0.1);
    CHECK(highest_priority(configured_threads(config)) == 91);
    CHECK(granted_threads(config, parse_cores("0").value()).tiles.priority == 0);
    CHECK(granted_threads(config, parse_cores("0").value()).tiles_share == 1);
    config.threads.tiles_share = 0;
    CHECK(configured_threads(config).tiles.priority == 0);
    CHECK(configured_threads(config).tiles_share == 1);
    // More than any process may have.
    RenderScheduling beyond{.policy = RenderClass::fifo, .priority = 100};
    CHECK_FALSE(schedule_this_thread(beyond).granted);
    CHECK(schedule_this_thread(beyond).why.find("fifo") != std::string::npos);
}

} // namespace supervisor_test
