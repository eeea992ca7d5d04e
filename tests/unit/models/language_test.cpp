// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "models/model/model.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <chrono>
#include <string>

namespace language_test {

using namespace obscura;
using namespace obscura::models;

namespace {

/// brdf() with `body`, behind `before`.
std::string law(std::string_view body, std::string_view before = "") {
    return fmt::format(
        "{}\nvec4 brdf(vec3 i, vec3 e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess) {{\n{}\n}}\n",
        before, body);
}

/// The lines of the refusal of `text`; empty: it is allowed.
std::string refusal(std::string text) {
    try {
        (void)Model::parse("m.brdf", std::move(text));
        return "";
    } catch (const ConfigError& error) {
        return error.what();
    }
}
std::string refusal_of_body(std::string_view body) {
    return refusal(law(body));
}

std::string repeated(std::string_view text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i)
        all += text;
    return all;
}

} // namespace

TEST_CASE("declarations have types, defaults and what their comments say", "[models]") {
    const auto model = Model::parse(
        "m.brdf", law("return diffuse * w;", "property has_mirror_component true;\n"
                                             "property mask 0xFFFF; // an unknown one\n"
                                             "parameter w 0.11; //! , 0..1, Single-scattering albedo, mean\n"
                                             "parameter tilt -2.5; //! deg, -10..10, Tilt of the sensor\n"
                                             "parameter tint vec4(0.5);\n"
                                             "parameter texture map;\n"
                                             "global gain 2; //! Gain of all models"));
    const auto& p = model->parameters();
    REQUIRE(p.size() == 5);
    CHECK(p[0].name == "w");
    CHECK(p[0].value[0] == 0.11);
    CHECK(p[0].unit.empty());
    CHECK(p[0].max == 1);
    CHECK(p[0].help == "Single-scattering albedo, mean");
    CHECK(p[1].unit == "deg");
    CHECK(p[1].min == -10);
    CHECK(p[1].value[0] == -2.5);
    CHECK(p[2].type == Type::vec4);
    CHECK(p[2].value[3] == 0.5);
    CHECK(p[3].type == Type::texture);
    CHECK(p[4].global);
    CHECK(p[4].help == "Gain of all models");
    REQUIRE(model->properties().size() == 2);
    CHECK(model->properties()[1].value == 65535);
    CHECK(model->warnings() == "m.brdf:2:10: the property 'mask' is not known and has no effect");
}

TEST_CASE("all mistakes of a text are told, each with its place and the nearest name", "[models]") {
    CHECK(refusal("parameter albedo 0.1\n"
                  "vec4 brdf(vec3 $i, vec3 $e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess)\n"
                  "{\n"
                  "    scalar mu0 = (i | n);\n"
                  "    scalar x = mu1 + sinn(1);\n"
                  "    int k = 3;\n"
                  "    vec2 v = vec3(1, 2, 3);\n"
                  "    return vec4(mu0) * y;\n"
                  "}\n"
                  "scalar unused(scalar a) { return a.x; }\n") ==
          "m.brdf:1:21: ';' is missing behind 'albedo'\n"
          "m.brdf:5:16: 'mu1' is not declared; did you mean \"mu0\"?\n"
          "m.brdf:6:5: 'int' is not used in SuMoL: write scalar\n"
          "m.brdf:7:14: 'v' is vec2, this is vec3\n"
          "m.brdf:8:24: 'y' is not declared\n"
          "m.brdf:10:36: scalar has no components");
}

TEST_CASE("a text that is no model is refused with what is wrong", "[models]") {
    const auto [body, expected] = GENERATE(table<std::string, std::string>({
        {"", "m.brdf:2:6: 'brdf' has a way to its end without return"},
        {"if (shininess > 1) return diffuse;", "m.brdf:2:6: 'brdf' has a way to its end without return"},
        {"scalar a; return diffuse * a;", "m.brdf:3:28: 'a' has no value yet"},
        {"scalar a; if (shininess > 1) a = 1; return diffuse * a;",
         "m.brdf:3:54: 'a' may have no value here: assign it in both branches"},
        {"return i;", "m.brdf:3:8: 'brdf' is vec4, this is vec3"},
        {"return diffuse + i;",
         "m.brdf:3:16: '+' between vec4 and vec3: they need the same size, or one is a scalar"},
        {"return diffuse % 2;", "m.brdf:3:16: '%' is not used in SuMoL: write fmod(a, b)"},
        {"return vec4(1, 2);", "m.brdf:3:8: vec4() has 4 components, here are 2"},
        {"return vec4(i | shininess);",
         "m.brdf:3:15: '|', the dot product, is between vectors of one size, not vec3 and scalar; brackets around it? "
         "It binds weaker than arithmetic"},
        {"shininess = 1 > 2; return diffuse;",
         "m.brdf:3:15: a condition is no number: write condition ? 1 : 0 for 'shininess'"},
        {"return diffuse.xyzww;", "m.brdf:3:16: '.xyzww': allowed are up to 4 of x, y, z, w"},
        {"return vec4(i.w);", "m.brdf:3:15: '.w': vec3 has the components x, y, z"},
        {"while (1) {} return diffuse;",
         "m.brdf:3:1: 'while' is not used in SuMoL: write for, with constant bounds"},
        {"for (scalar k = 0; k < shininess; ++k) {} return diffuse;",
         "m.brdf:3:22: the bounds of a loop must be constants: this condition depends on a parameter or an argument"},
        {"for (scalar k = 0; k < 1; k += 0) {} return diffuse;",
         "m.brdf:3:32: too much work: with all its calls and loops written out the function has more than 20000 expressions"},
        {"return brdf(i, e, n, diffuse, specular, 1);",
         "m.brdf:3:8: 'brdf' calls itself, which is not allowed"},
        {"return diffuse * normalise(i).x;",
         "m.brdf:3:18: there is no function 'normalise'; did you mean \"normalize\"?"},
        {"return diffuse * max(1);", "m.brdf:3:18: max() has 2 arguments, here are 1"},
        {"return diffuse[0];", "m.brdf:3:15: there are no arrays: components are .x .y .z .w"},
        {"return diffuse * 0x1FFFFFFFF;",
         "m.brdf:3:18: '0x1FFFFFFFF' is no number: allowed are 0x0 to 0xFFFFFFFF"},
        {"return diffuse * 1.2.3;", "m.brdf:3:18: '1.2.3' is no number: write for example 0.5 or 1e-3"},
        {"return diffuse * 1e999;", "m.brdf:3:18: '1e999' is no number: write for example 0.5 or 1e-3"},
        {"return diffuse @ 2;",
         "m.brdf:3:16: '@' is not used in SuMoL\nm.brdf:3:18: ';' is missing behind the statement, found '2'"},
        {"/* return diffuse;",
         "m.brdf:2:82: '{' has no '}'\nm.brdf:3:1: the comment has no end: */ is missing"},
    }));
    INFO(body);
    const std::string text = refusal_of_body(body);
    CHECK((text == expected || text.find(expected) != std::string::npos));
    CHECK(text.find('\x01') == std::string::npos);
}

TEST_CASE("a file without the functions of its kind is refused", "[models]") {
    CHECK(refusal("scalar f() { return 1; }")
              .starts_with("m.brdf:1:1: the function vec4 brdf(vec3 i, vec3 e, vec3 n, "));
    CHECK(refusal("scalar brdf(vec3 i) { return 1; }").starts_with("m.brdf:1:8: 'brdf' must be vec4 brdf("));
    try {
        (void)Model::parse("m.txt", "");
        FAIL("allowed");
    } catch (const ConfigError& error) {
        CHECK(std::string_view(error.what())
                  .starts_with(
                      "m.txt:1:1: the ending of the file's name says no kind of model: allowed are .brdf, "));
    }
}

TEST_CASE("hostile texts are refused soon", "[models]") {
    const auto [what, text] = GENERATE(table<std::string, std::string>({
        {"brackets", law("return vec4(" + repeated("(", 60'000))},
        {"signs", law("return vec4(" + repeated("-", 60'000) + "1);")},
        {"not", law("return vec4(" + repeated("!", 60'000) + "1);")},
        {"sums", law("return vec4(1" + repeated("+1", 30'000) + ");")},
        {"members", law("return vec4(i" + repeated(".x", 20'000) + ");")},
        {"conditions", law("return vec4(" + repeated("1?", 20'000) + ");")},
        {"blocks", law(repeated("{", 60'000))},
        {"branches", law(repeated("if (1) ", 9'000))},
        {"else", law(repeated("if (1); else ", 4'500))},
        {"nested calls", law("return vec4(" + repeated("sin(", 15'000))},
        {"no end", law("return vec4(1" + repeated(",1", 30'000))},
        {"long name", law("return " + std::string(60'000, 'a') + ";")},
        {"too long", law("return diffuse;") + std::string(100'000, ' ')},
        {"many errors", law(repeated("x;", 30'000))},
        {"bytes", std::string("\x80\xff\x01\x00;", 5) + std::string(60'000, '\xc3')},
        {"nested loops", law("scalar s = 0; for (scalar a = 0; a < 4000; ++a) for (scalar b = 0; b < 4000; ++b) s += "
                             "a * shininess; return vec4(s);")},
        {"doubling",
         [] {
             std::string before = "scalar f0(scalar x) { return sin(x) + cos(x); }\n";
             for (int i = 1; i < 40; ++i)
                 before += fmt::format("scalar f{0}(scalar x) {{ return f{1}(x) + f{1}(x + {0}); }}\n", i, i - 1);
             return law("return diffuse * f39(shininess);", before);
         }()},
    }));
    INFO(what);
    const auto begin = std::clock();
    CHECK_FALSE(refusal(text).empty());
    // Processor time of this process: 50 ms are asked for, more here for sanitizers and slow machines.
    CHECK(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC < 2);
}

} // namespace language_test
