// SPDX-License-Identifier: Apache-2.0
#include "web/api/kept_answers.hpp"

#include "host/sha256.hpp"
#include "web/server/problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::web {
namespace {

bool is_key(std::string_view key) {
    return !key.empty() && key.size() <= KeptAnswers::max_key_bytes &&
           std::all_of(key.begin(), key.end(), [](char c) { return c > ' ' && c <= '~'; });
}

} // namespace

KeptAnswers::Begun KeptAnswers::begin(std::string_view token, std::string_view key, std::string_view command,
                                      Clock::time_point now) {
    constexpr std::string_view header = "Idempotency-Key";
    if (!is_key(key))
        throw Refusal(422, "value",
                      fmt::format("{}: allowed: 1 to {} visible ASCII characters", header, max_key_bytes));
    std::string whose = host::sha256_of(token), what = host::sha256_of(command);
    const std::lock_guard lock(mutex_);
    drop(now, nullptr);
    const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
        return entry.key == key && entry.token == whose;
    });
    if (found == entries_.end()) {
        drop(now, &whose);
        entries_.push_back({++last_id_, std::move(whose), std::string(key), std::move(what), now});
        return {std::nullopt, std::make_shared<Command>(*this, last_id_)};
    }
    if (found->command != what)
        throw Refusal(422, "other-command", fmt::format("{}: this key is that of another command", header));
    if (!found->answer) {
        Refusal refusal(409, "in-progress", "the command with this Idempotency-Key has no answer yet");
        refusal.response.headers.emplace_back("Retry-After", "1");
        throw refusal;
    }
    Response answer = *found->answer;
    answer.headers.emplace_back("Idempotency-Replayed", "true");
    return {std::move(answer), nullptr};
}

void KeptAnswers::end(std::uint64_t id, const Response* response) {
    const std::lock_guard lock(mutex_);
    const auto found =
        std::find_if(entries_.begin(), entries_.end(), [id](const Entry& entry) { return entry.id == id; });
    if (found == entries_.end() || found->answer) return;
    if (response == nullptr || (response->status >= 300 && !response->may_have_acted) ||
        response->body.size() > max_bytes) {
        entries_.erase(found);
        return;
    }
    found->answer = *response;
    bytes_ += response->body.size();
}

void KeptAnswers::drop(Clock::time_point now, const std::string* token) {
    std::size_t of_token = 0;
    for (const Entry& entry : entries_)
        of_token += token != nullptr && entry.token == *token ? 1 : 0;
    for (auto entry = entries_.begin(); entry != entries_.end();) {
        const bool own = token != nullptr && entry->token == *token;
        const bool crowded = token != nullptr && (entries_.size() >= most || bytes_ > max_bytes ||
                                                  (own && of_token >= max_per_token));
        // Those in progress are few: the worker's queues hold no more.
        if (!entry->answer || !(crowded || now - entry->at >= kept_for)) {
            ++entry;
            continue;
        }
        bytes_ -= entry->answer->body.size();
        of_token -= own ? 1 : 0;
        entry = entries_.erase(entry);
    }
}

} // namespace obscura::web
