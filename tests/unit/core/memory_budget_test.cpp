// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/io/memory_budget.hpp"
#include "tests/support/catch.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <functional>
#include <new>
#include <string>
#include <vector>

using namespace obscura;

namespace {

[[maybe_unused]] constexpr std::uint64_t mib = 1 << 20;

std::string refusal(std::uint64_t bytes) {
    try {
        require_memory(bytes, "big.fits");
    } catch (const InputError& e) {
        return e.what();
    }
    return {};
}

#ifndef OBSCURA_SANITIZED
/// Runs `test` in a process of its own, whose limits end with it; true if it returned true.
bool in_child(const std::function<bool()>& test) {
    const pid_t child = fork();
    if (child == 0) _exit(test() ? 0 : 1);
    int status = -1;
    waitpid(child, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}
#endif

} // namespace

TEST_CASE("memory beyond every limit is refused before it is allocated", "[core]") {
    CHECK(refusal(1).empty());
    CHECK_THAT(refusal(std::uint64_t{1} << 60), Catch::Matchers::StartsWith("big.fits: needs ") &&
                                                    Catch::Matchers::ContainsSubstring(" left are "));
}

#ifndef OBSCURA_SANITIZED // shadow memory does not fit under such limits
TEST_CASE("the memory limit counts what is allocated already", "[core]") {
    CHECK(in_child([] {
        limit_memory(512 * mib);
        if (!refusal(300 * mib).empty()) return false;
        const std::vector<char> taken(300 * mib, 'x');
        const std::string why = refusal(300 * mib);
        return why.find("the memory limit of the process (512.0 MiB)") != std::string::npos &&
               taken[7] == 'x';
    }));
    CHECK(in_child([] { // the kernel holds the limit where it was not asked for before
        limit_memory(128 * mib);
        try {
            const std::vector<char> too_much(200 * mib, 'x');
            return too_much[1] == 'y';
        } catch (const std::bad_alloc&) {
            return true;
        }
    }));
    CHECK(in_child([] {
        rlimit limit{256 * mib, RLIM_INFINITY};
        setrlimit(RLIMIT_AS, &limit);
        return refusal(300 * mib).find("address space") != std::string::npos;
    }));
    CHECK(in_child([] {
        const std::vector<char> taken(64 * mib, 'x');
        try {
            limit_memory(32 * mib);
        } catch (const ConfigError&) {
            return taken[5] == 'x';
        }
        return false;
    }));
}
#endif
