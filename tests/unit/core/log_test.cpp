#include "core/log.hpp"
#include "tests/support/catch.hpp"

#include <thread>
#include <vector>

using namespace obscura;

TEST_CASE("a full log ring loses records, counts them and never blocks") {
    set_log_level(LogLevel::error); // keep the drained lines off the screen
    LogRing ring;
    int taken = 0;
    for (int i = 0; i < 1100; ++i)
        taken += ring.push({{i}, LogLevel::debug, "record {}", {i}}) ? 1 : 0;
    CHECK(taken == 1024);
    CHECK(ring.lost() == 76);
    CHECK(ring.drain() == 1024);
    CHECK(ring.push({}));
    CHECK(ring.drain() == 1);
    set_log_level(LogLevel::info);
}

TEST_CASE("several producers and one consumer lose nothing while there is room") {
    set_log_level(LogLevel::error);
    LogRing ring;
    std::vector<std::thread> producers;
    for (int t = 0; t < 3; ++t)
        producers.emplace_back([&] {
            for (int i = 0; i < 300; ++i)
                ring.push({{}, LogLevel::debug, "x", {}});
        });
    std::size_t drained = 0;
    while (drained < 900)
        drained += ring.drain();
    for (std::thread& producer : producers)
        producer.join();
    CHECK(drained == 900);
    CHECK(ring.lost() == 0);
    set_log_level(LogLevel::info);
}
