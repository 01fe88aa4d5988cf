// SPDX-License-Identifier: GPL-3.0-or-later
// Embree 3 (Debian 12) and Embree 4 (Debian 13) under one name for what differs between them: how a
// query is told that its rays run together.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace organbake {

#if RTC_VERSION_MAJOR >= 4

inline void intersect(const int* valid, RTCScene scene, RTCRayHit8& rays, bool coherent) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  if (coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &rays, &arguments);
}

inline void intersect(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &ray); }

inline void find_occluded(const int* valid, RTCScene scene, RTCRay8& rays, bool coherent) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  if (coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &rays, &arguments);
}

#else

inline RTCIntersectContext query_context(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

inline void intersect(const int* valid, RTCScene scene, RTCRayHit8& rays, bool coherent) {
  RTCIntersectContext context = query_context(coherent);
  rtcIntersect8(valid, scene, &context, &rays);
}

inline void intersect(RTCScene scene, RTCRayHit& ray) {
  RTCIntersectContext context = query_context(false);
  rtcIntersect1(scene, &context, &ray);
}

inline void find_occluded(const int* valid, RTCScene scene, RTCRay8& rays, bool coherent) {
  RTCIntersectContext context = query_context(coherent);
  rtcOccluded8(valid, scene, &context, &rays);
}

#endif

}  // namespace organbake
