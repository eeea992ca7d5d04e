// SPDX-License-Identifier: Apache-2.0
// Files for editors of others have the words and endings of the language.
#include "models/language/token_reader.hpp"
#include "models/lowering/lowering.hpp"
#include "models/model/entry_points.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>

namespace editors_test {

using namespace obscura;
using Words = std::set<std::string>;

namespace {

std::string text_of(const std::string& file) {
    std::ifstream in(std::filesystem::path(OBSCURA_SOURCE) / "tools" / "editors" / file);
    return {(std::istreambuf_iterator<char>(in)), {}};
}

/// Words between `begin` behind `behind` and `end`, divided by `divider`.
Words words_in(const std::string& text, const std::string& behind, const std::string& begin,
               const std::string& end, char divider) {
    const std::size_t at = text.find(begin, text.find(behind)) + begin.size();
    std::istringstream in(text.substr(at, text.find(end, at) - at));
    Words words;
    for (std::string word; std::getline(in, word, divider);)
        words.insert(word);
    return words;
}

Words functions() {
    const auto& names = models::built_in_names();
    Words words(names.begin(), names.end());
    for (const models::ModelKind& kind : models::model_kinds())
        for (const models::LookUpFunction& look_up : kind.look_ups)
            words.emplace(look_up.name);
    return words;
}

Words keywords(bool types) {
    Words words;
    for (const std::string_view word : models::keyword_names()) {
        const bool type = word == "scalar" || word == "texture" || word == "void" || word.starts_with("vec");
        if (type == types) words.emplace(word);
    }
    return words;
}

Words constants() {
    const auto& names = models::built_in_constant_names();
    return {names.begin(), names.end()};
}

Words endings() {
    Words words;
    for (const models::ModelKind& kind : models::model_kinds())
        words.emplace(kind.ending);
    return words;
}

} // namespace

TEST_CASE("the files of Visual Studio Code have the words and endings of the language", "[models]") {
    const std::string grammar = text_of("vscode/syntaxes/sumol.tmLanguage.json");
    const auto words = [&](const char* scope) { return words_in(grammar, scope, "\\\\b(", ")\\\\b", '|'); };
    CHECK(words("keyword.control") == keywords(false));
    CHECK(words("storage.type") == keywords(true));
    CHECK(words("support.function") == functions());
    CHECK(words("constant.language") == constants());
    std::string list = text_of("vscode/package.json");
    std::erase_if(list, [](char c) { return c == ' ' || c == '\n' || c == '"'; });
    CHECK(words_in(list, "extensions", "[", "]", ',') == endings());
}

TEST_CASE("the files of vim have the words and endings of the language", "[models]") {
    const std::string syntax = text_of("vim/syntax/sumol.vim");
    const auto words = [&](const std::string& group) {
        return words_in(syntax, "syntax keyword " + group, group + " ", "\n", ' ');
    };
    CHECK(words("sumolKeyword") == keywords(false));
    CHECK(words("sumolType") == keywords(true));
    CHECK(words("sumolFunction") == functions());
    CHECK(words("sumolConstant") == constants());
    std::string list = text_of("vim/ftdetect/sumol.vim");
    std::erase(list, '*');
    CHECK(words_in(list, "autocmd", "BufNewFile ", " ", ',') == endings());
}

} // namespace editors_test
