// SPDX-License-Identifier: Apache-2.0
// Parts of the web server around answers: content coding, answers that are kept, passwords, its own metrics.
#include "tests/support/catch.hpp"
#include "web/api/kept_answers.hpp"
#include "web/live/web_figures.hpp"
#include "web/page/page_files.hpp"
#include "web/server/access.hpp"
#include "web/server/content_coding.hpp"
#include "web/server/problem.hpp"

#include <zlib.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <string_view>
#include <utility>

namespace answers_test {

using namespace obscura::web;
using namespace std::chrono_literals;

namespace {

std::string unzipped(std::string_view bytes, std::size_t size) {
    std::string out(size + 1, '\0'); // one byte more than there should be
    z_stream stream{};
    REQUIRE(::inflateInit2(&stream, 15 + 16) == Z_OK);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    REQUIRE(::inflate(&stream, Z_FINISH) == Z_STREAM_END);
    REQUIRE(stream.avail_in == 0);
    out.resize(stream.total_out);
    ::inflateEnd(&stream);
    return out;
}

/// Status and type of the refusal to begin a command; empty: it was not refused.
std::pair<unsigned, std::string> refusal(KeptAnswers& kept, std::string_view key, std::string_view command) {
    try {
        (void)kept.begin("token", key, command, {});
    } catch (const Refusal& refused) {
        return {refused.response.status, refused.type};
    }
    return {};
}

/// Whether a command with that key would be made; it is not answered.
bool is_new(KeptAnswers& kept, std::string_view token, std::string_view key,
            KeptAnswers::Clock::time_point now) {
    return kept.begin(token, key, "command", now).command != nullptr;
}

void make(KeptAnswers& kept, std::string_view token, std::string_view key, KeptAnswers::Clock::time_point now,
          std::string body = "done") {
    const KeptAnswers::Begun begun = kept.begin(token, key, "command", now);
    REQUIRE(begun.command);
    Response response;
    response.body = std::move(body);
    begun.command->answered(response);
}

} // namespace

TEST_CASE("gzip is for clients that take it", "[web]") {
    for (const char* header : {"gzip", "GZIP", "deflate, gzip;q=0.5", "br;q=1.0, gzip ; q=0.001 , *;q=0", "*",
                               "x-gzip", "identity;q=0.5, *;q=0.1", "gzip;q=1"})
        CHECK(takes_gzip(header));
    for (const char* header : {"", "identity", "gzip;q=0", "gzip;q=0.000", "*;q=0", "gzip;q=0, *", "deflate",
                               "gzip;q=", "gzip;q=x", "gzip;q=-1", "gzip;q=2", "gzip;level=9", "gzipped",
                               ",,;", ";q=1", "gzip;q=nan"})
        CHECK_FALSE(takes_gzip(header));
}

TEST_CASE("a media type has the weight of the closest range that a client takes", "[web]") {
    CHECK(accepted("", "image/png") == 1);
    CHECK(accepted("*/*", "image/png") == 1);
    CHECK(accepted("image/*;q=0.5, */*;q=0.1", "image/png") == 0.5);
    CHECK(accepted("image/*;q=0.5, image/png;q=0.7, */*", "image/png") == 0.7);
    CHECK(accepted("image/png;q=0, */*", "image/png") == 0);
    CHECK(accepted("IMAGE/PNG", "image/png") == 1);
    CHECK(accepted("text/html, application/xhtml+xml, */*;q=0.8", "image/fits") == 0.8);
    CHECK(accepted("application/json; profile=x; q=0.3", "application/json") == 0.3);
    for (const char* header : {"text/html", "image/", "/", "image/pngx", "image", "*",
                               "image/png;q=", "image/png;q=2", "image/png;q=nan", ";;,,", "ima*/png"})
        CHECK(accepted(header, "image/png") == 0);
}

TEST_CASE("what is zipped can be unzipped", "[web]") {
    std::mt19937 dice(3);
    for (const std::size_t size : {0, 1, 17, 4096, 300000}) {
        std::string text(size, 'a'), noise(size, '\0');
        std::generate(noise.begin(), noise.end(), [&dice] { return static_cast<char>(dice()); });
        CHECK(unzipped(gzipped(text), size) == text);
        CHECK(unzipped(gzipped(noise), size) == noise);
    }
    CHECK(gzipped(std::string(300000, 'a')).size() < 1000);
}

TEST_CASE("files of the page are there zipped, too", "[web]") {
    REQUIRE(page_files().size() > 5);
    CHECK(page_version().size() == 16);
    for (const PageFile& file : page_files()) {
        CHECK(unzipped(file.zipped, file.bytes.size()) == file.bytes);
        CHECK(file.hash.size() == 16);
        if (file.path == "/")
            CHECK(file.bytes.find(std::string(page_version()) + "/page.js") != std::string_view::npos);
    }
}

TEST_CASE("a command that is sent again has the answer of the first", "[web]") {
    KeptAnswers kept;
    const KeptAnswers::Clock::time_point start{};
    make(kept, "alice", "k", start);
    const KeptAnswers::Begun again = kept.begin("alice", "k", "command", start + 9min);
    REQUIRE(again.answer);
    CHECK(again.answer->body == "done");
    CHECK(again.answer->headers.back() ==
          std::pair<std::string, std::string>("Idempotency-Replayed", "true"));
    CHECK(is_new(kept, "bob", "k", start));   // another token's key
    CHECK(is_new(kept, "alice", "l", start)); // another key
    CHECK(is_new(kept, "alice", "k", start + 10min));
}

TEST_CASE("keys of a wrong form, of another command and of one in progress are refused", "[web]") {
    KeptAnswers kept;
    for (const std::string& key : {std::string(), std::string("a b"), std::string(129, 'k'),
                                   std::string("\xc3\xa4"), std::string("a\n")})
        CHECK(refusal(kept, key, "c") == std::pair<unsigned, std::string>(422, "value"));
    CHECK(refusal(kept, std::string(128, 'k'), "c").first == 0);
    {
        const KeptAnswers::Begun begun = kept.begin("token", "k", "c", {});
        CHECK(refusal(kept, "k", "c") == std::pair<unsigned, std::string>(409, "in-progress"));
        CHECK(refusal(kept, "k", "d") == std::pair<unsigned, std::string>(422, "other-command"));
    }
    // It ended without an answer.
    CHECK(refusal(kept, "k", "d").first == 0);
}

TEST_CASE("refusals are not kept, unless a daemon may have acted", "[web]") {
    KeptAnswers kept;
    for (const unsigned status : {409U, 422U, 503U}) {
        kept.begin("t", "k", "command", {}).command->answered(problem(status, "x", "y"));
        CHECK(is_new(kept, "t", "k", {}));
    }
    Response lost = problem(503, "answer-lost", "y");
    lost.may_have_acted = true;
    kept.begin("t", "k", "command", {}).command->answered(lost);
    CHECK(kept.begin("t", "k", "command", {}).answer->status == 503);
}

TEST_CASE("kept answers are few and small, and a token does not take the places of others", "[web]") {
    KeptAnswers kept;
    make(kept, "alice", "k", {});
    for (std::size_t i = 0; i < 1000; ++i)
        make(kept, "bob", std::to_string(i), {});
    CHECK_FALSE(is_new(kept, "alice", "k", {}));
    CHECK_FALSE(is_new(kept, "bob", std::to_string(1000 - KeptAnswers::max_per_token), {}));
    CHECK(is_new(kept, "bob", std::to_string(1000 - KeptAnswers::max_per_token - 1), {}));
    for (std::size_t i = 0; i < KeptAnswers::most; ++i)
        make(kept, "token " + std::to_string(i), "k", {});
    CHECK(is_new(kept, "alice", "k", {}));
    // Bodies of half of the room: the third drops the first.
    KeptAnswers large;
    for (const char* key : {"1", "2", "3", "4"})
        make(large, "alice", key, {}, std::string(KeptAnswers::max_bytes / 2, 'x'));
    CHECK(is_new(large, "alice", "1", {}));
    CHECK_FALSE(is_new(large, "alice", "4", {}));
}

TEST_CASE("a password comes from the scheme Basic", "[web]") {
    CHECK(password_of_basic("Basic eDp0b2tlbg==") == "token"); // x:token
    CHECK(password_of_basic("Basic OnQ=") == "t");             // :t
    CHECK(password_of_basic("Basic YTpiOmM=") == "b:c");       // a:b:c
    for (const std::string& header :
         {std::string("Basic "), std::string("Basic"), std::string("Basic eDp0b2tlbg"),
          std::string("Basic !!!!"), std::string("Bearer eDp0b2tlbg=="), std::string("Basic bm9jb2xvbg=="),
          "Basic " + std::string(4000, 'A')})
        CHECK(password_of_basic(header).empty());
}

TEST_CASE("metrics of the server count what was told", "[web]") {
    WebFigures figures;
    CHECK(figures.text().find("requests_total") == std::string::npos); // a family without samples
    figures.answered("state", 200);
    figures.answered("state", 200);
    figures.answered("other", 404);
    figures.sent(1000);
    figures.sent(24);
    figures.pictured(0);
    figures.pictured(3);
    figures.viewer_joined();
    figures.viewer_joined();
    figures.viewer_left();
    const std::string text = figures.text();
    for (const char* line :
         {"obscura_web_viewers 1\n", "obscura_web_frames_total{outcome=\"sent\"} 2\n",
          "obscura_web_bytes_total 1024\n", "obscura_web_frames_total{outcome=\"skipped\"} 3\n",
          "obscura_web_requests_total{route=\"other\",code=\"404\"} 1\n",
          "obscura_web_requests_total{route=\"state\",code=\"200\"} 2\n"})
        CHECK(text.find(line) != std::string::npos);
}

} // namespace answers_test
