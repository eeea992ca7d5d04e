// SPDX-License-Identifier: Apache-2.0
// CCSDS messages of trajectories and attitudes: conventions, interpolation, ends, gaps, and what is refused.
#include "core/error.hpp"
#include "ephemeris/time/time_text.hpp"
#include "ephemeris/trajectories/aem.hpp"
#include "ephemeris/trajectories/oem.hpp"
#include "ephemeris/trajectories/sampled_path.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace path_messages_test {

using namespace obscura;
using namespace obscura::ephemeris;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

const LeapSeconds leap_seconds = erfa_leap_seconds();
const Epoch zero = read_time("2007-02-28T00:00:00 TAI", leap_seconds);

/// Circular orbit in the xy plane.
constexpr double radius_m = 7e6, period_s = 5828.5;
constexpr double rate_rad_s = 2 * std::numbers::pi / period_s;

Vec3 on_circle_m(double t_s) {
    return {radius_m * std::cos(rate_rad_s * t_s), radius_m * std::sin(rate_rad_s * t_s), 0};
}

Vec3 velocity_m_s(double t_s) {
    return Vec3{-std::sin(rate_rad_s * t_s), std::cos(rate_rad_s * t_s), 0} * (radius_m * rate_rad_s);
}

/// Time of day of a second of 2007-02-28.
std::string clock_text(int t_s) {
    return fmt::format("2007-02-28T{:02}:{:02}:{:02}", t_s / 3600, t_s / 60 % 60, t_s % 60);
}

std::string oem_segment(int from_s, int to_s, int step_s, const std::string& more = "",
                        const std::string& system = "TAI") {
    std::string text =
        fmt::format("META_START\nOBJECT_NAME = PROBE\nOBJECT_ID = 2006-001A\nCENTER_NAME = Earth\n"
                    "REF_FRAME = EME2000\nTIME_SYSTEM = {}\nSTART_TIME = {}\n{}STOP_TIME = {}\n"
                    "META_STOP\nCOMMENT a circle\n\n",
                    system, clock_text(from_s), more, clock_text(to_s));
    for (int t = from_s; t <= to_s; t += step_s) {
        const Vec3 p = on_circle_m(t) * 1e-3, v = velocity_m_s(t) * 1e-3;
        text += fmt::format("{} {:.12f} {:.12f} {} {:.15f} {:.15f} {}\n", clock_text(t), p.x, p.y, p.z, v.x,
                            v.y, v.z);
    }
    return text;
}

const std::string oem_header =
    "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = 2007-02-27T00:00:00\nORIGINATOR = TEST\n\n";

SampledPath oem_path(const std::string& segments, double max_extrapolation_s = 0) {
    return {parse_oem(oem_header + segments, "f.oem", leap_seconds), zero, max_extrapolation_s};
}

/// The circle as NDM/XML, with positions in `unit`.
std::string xml_oem(const std::string& unit) {
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<oem id=\"CCSDS_OEM_VERS\" version=\"2.0\">\n<header>"
        "<COMMENT>x</COMMENT><CREATION_DATE>2007-02-27T00:00:00</CREATION_DATE><ORIGINATOR>T</ORIGINATOR></header>\n"
        "<body><segment>\n<metadata><OBJECT_NAME>PROBE</OBJECT_NAME><OBJECT_ID>2006-001A</OBJECT_ID>\n"
        "<CENTER_NAME>EARTH</CENTER_NAME><REF_FRAME>EME2000</REF_FRAME><TIME_SYSTEM>TAI</TIME_SYSTEM>\n"
        "<START_TIME>2007-02-28T00:00:00</START_TIME>\n<STOP_TIME> 2007-02-28T00:02:00\t</STOP_TIME></metadata>\n"
        "<data>\n<stateVector>\n";
    for (int t = 0; t <= 120; t += 60) {
        const Vec3 p = on_circle_m(t) * 1e-3, v = velocity_m_s(t) * 1e-3;
        text += fmt::format("<EPOCH>{}</EPOCH>\n<X units=\"{}\">{:.12f}</X><Y>{:.12f}</Y><Z>0</Z><X_DOT "
                            "units=\"km/s\">{:.15f}</X_DOT><Y_DOT>{:.15f}</Y_DOT><Z_DOT>0</Z_DOT>\n{}",
                            clock_text(t), unit, p.x, p.y, v.x, v.y,
                            t < 120 ? "</stateVector><stateVector>" : "</stateVector>");
    }
    return text +
           "<covarianceMatrix><EPOCH>x</EPOCH><CX_X>1</CX_X></covarianceMatrix></data></segment></body></oem>\n";
}

double worst_error_m(const SampledPath& path, double from_s, double to_s) {
    double worst_m = 0;
    for (int i = 0; i <= 1000; ++i) {
        const double t = from_s + (to_s - from_s) * i / 1000;
        worst_m = std::max(worst_m, length(path.position_m(t) - on_circle_m(t)));
    }
    return worst_m;
}

std::string aem(const std::string& keywords, const std::string& lines, const std::string& version = "1.0",
                const std::string& frames = "REF_FRAME_A = EME2000\nREF_FRAME_B = SC_BODY_1\n") {
    return "CCSDS_AEM_VERS = " + version +
           "\nCREATION_DATE = 2007-02-27T00:00:00\nORIGINATOR = TEST\nMETA_START\nOBJECT_NAME = PROBE\n"
           "OBJECT_ID = 2006-001A\n" +
           frames + keywords +
           "TIME_SYSTEM = TAI\nSTART_TIME = 2007-02-28T00:00:00\nSTOP_TIME = 2007-02-28T00:01:00\nMETA_STOP\n"
           "DATA_START\n" +
           lines + "DATA_STOP\n";
}

SampledPath aem_path(const std::string& text, double max_extrapolation_s = 0) {
    return {parse_aem(text, "f.aem", leap_seconds), zero, max_extrapolation_s};
}

/// Components in frame B of a vector given in frame A, by the matrix of CCSDS 504.0-B, section 3.2 (q1, q2,
/// q3 vector part, qc scalar).
Vec3 transformed(double q1, double q2, double q3, double qc, Vec3 a) {
    return {(q1 * q1 - q2 * q2 - q3 * q3 + qc * qc) * a.x + 2 * (q1 * q2 + q3 * qc) * a.y +
                2 * (q1 * q3 - q2 * qc) * a.z,
            2 * (q1 * q2 - q3 * qc) * a.x + (-q1 * q1 + q2 * q2 - q3 * q3 + qc * qc) * a.y +
                2 * (q2 * q3 + q1 * qc) * a.z,
            2 * (q1 * q3 + q2 * qc) * a.x + 2 * (q2 * q3 - q1 * qc) * a.y +
                (-q1 * q1 - q2 * q2 + q3 * q3 + qc * qc) * a.z};
}

void check_near(Vec3 a, Vec3 b, double tolerance) {
    CHECK_THAT(a.x, WithinAbs(b.x, tolerance));
    CHECK_THAT(a.y, WithinAbs(b.y, tolerance));
    CHECK_THAT(a.z, WithinAbs(b.z, tolerance));
}

} // namespace

TEST_CASE("a circle of an OEM is met by each interpolation", "[ephemeris]") {
    // Bounds: |f^(n)| h^n / n! times the nodes' polynomial; linear: R (w h)^2 / 8.
    const double step = rate_rad_s * 60;
    const auto worst_m = [](const std::string& interpolation) {
        return worst_error_m(oem_path(oem_segment(0, 3600, 60, interpolation)), 300, 3300);
    };
    const double linear_m = worst_m("INTERPOLATION = LINEAR\n");
    CHECK(linear_m < 1.01 * radius_m * step * step / 8);
    CHECK(linear_m > 0.9 * radius_m * step * step / 8);
    const double cubic_m = worst_m(""); // Hermite of degree 3: R (w h)^4 / 384
    CHECK(cubic_m < 1.02 * radius_m * std::pow(step, 4) / 384);
    CHECK(cubic_m > 0.9 * radius_m * std::pow(step, 4) / 384);
    CHECK(worst_m("INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = 7\n") < 1e-6);
    CHECK(worst_m("INTERPOLATION = Lagrange\nINTERPOLATION_DEGREE = 9\n") < 1e-5);
    // Near the ends the samples stand to one side.
    CHECK(worst_error_m(
              oem_path(oem_segment(0, 3600, 60, "INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = 7\n")), 0,
              3600) < 1e-5);
    // Fewer samples than the degree wants: all of them.
    CHECK(worst_error_m(
              oem_path(oem_segment(0, 120, 60, "INTERPOLATION = LAGRANGE\nINTERPOLATION_DEGREE = 7\n")), 0,
              120) < 0.3 * radius_m * std::pow(step, 3));
}

TEST_CASE("beyond an OEM the path goes on with its velocity up to a limit, then holds", "[ephemeris]") {
    const SampledPath path = oem_path(oem_segment(60, 600, 60), 10);
    CHECK(path.age_s(60) == 0);
    CHECK(path.age_s(600) == 0);
    CHECK_THAT(path.age_s(604.25), WithinAbs(4.25, 1e-9));
    CHECK_THAT(path.age_s(50), WithinAbs(10, 1e-9));
    check_near(path.position_m(604), on_circle_m(600) + velocity_m_s(600) * 4.0, 1e-6);
    check_near(path.position_m(610), on_circle_m(600) + velocity_m_s(600) * 10.0, 1e-6);
    check_near(path.position_m(1e15), on_circle_m(600) + velocity_m_s(600) * 10.0, 1e-6);
    check_near(path.position_m(57), on_circle_m(60) - velocity_m_s(60) * 3.0, 1e-6);
    check_near(path.position_m(-1e15), on_circle_m(60) - velocity_m_s(60) * 10.0, 1e-6);
    const SampledPath held = oem_path(oem_segment(60, 600, 60));
    check_near(held.position_m(700), on_circle_m(600), 1e-6);
    // Its velocity is that of what it does.
    check_near(path.velocity_m_s(604), velocity_m_s(600), 1e-9);
    check_near(path.velocity_m_s(600), velocity_m_s(600), 1e-9);
    check_near(path.velocity_m_s(57), velocity_m_s(60), 1e-9);
    check_near(path.velocity_m_s(611), {}, 0);
    check_near(held.velocity_m_s(600.5), {}, 0);
    for (const char* kind : {"LINEAR", "HERMITE", "LAGRANGE"}) {
        INFO(kind);
        const SampledPath any = oem_path(
            oem_segment(0, 600, 60, std::string("INTERPOLATION = ") + kind + "\nINTERPOLATION_DEGREE = 7\n"));
        for (const double t : {17.0, 290.0, 583.5})
            check_near(any.velocity_m_s(t), (any.position_m(t + 0.01) - any.position_m(t - 0.01)) / 0.02,
                       1e-5);
    }
}

TEST_CASE("a gap between segments counts as the end of the one before", "[ephemeris]") {
    const SampledPath path = oem_path(oem_segment(0, 300, 60) + "COVARIANCE_START\n1 2 3\nCOVARIANCE_STOP\n" +
                                          oem_segment(420, 600, 60),
                                      5);
    CHECK(path.age_s(300) == 0);
    CHECK_THAT(path.age_s(400), WithinAbs(100, 1e-9));
    CHECK(path.age_s(420) == 0);
    check_near(path.position_m(400), on_circle_m(300) + velocity_m_s(300) * 5.0, 1e-6);
    check_near(path.position_m(450), on_circle_m(450), 1);
    CHECK(path.times_s().size() == 6 + 4);
}

TEST_CASE("useable times bound a segment, and samples beyond them carry the polynomial", "[ephemeris]") {
    const SampledPath path = oem_path(
        oem_segment(0, 600, 60,
                    "USEABLE_START_TIME = 2007-02-28T00:02:30\nUSEABLE_STOP_TIME = 2007-02-28T00:08:00\n"
                    "INTERPOLATION = LAGRANGE\nINTERPOLATION_DEGREE = 7\n"));
    CHECK(path.age_s(150) == 0);
    CHECK_THAT(path.age_s(140), WithinAbs(10, 1e-9));
    CHECK_THAT(path.age_s(490), WithinAbs(10, 1e-9));
    CHECK(worst_error_m(path, 150, 480) < 1e-2);
    check_near(path.position_m(140), on_circle_m(150), 1e-2);
}

TEST_CASE("times of an OEM are in its time system, also across a leap second", "[ephemeris]") {
    // 2007-02-28: TAI - UTC is 33 s; TDB - TT is 1.4 ms.
    const auto tai = oem_path(oem_segment(0, 600, 60));
    for (const auto& [system, later_s] : {std::pair{"UTC", 33.0}, std::pair{"GPS", 19.0},
                                          std::pair{"TT", -32.184}, std::pair{"TDB", -32.185383}}) {
        INFO(system);
        const SampledPath path = oem_path(oem_segment(0, 600, 60, "", system));
        CHECK(length(path.position_m(300 + later_s) - tai.position_m(300)) < 8e3 * 2e-5);
    }
    const std::string leap =
        oem_header +
        "META_START\nOBJECT_NAME = P\nCENTER_NAME = EARTH\nREF_FRAME = ICRF\nTIME_SYSTEM = UTC\n"
        "START_TIME = 2016-12-31T23:59:59\nINTERPOLATION = LINEAR\nSTOP_TIME = 2017-01-01T00:00:00\n"
        "META_STOP\n2016-12-31T23:59:59 0 0 0 1 0 0\n2017-01-01T00:00:00 2 0 0 1 0 0\n";
    const SampledPath path(parse_oem(leap, "f.oem", leap_seconds),
                           read_time("2016-12-31T23:59:59Z", leap_seconds), 0);
    CHECK_THAT(path.position_m(1).x, WithinAbs(1000, 1e-6)); // 23:59:60
    CHECK_THAT(path.position_m(1.5).x, WithinAbs(1500, 1e-6));
}

TEST_CASE("quaternions of an AEM transform from frame A to frame B", "[ephemeris]") {
    const double q1 = 0.1, q2 = -0.3, q3 = 0.5, qc = std::sqrt(1 - 0.01 - 0.09 - 0.25);
    const std::string last = fmt::format("2007-02-28T00:00:00 {} {} {} {:.17g}\n", q1, q2, q3, qc);
    const std::string first = fmt::format("2007-02-28T00:00:00 {:.17g} {} {} {}\n", qc, q1, q2, q3);
    const std::string type = "ATTITUDE_TYPE = QUATERNION\n",
                      body = "REF_FRAME_A = SC_BODY_1\nREF_FRAME_B = ICRF\n";
    const Vec3 v{1, 2, 3};
    const Vec3 direct = transformed(q1, q2, q3, qc, v), reversed = transformed(-q1, -q2, -q3, qc, v);
    // orientation() turns vectors of the object's frame into the inertial one.
    const auto into_object = [&](const std::string& text) {
        return rotate(conjugate(aem_path(text).orientation(0)), v);
    };
    check_near(into_object(aem(type + "ATTITUDE_DIR = A2B\nQUATERNION_TYPE = LAST\n", last)), direct, 1e-12);
    check_near(into_object(aem(type + "ATTITUDE_DIR = A2B\nQUATERNION_TYPE = FIRST\n", first)), direct,
               1e-12);
    check_near(into_object(aem(type, last, "2.0")), direct, 1e-12);
    check_near(into_object(aem(type + "ATTITUDE_DIR = B2A\n", last)), reversed, 1e-12);
    check_near(into_object(aem(type, last, "2.0", body)), reversed, 1e-12);
    check_near(into_object(aem(type + "ATTITUDE_DIR = B2A\n", last, "1.0", body)), direct, 1e-12);
    CHECK(parse_aem(aem(type, last), "f.aem", leap_seconds).frames.frame == "EME2000");
    CHECK(parse_aem(aem(type, last, "2.0", body), "f.aem", leap_seconds).frames.of_frame == "SC_BODY_1");
}

TEST_CASE("an attitude turns on with its rates, stated in any way", "[ephemeris]") {
    // A turn of 1 deg/s about z of both frames after one of 90 deg about x, seen from the inertial frame.
    constexpr double degree = std::numbers::pi / 180;
    const Quat at_0 = axis_angle({1, 0, 0}, 90 * degree);
    const auto turned = [&](double t_s) { return at_0 * axis_angle({0, 0, 1}, t_s * degree); };
    const auto difference_rad = [](Quat a, Quat b) {
        const Quat d = conjugate(a) * b;
        return 2 * length(Vec3{d.x, d.y, d.z});
    };
    const auto lines = [&](const std::string& rates) {
        std::string text;
        for (int t = 0; t <= 60; t += 20) {
            // Rates of either sign.
            const Quat q = turned(t), dot = q * Quat{0, 0, 0, degree / 2};
            const double sign = t == 20 ? -1 : 1;
            text += fmt::format("2007-02-28T00:{:02}:{:02} {:.15f} {:.15f} {:.15f} {:.15f} ", t / 60, t % 60,
                                sign * q.x, sign * q.y, sign * q.z, sign * q.w);
            text += rates == "dot" ? fmt::format("{:.15f} {:.15f} {:.15f} {:.15f}\n", sign * dot.x,
                                                 sign * dot.y, sign * dot.z, sign * dot.w)
                                   : rates + "\n";
        }
        return text;
    };
    const std::string derivative = aem("ATTITUDE_TYPE = QUATERNION/DERIVATIVE\n", lines("dot"));
    const std::string in_b =
        aem("ATTITUDE_TYPE = QUATERNION/ANGVEL\nANGVEL_FRAME = SC_BODY_1\n", lines("0 0 1"), "2.0");
    const std::string in_a =
        aem("ATTITUDE_TYPE = QUATERNION/RATE\nRATE_FRAME = REF_FRAME_A\n", lines("0 -1 0"));
    const std::string not_stated = aem("ATTITUDE_TYPE = QUATERNION\n", lines(""));
    const std::string lagrange = aem("ATTITUDE_TYPE = QUATERNION\nINTERPOLATION_METHOD = LAGRANGE\n"
                                     "INTERPOLATION_DEGREE = 3\n",
                                     lines(""));
    for (const std::string& text : {derivative, in_b, in_a, not_stated, lagrange}) {
        const SampledPath path = aem_path(text, 30);
        INFO(text);
        const double tolerance = text == lagrange ? 1e-3 : 1e-9;
        for (const double t : {0.0, 7.0, 20.0, 33.5, 60.0})
            CHECK(difference_rad(path.orientation(t), turned(t)) < tolerance);
        CHECK(difference_rad(path.orientation(75), turned(75)) < 1e-9);
        CHECK(difference_rad(path.orientation(-5), turned(-5)) < 1e-9);
        CHECK(difference_rad(path.orientation(1000), turned(90)) < 1e-9);
        CHECK_THAT(norm(path.orientation(33.3)), WithinAbs(1, 1e-12));
        CHECK_THAT(path.age_s(75), WithinAbs(15, 1e-9));
    }
    // Frame A in B: the same turn the other way round.
    std::string reversed;
    for (int t = 0; t <= 60; t += 20) {
        const Quat q = conjugate(turned(t));
        reversed += fmt::format("2007-02-28T00:{:02}:{:02} {:.15f} {:.15f} {:.15f} {:.15f} 0 0 -1\n", t / 60,
                                t % 60, q.x, q.y, q.z, q.w);
    }
    const SampledPath path = aem_path(aem("ATTITUDE_TYPE = QUATERNION/ANGVEL\nANGVEL_FRAME = SC_BODY_1\n",
                                          reversed, "2.0", "REF_FRAME_A = SC_BODY_1\nREF_FRAME_B = J2000\n"),
                                      30);
    CHECK(difference_rad(path.orientation(75), turned(75)) < 1e-9);
}

TEST_CASE("Messages in XML are those in keyword = value notation", "[ephemeris]") {
    const SampledPath kvn = oem_path(oem_segment(0, 120, 60));
    const SampledPath xml{parse_oem(xml_oem("km"), "f.oem", leap_seconds), zero, 0};
    for (const double t : {0.0, 31.5, 60.0, 119.0})
        CHECK(length(kvn.position_m(t) - xml.position_m(t)) < 1e-9);
    // One of several forms of attitudes; the scalar stands last in the text and first by QUATERNION_TYPE.
    for (const bool first : {false, true}) {
        std::string states, lines;
        for (int t = 0; t <= 40; t += 20) {
            const double a = 0.01 * t, s = std::sin(a), c = std::cos(a);
            states += fmt::format(
                "<attitudeState><quaternionAngVel><EPOCH>{}</EPOCH><quaternion><Q1>0</Q1><Q2>0</Q2>"
                "<Q3>{:.15f}</Q3><QC>{:.15f}</QC></quaternion><angVel><ANGVEL_X units=\"deg/s\">0"
                "</ANGVEL_X><ANGVEL_Y>0</ANGVEL_Y><ANGVEL_Z>{:.15f}</ANGVEL_Z></angVel>"
                "</quaternionAngVel></attitudeState>\n",
                clock_text(t), s, c, 0.02 * 180 / std::numbers::pi);
            const std::string q =
                first ? fmt::format("{:.15f} 0 0 {:.15f}", c, s) : fmt::format("0 0 {:.15f} {:.15f}", s, c);
            lines += fmt::format("{} {} 0 0 {:.15f}\n", clock_text(t), q, 0.02 * 180 / std::numbers::pi);
        }
        const std::string order = first ? "FIRST" : "LAST";
        const std::string text =
            "<?xml version=\"1.0\"?>\n<ndm>\n<!-- c --><aem id=\"CCSDS_AEM_VERS\" version=\"2.0\"><header><CREATION_DATE>"
            "2007-02-27T00:00:00</CREATION_DATE><ORIGINATOR>T</ORIGINATOR></header><body><segment><metadata>"
            "<OBJECT_NAME>PROBE</OBJECT_NAME><REF_FRAME_A>EME2000</REF_FRAME_A><REF_FRAME_B>SC_BODY_1</REF_FRAME_B>"
            "<ATTITUDE_TYPE>QUATERNION/ANGVEL</ATTITUDE_TYPE><ANGVEL_FRAME>SC_BODY_1</ANGVEL_FRAME><QUATERNION_TYPE>" +
            order +
            "</QUATERNION_TYPE><TIME_SYSTEM>TAI</TIME_SYSTEM><START_TIME>2007-02-28T00:00:00</START_TIME>"
            "<STOP_TIME>2007-02-28T00:01:00</STOP_TIME></metadata><data><COMMENT>a &lt; b</COMMENT>" +
            states + "</data></segment></body></aem></ndm>\n";
        const SampledPath from_xml{parse_aem(text, "f.aem", leap_seconds), zero, 0};
        const SampledPath from_kvn =
            aem_path(aem("ATTITUDE_TYPE = QUATERNION/ANGVEL\nANGVEL_FRAME = SC_BODY_1\n"
                         "QUATERNION_TYPE = " +
                             order + "\n",
                         lines, "2.0"));
        for (const double t : {0.0, 13.0, 40.0}) {
            CHECK(from_xml.orientation(t) == from_kvn.orientation(t));
            CHECK_THAT(from_xml.orientation(t).z, WithinAbs(std::sin(0.01 * t), 1e-12));
        }
    }
}

TEST_CASE("Hermite's polynomial of attitudes with rates is better than Lagrange's of the same samples",
          "[ephemeris]") {
    // A turn about z whose rate swings: angle = 0.3 sin(t / 10).
    const auto angle = [](double t) { return 0.3 * std::sin(t / 10); };
    std::string with_rates, without;
    for (int t = 0; t <= 60; t += 10) {
        const double s = std::sin(angle(t) / 2), c = std::cos(angle(t) / 2);
        without += fmt::format("{} 0 0 {:.15f} {:.15f}\n", clock_text(t), s, c);
        with_rates += fmt::format("{} 0 0 {:.15f} {:.15f} 0 0 {:.15f}\n", clock_text(t), s, c,
                                  0.03 * std::cos(t / 10.0) * 180 / std::numbers::pi);
    }
    const std::string rates = "ATTITUDE_TYPE = QUATERNION/ANGVEL\nANGVEL_FRAME = SC_BODY_1\n";
    const std::string hermite7 = "INTERPOLATION_METHOD = HERMITE\nINTERPOLATION_DEGREE = 7\n";
    const auto worst = [&](const SampledPath& path) {
        double error = 0;
        for (double t = 15; t <= 45; t += 0.5)
            error = std::max(error, std::abs(2 * std::asin(path.orientation(t).z) - angle(t)));
        return error;
    };
    const double hermite = worst(aem_path(aem(rates + hermite7, with_rates, "2.0")));
    CHECK(hermite < 2e-5);
    // Without rates it is the polynomial of that degree through the attitudes.
    const double lagrange = worst(aem_path(aem(
        "ATTITUDE_TYPE = QUATERNION\nINTERPOLATION_METHOD = LAGRANGE\nINTERPOLATION_DEGREE = 7\n", without)));
    CHECK(worst(aem_path(aem("ATTITUDE_TYPE = QUATERNION\n" + hermite7, without))) == lagrange);
    CHECK(lagrange < 3e-3);
    CHECK(50 * hermite < lagrange);
}

TEST_CASE("Euler angles of an AEM are rotations of the frame in their order", "[ephemeris]") {
    // Components after the frame turns about x, y or z: the matrices of CCSDS 504.0-B, annex on conventions.
    const auto turned = [](char axis, double angle_deg, Vec3 v) {
        const double c = std::cos(angle_deg * std::numbers::pi / 180);
        const double s = std::sin(angle_deg * std::numbers::pi / 180);
        if (axis == '1' || axis == 'X') return Vec3{v.x, c * v.y + s * v.z, c * v.z - s * v.y};
        if (axis == '2' || axis == 'Y') return Vec3{c * v.x - s * v.z, v.y, s * v.x + c * v.z};
        return Vec3{c * v.x + s * v.y, c * v.y - s * v.x, v.z};
    };
    constexpr std::array angles_deg{40.0, -25.0, 110.0};
    const Vec3 v{0.3, -0.5, 0.8};
    for (const std::string sequence : {"321", "ZYX", "312", "123", "313", "ZXZ", "YXY"})
        for (const std::string direction : {"A2B", "B2A"}) {
            CAPTURE(sequence, direction);
            const SampledPath path =
                aem_path(aem("ATTITUDE_TYPE = EULER_ANGLE\nEULER_ROT_SEQ = " + sequence +
                                 "\nATTITUDE_DIR = " + direction + "\n",
                             "2007-02-28T00:00:00 40 -25 110\n2007-02-28T00:01:00 40 -25 110\n"));
            Vec3 components = v;
            for (std::size_t i = 0; i < angles_deg.size(); ++i)
                components = turned(sequence[i], angles_deg[i], components);
            // A is inertial: A2B gives components in the object's frame, B2A in the inertial one.
            const Quat q = path.orientation(30);
            check_near(direction == "A2B" ? rotate(conjugate(q), v) : rotate(q, v), components, 1e-14);
        }
}

TEST_CASE("derivatives of Euler angles and angular velocities go on by the same rotation", "[ephemeris]") {
    // Yaw, pitch, roll: p = f' - y' sin t, q = t' cos f + y' cos t sin f, r = y' cos t cos f - t' sin f
    // (Diebel, Representing attitude, 2006, eq. 74 ff.).
    constexpr double deg = std::numbers::pi / 180;
    const double pitch = -25 * deg, roll = 110 * deg;
    const double yaw_rate = 0.4 * deg, pitch_rate = -0.3 * deg, roll_rate = 0.7 * deg;
    const Vec3 body_rate{roll_rate - yaw_rate * std::sin(pitch),
                         pitch_rate * std::cos(roll) + yaw_rate * std::cos(pitch) * std::sin(roll),
                         yaw_rate * std::cos(pitch) * std::cos(roll) - pitch_rate * std::sin(roll)};
    const std::string sequence = "EULER_ROT_SEQ = 321\n";
    const auto ends = [](const std::string& numbers) {
        return "2007-02-28T00:00:00 " + numbers + "\n2007-02-28T00:01:00 " + numbers + "\n";
    };
    const auto expect = [&](const SampledPath& path) {
        const Quat here = path.orientation(60);
        const Quat expected = here * axis_angle(body_rate, length(body_rate) * 5);
        for (const Vec3 v : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
            check_near(rotate(path.orientation(65), v), rotate(expected, v), 1e-12);
    };
    expect(aem_path(
        aem("ATTITUDE_TYPE = EULER_ANGLE/DERIVATIVE\n" + sequence, ends("40 -25 110 0.4 -0.3 0.7"), "2.0"),
        10));
    expect(aem_path(aem("ATTITUDE_TYPE = EULER_ANGLE/ANGVEL\nANGVEL_FRAME = REF_FRAME_B\n" + sequence,
                        ends(fmt::format("40 -25 110 {:.17g} {:.17g} {:.17g}", body_rate.x / deg,
                                         body_rate.y / deg, body_rate.z / deg)),
                        "2.0"),
                    10));
    // Inertial frame A in B: the object is the frame that the angles lead away from.
    const SampledPath reverse =
        aem_path(aem("ATTITUDE_TYPE = EULER_ANGLE/DERIVATIVE\n" + sequence, ends("40 -25 110 0.4 -0.3 0.7"),
                     "2.0", "REF_FRAME_A = SC_BODY_1\nREF_FRAME_B = EME2000\n"),
                 10);
    const SampledPath forward = aem_path(
        aem("ATTITUDE_TYPE = EULER_ANGLE/DERIVATIVE\n" + sequence, ends("40 -25 110 0.4 -0.3 0.7"), "2.0"),
        10);
    for (const Vec3 v : {Vec3{1, 0, 0}, Vec3{0, 0, 1}})
        check_near(rotate(reverse.orientation(65), v), rotate(conjugate(forward.orientation(65)), v), 1e-12);
    // Rates whose order the standard leaves open are not used: the attitude goes on as between the samples.
    const SampledPath rates =
        aem_path(aem("ATTITUDE_TYPE = EULER_ANGLE/RATE\n" + sequence, ends("40 -25 110 9 9 9")), 10);
    check_near(rotate(rates.orientation(65), {1, 0, 0}), rotate(rates.orientation(60), {1, 0, 0}), 1e-12);
}

TEST_CASE("a spin of an AEM turns evenly over many turns between samples", "[ephemeris]") {
    constexpr double deg = std::numbers::pi / 180;
    // 731.5 deg/s: 121.9 turns between the samples.
    const SampledPath path = aem_path(aem("ATTITUDE_TYPE = SPIN\n", "2007-02-28T00:00:00 40 30 20 731.5\n"
                                                                    "2007-02-28T00:01:00 40 30 350 731.5\n"),
                                      10);
    const Vec3 axis{std::cos(30 * deg) * std::cos(40 * deg), std::cos(30 * deg) * std::sin(40 * deg), 0.5};
    const Vec3 node{-std::sin(40 * deg), std::cos(40 * deg), 0};
    for (const double t : {0.0, 0.3, 17.123, 59.9, 60.0, 64.0}) {
        CAPTURE(t);
        const double angle = (20 + 731.5 * t) * deg;
        const Quat q = path.orientation(t);
        check_near(rotate(q, {0, 0, 1}), axis, 1e-12);
        check_near(rotate(q, {1, 0, 0}), std::cos(angle) * node + std::sin(angle) * cross(axis, node), 1e-9);
    }
    // Retrograde, with an axis that moves, from one sample on.
    const SampledPath slow = aem_path(aem("ATTITUDE_TYPE = SPIN\n", "2007-02-28T00:00:00 40 30 20 -6\n"
                                                                    "2007-02-28T00:01:00 40 31 20 -6\n"));
    check_near(rotate(slow.orientation(30), {0, 0, 1}),
               {std::cos(30.5 * deg) * std::cos(40 * deg), std::cos(30.5 * deg) * std::sin(40 * deg),
                std::sin(30.5 * deg)},
               1e-12);
    check_near(rotate(slow.orientation(15), {1, 0, 0}),
               std::cos(-70 * deg) * node +
                   std::sin(-70 * deg) * cross(rotate(slow.orientation(15), {0, 0, 1}), node),
               1e-12);
}

TEST_CASE("bad messages are refused with file and line", "[ephemeris]") {
    struct Case {
        std::string text;
        const char* message;
    };
    const std::string good = oem_header + oem_segment(0, 120, 60);
    const auto with = [&](const std::string& what, const std::string& instead) {
        std::string text = good;
        const std::size_t at = text.find(what);
        REQUIRE(at != std::string::npos);
        return text.replace(at, what.size(), instead);
    };
    for (const Case& c : {
             Case{"", "f.oem:1: the first line is not \"CCSDS_OEM_VERS = ...\""},
             Case{"<?xml version=\"1.0\"?>", "f.oem:1: not valid XML: No document element found"},
             Case{"<oem>\n<header>", "f.oem:2: not valid XML"},
             Case{"<opm id=\"CCSDS_OPM_VERS\"/>", "f.oem:1: <opm> where <oem> is wanted"},
             Case{"<ndm>\n<oem/>\n<oem/></ndm>", "f.oem:3: a second message, allowed is one in a file"},
             Case{"<oem id=\"CCSDS_OEM_VERS\" version=\"2.0\"/>", "f.oem:1: <oem> without <header>"},
             Case{xml_oem("m"), "f.oem:12: units \"m\", allowed km, km/s"},
             Case{"time_s,x_m\n", "f.oem:1: the first line is not"},
             Case{with("2.0", "4.0"), "f.oem:1: CCSDS_OEM_VERS: version \"4.0\", allowed 1, 2, 3"},
             Case{with("ORIGINATOR", "AUTHOR"), "f.oem:3: keyword \"AUTHOR\", allowed before META_START are"},
             Case{with("CENTER_NAME = Earth\n", ""), "f.oem:12: CENTER_NAME: is missing"},
             Case{with("= TAI", "= SCLK"), "f.oem:10: TIME_SYSTEM: \"SCLK\", allowed UTC, TAI, TT, TDB, GPS"},
             Case{with("START_TIME = 2007", "START_TIME = 2008"),
                  "f.oem:12: STOP_TIME: is before START_TIME"},
             Case{with("STOP_TIME = 2007-02-28T00:02:00", "STOP_TIME = 2007-02-30"),
                  "f.oem:12: STOP_TIME: time \"2007-02-30\": character 9: day 30"},
             Case{with("STOP_TIME = 2007-02-28T00:02:00", "STOP_TIME = 2007-02-28T00:02:00Z"),
                  "f.oem:12: STOP_TIME: time \"2007-02-28T00:02:00Z\": character 20: Z is of UTC, "
                  "TIME_SYSTEM is TAI"},
             Case{with("T00:01:00 ", "T00:00:00 "),
                  "f.oem:17: 2007-02-28T00:00:00 does not come after the sample"},
             Case{with("T00:02:00 ", "T00:00:30 "),
                  "f.oem:18: 2007-02-28T00:00:30 does not come after the sample"},
             Case{with("2007-02-28T00:02:00 ", "2007-02-28T00:03:00 "),
                  "f.oem:18: 2007-02-28T00:03:00 is not between START_TIME and STOP_TIME"},
             Case{with("2007-02-28T00:02:00 ", "2016-12-31T23:59:60 "),
                  "f.oem:18: time \"2016-12-31T23:59:60\": "
                  "character 18: second 60"},
             Case{with("7000.000000000000 ", "nan "), "f.oem:16: \"nan\" is no finite number"},
             Case{with("7000.000000000000 ", "1e400 "), "f.oem:16: \"1e400\" is no finite number"},
             Case{with("7000.000000000000 ", "1e13 "), "f.oem:16: position: allowed are -1e+15 to 1e+15 m"},
             Case{with("7000.000000000000 ", ""), "f.oem:16: 5 numbers after the time, allowed are 6"},
             Case{with("COMMENT a circle", "INTERPOLATION = LINEAR"),
                  "f.oem:14: \"INTERPOLATION\" among the samples"},
             Case{with("TIME_SYSTEM", "INTERPOLATION = SPLINE\nTIME_SYSTEM"),
                  "f.oem:10: INTERPOLATION: \"SPLINE\", allowed LINEAR, LAGRANGE, HERMITE"},
             Case{with("TIME_SYSTEM", "INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = 28\nTIME_SYSTEM"),
                  "f.oem:11: INTERPOLATION_DEGREE: \"28\", allowed 1 to 27"},
             Case{oem_header + oem_segment(0, 60, 60) + oem_segment(30, 90, 60),
                  "f.oem:18: the segment begins before the one before it ends"},
             Case{good + "COVARIANCE_START\n", "f.oem:19: COVARIANCE_START without COVARIANCE_STOP"},
             Case{oem_header + "META_START\nOBJECT_NAME = P\n", "f.oem:6: ends before META_STOP"},
             Case{with("REF_FRAME = EME2000\n", "REF_FRAME = EME2000\nREF_FRAME = ICRF\n"),
                  "f.oem:10: REF_FRAME is given twice"},
         }) {
        INFO(c.text);
        CHECK_THROWS_WITH(parse_oem(c.text, "f.oem", leap_seconds), ContainsSubstring(c.message));
    }
    const std::string quaternion = "ATTITUDE_TYPE = QUATERNION\n", line = "2007-02-28T00:00:00 0 0 0 1\n";
    REQUIRE_NOTHROW(parse_aem(aem(quaternion, line), "f.aem", leap_seconds));
    for (const Case& c : {
             Case{aem(quaternion, "2007-02-28T00:00:00 0 0 0 1.01\n"),
                  "f.aem:15: |q| = 1.01, a unit quaternion"},
             Case{aem(quaternion, "2007-02-28T00:00:00 0 0 0 0\n"), "f.aem:15: |q| = 0, a unit quaternion"},
             Case{aem(quaternion, "2007-02-28T00:00:00 0 0 1\n"), "f.aem:15: 3 numbers after the time"},
             Case{aem(quaternion, line + line),
                  "f.aem:16: 2007-02-28T00:00:00 does not come after the sample"},
             Case{aem("ATTITUDE_TYPE = QUATERNION/RATE\nRATE_FRAME = REF_FRAME_B\n",
                      "2007-02-28T00:00:00 0 0 0 1 0 0 2e6\n"),
                  "f.aem:16: rotation rate: allowed is up to 10000 rad/s"},
             Case{aem(quaternion, ""), "f.aem:4: the segment has no samples"},
             Case{aem("ATTITUDE_TYPE = SPIN/NUTATION\n", line),
                  "f.aem:9: ATTITUDE_TYPE: \"SPIN/NUTATION\", allowed QUATERNION"},
             Case{aem("ATTITUDE_TYPE = EULER_ANGLE\n", line), "f.aem:13: EULER_ROT_SEQ: is missing"},
             Case{aem("ATTITUDE_TYPE = EULER_ANGLE\nEULER_ROT_SEQ = 311\n", line),
                  "f.aem:10: EULER_ROT_SEQ: \"311\", allowed are three axes such as 321 or ZYX"},
             Case{aem("ATTITUDE_TYPE = EULER_ANGLE\nEULER_ROT_SEQ = 3214\n", line),
                  "f.aem:10: EULER_ROT_SEQ: \"3214\""},
             Case{aem("ATTITUDE_TYPE = EULER_ANGLE\nEULER_ROT_SEQ = 321\n", line),
                  "f.aem:16: 4 numbers after the time, allowed for this ATTITUDE_TYPE are 3"},
             Case{aem("ATTITUDE_TYPE = EULER_ANGLE/DERIVATIVE\nEULER_ROT_SEQ = 321\n", line),
                  "f.aem:16: 4 numbers after the time, allowed for this ATTITUDE_TYPE are 6"},
             Case{aem("ATTITUDE_TYPE = EULER_ANGLE\nEULER_ROT_SEQ = 321\n", "2007-02-28T00:00:00 0 0 2e6\n"),
                  "f.aem:16: an angle is beyond 1e6 deg"},
             Case{aem("ATTITUDE_TYPE = SPIN\n", "2007-02-28T00:00:00 0 0 0 2e6\n"),
                  "f.aem:15: rotation rate: allowed is up to 10000 rad/s"},
             Case{aem("ATTITUDE_TYPE = SPIN\nINTERPOLATION_METHOD = LAGRANGE\n", line),
                  "f.aem:10: INTERPOLATION_METHOD: LAGRANGE, allowed with ATTITUDE_TYPE = SPIN is LINEAR"},
             Case{aem(quaternion + "QUATERNION_TYPE = MIDDLE\n", line),
                  "f.aem:10: QUATERNION_TYPE: \"MIDDLE\""},
             Case{aem(quaternion + "INTERPOLATION_METHOD = SPLINE\n", line),
                  "f.aem:10: INTERPOLATION_METHOD: \"SPLINE\""},
             Case{aem("ATTITUDE_TYPE = QUATERNION/RATE\n", line), "f.aem:13: ANGVEL_FRAME: is missing"},
             Case{aem("ATTITUDE_TYPE = QUATERNION/RATE\nANGVEL_FRAME = ICRF\n", line),
                  "f.aem:10: ANGVEL_FRAME: \"ICRF\""},
             Case{aem(quaternion, line).substr(0, aem(quaternion, line).size() - 10),
                  "f.aem:15: ends before DATA_STOP"},
             Case{aem(quaternion, line) + "more\n", "f.aem:17: META_START is wanted here"},
             Case{good, "f.aem:1: the first line is not \"CCSDS_AEM_VERS = ...\""},
         }) {
        INFO(c.text);
        CHECK_THROWS_WITH(parse_aem(c.text, "f.aem", leap_seconds), ContainsSubstring(c.message));
    }
    CHECK_THROWS_WITH(read_oem("/nowhere/x.oem", leap_seconds),
                      ContainsSubstring("/nowhere/x.oem: cannot be read"));
}

TEST_CASE("frames with the axes of the ICRF are known by name", "[ephemeris]") {
    for (const char* name : {"ICRF", "ICRF3", "GCRF", "EME2000", "J2000"})
        CHECK(is_inertial_frame(name));
    for (const char* name : {"", "TOD", "ITRF2000", "J20001", "TEME", "GRC", "ICRF123", "FK4"})
        CHECK_FALSE(is_inertial_frame(name));
}

} // namespace path_messages_test
