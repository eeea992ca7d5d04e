// SPDX-License-Identifier: Apache-2.0
// Jobs of daemons that answer beside those of daemons that do not.
#include "tests/support/catch.hpp"
#include "web/server/worker.hpp"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace worker_test {

using namespace obscura::web;
using namespace std::chrono_literals;

namespace {

constexpr auto timeout = 60s;

Response answer(unsigned status) {
    Response response;
    response.status = status;
    return response;
}

/// A job that waits until the gate opens, as for a daemon that does not answer.
Job waiting(std::string lane, std::shared_future<void> gate) {
    Job job;
    job.lane = std::move(lane);
    job.step = [gate = std::move(gate)]() -> std::optional<Response> {
        gate.wait();
        return answer(503);
    };
    return job;
}

Job quick(std::string lane) {
    Job job;
    job.lane = std::move(lane);
    job.step = [] { return std::optional(answer(200)); };
    return job;
}

/// Status of the answer; 0: the job was refused.
unsigned done(Worker& worker, Job job) {
    const auto promise = std::make_shared<std::promise<unsigned>>();
    auto status = promise->get_future();
    if (!worker.take(std::move(job), [promise](const Response& r) { promise->set_value(r.status); }))
        return 0;
    return status.wait_for(timeout) == std::future_status::ready ? status.get() : 1;
}

/// Opens when it ends, so that the worker can end.
struct Gate {
    ~Gate() { promise.set_value(); }
    std::promise<void> promise;
    std::shared_future<void> future = promise.get_future().share();
};

} // namespace

TEST_CASE("a job that waits for its daemon holds up no job of another one", "[web]") {
    Worker worker;
    const Gate gate;
    for (std::size_t i = 0; i < Worker::max_jobs; ++i)
        REQUIRE(worker.take(waiting("7", gate.future), [](const Response&) {}));
    CHECK(done(worker, quick("7")) == 0); // no more of that daemon
    CHECK(done(worker, quick("8")) == 200);
    CHECK(done(worker, quick("")) == 200);
}

TEST_CASE("daemons that do not answer take a bounded number of threads", "[web]") {
    Worker worker;
    for (int round = 0; round < 3; ++round) // those without jobs make room
        for (std::size_t i = 0; i < Worker::max_lanes; ++i)
            CHECK(done(worker, quick(std::to_string(round) + " " + std::to_string(i))) == 200);
    const Gate gate;
    for (std::size_t i = 0; i < Worker::max_lanes; ++i)
        REQUIRE(worker.take(waiting(std::to_string(i), gate.future), [](const Response&) {}));
    CHECK(done(worker, quick("one more")) == 0);
}

} // namespace worker_test
