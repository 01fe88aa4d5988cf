// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "organbake/phantom/laparoscopy.h"
#include "organbake/stereo/stereo_depth.h"

namespace organbake {

// Pairs of pictures as stereo endoscopes give them on good and on bad days, of tissue whose depth
// is known.
class StereoCases {
 public:
  // One scene of tissue; the kinds below all start from its pictures.
  StereoCases(std::uint64_t seed, int width, int height, bool instrument);

  // What can be wrong with a pair, from nothing to hopeless: "clean", "noise", "rows apart" …
  static const std::vector<std::string>& kinds();

  struct Outcome {
    DepthVerdict verdict = DepthVerdict::failed;
    std::string reason;
    double error = 1;           // median, relative; 1 where there is no depth
    double covered = 0;         // share of the true tissue
    double masked = 0;          // share of the true tissue that is taken for instruments
    double instrument_iou = 1;  // of the mask of instruments, inside the field of view
    double uneven = 0;          // rows, px
    RowAlignment corrected;
    // Of what a person who knew the truth would say.
    bool right() const { return error <= 0.02 && covered >= 0.6; }
    bool wrong() const { return error > 0.05; }
  };
  // `strength`: 0…1, from hardly to hopelessly so.
  Outcome outcome(const std::string& kind, double strength) const;

 private:
  LaparoscopyFrame left_, right_, later_, other_;
  Rectifier rectifier_;
  std::uint64_t seed_;

  StereoCases(const LaparoscopyPhantom& phantom, const LaparoscopyPhantom& textureless,
              std::uint64_t seed);
};

}  // namespace organbake
