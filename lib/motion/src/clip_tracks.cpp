// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/clip_tracks.h"

#include "organbake/core/median.h"

namespace organbake {

TrackedMotion motion_between(const ClipTracks& clip, std::size_t from, std::size_t to) {
  std::vector<float> lengths;
  for (const FeatureTrack& track : clip.tracks)
    if (track.is_in(from) && track.is_in(to))
      lengths.push_back((track.at(to) - track.at(from)).norm());
  if (lengths.empty()) return {};
  const std::size_t features = lengths.size();
  return {median(std::move(lengths)), features};
}

}  // namespace organbake
