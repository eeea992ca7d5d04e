// SPDX-License-Identifier: Apache-2.0
// A file of rows that finds no room: it ends with whole rows, and says where some are missing.
#include "core/error.hpp"
#include "images/writers/row_file.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <string>

namespace row_file_test {

using namespace obscura;

/// Files of this process cannot grow beyond `bytes` while it lives; the kernel writes the part that fits.
class SizeLimit {
public:
    explicit SizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~SizeLimit() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    SizeLimit(const SizeLimit&) = delete;
    SizeLimit& operator=(const SizeLimit&) = delete;

private:
    rlimit before_{};
    void (*handler_)(int);
};

std::string contents(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

TEST_CASE("rows that find no room are missing as a whole, are counted, and have a mark in their place") {
    const test::TempFolder folder;
    const std::filesystem::path file = folder.write("rows.csv", "an older file");
    images::RowFile rows(file);
    rows.add("a,b\n");
    rows.add("1,2\n");
    CHECK(contents(file).empty());
    CHECK(rows.flush());
    CHECK(contents(file) == "a,b\n1,2\n");
    {
        const SizeLimit limit(11);
        rows.add("3,4\n");
        CHECK_FALSE(rows.flush());
        CHECK(contents(file) == "a,b\n1,2\n");
        rows.add("5,6\n");
        rows.add("7,8\n");
        CHECK_FALSE(rows.flush());
        CHECK(rows.lost_rows() == 3);
    }
    rows.add("9,10\n");
    CHECK_FALSE(rows.flush()); // three are missing still
    CHECK(contents(file) == "a,b\n1,2\n# 3 rows are missing here\n9,10\n");
    CHECK(rows.lost_rows() == 3);
}

TEST_CASE("a row that must be there says why it cannot be, and leaves the rows before") {
    const test::TempFolder folder;
    const std::filesystem::path file = folder.path() / "rows.jsonl";
    images::RowFile rows(file);
    rows.write("{\"a\":1}\n");
    {
        const SizeLimit limit(11);
        CHECK_THROWS_WITH(rows.write("{\"a\":2}\n"), file.string() + ": cannot be written: File too large");
        CHECK(contents(file) == "{\"a\":1}\n");
    }
    rows.write("{\"a\":3}\n");
    CHECK(contents(file) == "{\"a\":1}\n{\"a\":3}\n");
}

TEST_CASE("a file of rows that cannot be made is refused with its name and the cause") {
    const test::TempFolder folder;
    CHECK_THROWS_AS(images::RowFile(folder.path()), OutputError);
    CHECK_THROWS_WITH(
        images::RowFile(folder.path() / "none" / "rows.csv"),
        (folder.path() / "none" / "rows.csv: cannot be written: No such file or directory").string());
}

} // namespace row_file_test
