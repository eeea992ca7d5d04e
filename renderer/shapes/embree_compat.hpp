// SPDX-License-Identifier: Apache-2.0
// Compatibility layer over Embree 3 (Debian 12) and Embree 4 (Debian 13).
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace obscura::renderer::embree {

#if RTC_VERSION_MAJOR >= 4

inline RTCIntersectArguments intersect_arguments(bool coherent) {
    RTCIntersectArguments a;
    rtcInitIntersectArguments(&a);
    a.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    return a;
}
inline RTCOccludedArguments occluded_arguments(bool coherent) {
    RTCOccludedArguments a;
    rtcInitOccludedArguments(&a);
    a.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    return a;
}
inline void intersect1(RTCScene s, RTCRayHit& r) {
    auto a = intersect_arguments(false);
    rtcIntersect1(s, &r, &a);
}
inline void intersect8(const int* valid, RTCScene s, RTCRayHit8& r, bool coherent) {
    auto a = intersect_arguments(coherent);
    rtcIntersect8(valid, s, &r, &a);
}
inline void intersect16(const int* valid, RTCScene s, RTCRayHit16& r, bool coherent) {
    auto a = intersect_arguments(coherent);
    rtcIntersect16(valid, s, &r, &a);
}
inline void occluded8(const int* valid, RTCScene s, RTCRay8& r, bool coherent) {
    auto a = occluded_arguments(coherent);
    rtcOccluded8(valid, s, &r, &a);
}
inline void occluded16(const int* valid, RTCScene s, RTCRay16& r, bool coherent) {
    auto a = occluded_arguments(coherent);
    rtcOccluded16(valid, s, &r, &a);
}

#else

inline RTCIntersectContext context(bool coherent) {
    RTCIntersectContext c;
    rtcInitIntersectContext(&c);
    c.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    return c;
}
inline void intersect1(RTCScene s, RTCRayHit& r) {
    auto c = context(false);
    rtcIntersect1(s, &c, &r);
}
inline void intersect8(const int* valid, RTCScene s, RTCRayHit8& r, bool coherent) {
    auto c = context(coherent);
    rtcIntersect8(valid, s, &c, &r);
}
inline void intersect16(const int* valid, RTCScene s, RTCRayHit16& r, bool coherent) {
    auto c = context(coherent);
    rtcIntersect16(valid, s, &c, &r);
}
inline void occluded8(const int* valid, RTCScene s, RTCRay8& r, bool coherent) {
    auto c = context(coherent);
    rtcOccluded8(valid, s, &c, &r);
}
inline void occluded16(const int* valid, RTCScene s, RTCRay16& r, bool coherent) {
    auto c = context(coherent);
    rtcOccluded16(valid, s, &c, &r);
}

#endif

} // namespace obscura::renderer::embree
