// SPDX-License-Identifier: Apache-2.0
// Temporary files: those of processes that run no more are removed, all others stay.
#include "core/io/path_state.hpp"
#include "core/io/temporary_name.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

namespace temporary_name_test {

using namespace obscura;

TEST_CASE("temporary files of killed writers are removed, and nothing else is") {
    const test::TempFolder folder;
    const std::filesystem::path target = folder.path() / "state.toml";
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        std::ofstream(temporary_beside(target)) << "half";
        ::_exit(0);
    }
    REQUIRE(::waitpid(child, nullptr, 0) == child); // it runs no more
    const std::filesystem::path left = folder.path() / fmt::format(".state.toml.{}.0.tmp", child);
    REQUIRE(path_exists(left));
    const std::filesystem::path own = temporary_beside(target);
    for (const auto& file :
         {own, target, folder.path() / ".state.toml.x.tmp", folder.path() / ".state.toml..tmp",
          folder.path() / fmt::format(".other.{}.0.tmp", child)})
        std::ofstream(file) << "kept";
    remove_left_temporaries(target);
    CHECK_FALSE(path_exists(left));
    std::error_code error;
    CHECK(paths_in(folder.path(), error).size() == 5);
}

TEST_CASE("questions about odd paths throw nothing") {
    const test::TempFolder folder;
    const std::filesystem::path loop = folder.path() / "loop", name = folder.path() / std::string(300, 'a');
    std::filesystem::create_symlink("loop", loop);
    for (const std::filesystem::path& odd : {loop, loop / "x", name, name / "x"}) {
        CHECK_FALSE(path_exists(odd));
        CHECK_FALSE(is_file_at(odd));
        CHECK_FALSE(is_folder_at(odd));
        CHECK(file_bytes_at(odd) == 0);
        std::error_code error;
        CHECK(paths_in(odd, error).empty());
        CHECK(error);
        CHECK_THROWS_WITH(real_path(odd), Catch::Matchers::StartsWith(odd.string() + ": "));
    }
    // A long name has a temporary one that is not too long.
    std::ofstream(temporary_beside(folder.path() / std::string(250, 'b'))) << "x";
    std::error_code error;
    CHECK(paths_in(folder.path(), error).size() == 2);
}

} // namespace temporary_name_test
