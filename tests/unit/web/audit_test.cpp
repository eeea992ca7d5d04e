// SPDX-License-Identifier: Apache-2.0
// Record of changes: order, numbers, what is kept, and the line of the log.
#include "core/realtime/log_history.hpp"
#include "tests/support/catch.hpp"
#include "web/server/audit.hpp"

#include <nlohmann/json.hpp>

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace audit_test {

using namespace obscura;
using namespace obscura::web;
using Json = nlohmann::ordered_json;

namespace {

Change change(Json after) {
    return {"operator alice", "10.0.0.7", "features.set", "7-0", {{"Gain", 0}}, std::move(after)};
}

std::string last_line() {
    const std::vector<LoggedLine> lines = log_history().after(0, LogHistory::lines);
    return lines.empty() ? std::string() : lines.back().text;
}

} // namespace

TEST_CASE("a change is kept with who, what and when, and is a line of the log", "[web]") {
    Audit audit;
    CHECK(audit.list(0) == Json{{"changes", Json::array()}, {"last", 0}});
    audit.note(change({{"Gain", 3.5}}));
    Json list = audit.list(0);
    REQUIRE(list["changes"].size() == 1);
    Json row = list["changes"][0];
    const auto utc = row["utc"].get<std::string>();
    CHECK(utc.size() == std::string("2026-11-24T00:00:00.000Z").size());
    CHECK((utc[4] == '-' && utc[10] == 'T' && utc[19] == '.' && utc.back() == 'Z'));
    row.erase("utc");
    CHECK(row == Json{{"id", 1},
                      {"who", "operator alice"},
                      {"peer", "10.0.0.7"},
                      {"what", "features.set"},
                      {"camera", "7-0"},
                      {"before", {{"Gain", 0}}},
                      {"after", {{"Gain", 3.5}}},
                      {"forced", false}});
    CHECK(last_line() ==
          R"(web: operator alice at 10.0.0.7: features.set of camera 7-0: {"Gain":0} -> {"Gain":3.5})");
    Change forced = change(nullptr);
    forced.forced = true;
    audit.note(std::move(forced));
    CHECK(last_line().find("features.set by force of camera 7-0") != std::string::npos);
    CHECK(audit.list(1)["changes"][0]["forced"] == true);
}

TEST_CASE("changes are listed oldest first from a number on, the oldest go", "[web]") {
    Audit audit;
    const std::uint64_t count = Audit::most + 44;
    for (std::uint64_t i = 1; i <= count; ++i)
        audit.note(change(i));
    const Json all = audit.list(0)["changes"];
    REQUIRE(all.size() == Audit::most);
    for (std::size_t i = 0; i < all.size(); ++i) {
        REQUIRE(all[i]["id"] == count - Audit::most + 1 + i);
        REQUIRE(all[i]["after"] == all[i]["id"]);
    }
    CHECK(audit.list(count - 2)["changes"].size() == 2);
    CHECK(audit.list(count)["changes"].empty());
    CHECK(audit.list(count)["last"] == count);
    // A number of another run, which had come further.
    CHECK(audit.list(count + 1)["changes"].size() == Audit::most);
}

TEST_CASE("bytes that are no UTF-8 do not end the record", "[web]") {
    Audit audit;
    Change odd = change("\xff");
    odd.camera.assign(1, static_cast<char>(0xfe));
    audit.note(std::move(odd));
    CHECK(audit.list(0)["changes"].size() == 1);
}

TEST_CASE("changes of several threads have numbers of their own", "[web]") {
    Audit audit;
    std::vector<std::thread> threads;
    std::atomic<bool> good{true};
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
            for (int i = 0; i < 50; ++i) {
                audit.note(change(i));
                if (audit.list(0)["changes"].empty()) good = false;
            }
        });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(good);
    const Json all = audit.list(0);
    CHECK(all["last"] == 200);
    for (std::size_t i = 0; i < all["changes"].size(); ++i)
        REQUIRE(all["changes"][i]["id"] == i + 1);
}

} // namespace audit_test
