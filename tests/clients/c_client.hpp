// SPDX-License-Identifier: Apache-2.0
// Owners of what the C client makes, and rows of arrays in answers, for tests.
#pragma once

#include "obscura_client.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <utility>

namespace obscura::test {

constexpr double test_timeout_s = 60;

struct Close {
    void operator()(obscura_client* client) const { obscura_close(client); }
    void operator()(obscura_answer* answer) const { obscura_answer_free(answer); }
};
using Client = std::unique_ptr<obscura_client, Close>;
using Answer = std::unique_ptr<obscura_answer, Close>;

/// Row `arrays` of an answer's head.
inline nlohmann::json array_row(nlohmann::json shape, nlohmann::json offset, nlohmann::json bytes,
                                const char* dtype = "<f4") {
    return {{"name", "a"},
            {"dtype", dtype},
            {"shape", std::move(shape)},
            {"offset", std::move(offset)},
            {"codec", "none"},
            {"bytes", std::move(bytes)}};
}

} // namespace obscura::test
