// SPDX-License-Identifier: Apache-2.0
// Fuzz target: bytes of a client of the web server, its request parser, and the router with queries and
// bodies.
#include "web/api/routes.hpp"
#include "web/http_request.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <utility>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace obscura::web;
    // No daemon is there, and the log is not written: nothing is changed.
    static const DaemonWatch watch("/nowhere", std::chrono::hours(1));
    static Routes routes(
        [] {
            Tokens tokens;
            tokens.add(Role::admin, "t");
            return Routes::Settings{tokens, OwnNames({}, 80), "0"};
        }(),
        watch);
    auto answer = answer_to(routes, HttpLimits{}, {reinterpret_cast<const char*>(data), size});
    // What needs no daemon is done: a frame that might be kept.
    if (answer && answer->job && answer->job->lane.empty()) {
        const Job job = *std::move(answer->job);
        answer = job.step();
    }
    // Without a daemon nothing can be in progress, and nothing is a fault of the server.
    if (answer && (answer->job || answer->status < 200 || answer->status == 500 || answer->status > 503))
        std::abort();
    return 0;
}
