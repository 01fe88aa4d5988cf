// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbench/suites/frame_timing.h"

#include "player/orbit.h"

namespace organbake {

View view_at(const Bundle& bundle, const FrameSize& size, int frame) {
  constexpr double kPerFrame_rad = 0.05, kDistance = 0.74;
  return orbit_view(bundle.cameras, {.azimuth_rad = kPerFrame_rad * frame, .distance = kDistance},
                    size.width, size.height);
}

double ms_of(const Timing& timing) { return timing.cpu_ms.median / kFrames; }

Timing of_one(Timing timing, std::size_t count) {
  for (Spread* spread : {&timing.wall_ms, &timing.cpu_ms}) {
    for (double* value : {&spread->median, &spread->least, &spread->most}) *value /= double(count);
  }
  return timing;
}

}  // namespace organbake
