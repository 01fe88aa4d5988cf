// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "organbake/cutting/cut_body.h"
#include "organbake/cutting/cut_sheet.h"
#include "organbake/cutting/skin_inside.h"

namespace organbake {

// A blade's edge in the world, mm: a segment from its tip to its upper end.
struct Blade {
  Eigen::Vector3d tip_mm, top_mm;
};

struct BladeEdge {
  double width_mm = 0;                      // of the strip of tissue that it takes away
  double fine_mm = CutSheet::kFineSkin_mm;  // of the skin beside its stroke
};

// One blade on its way: adds to the sheet what it sweeps through tissue.
class BladePath {
 public:
  // The tissue lies as `posed` has it. Takes the blade to its next place; the first, and the first
  // after lift(), only puts it there. edge: of the whole stroke as at its beginning.
  void advance(const Blade& to, const BladeEdge& edge, const PosedBody& posed,
               const SkinInside& inside, double reach_mm, CutSheet& sheet);
  void lift() { last_.reset(), cutting_ = false; }

 private:
  using Carriers = std::array<TetrahedronCorner, BladeLine::kPoints>;
  struct Carried {
    BladeLine line;
    Carriers by;
  };
  static std::optional<Carried> carried(const Blade& blade, const PosedBody& posed,
                                        const SkinInside& inside, double reach_mm);
  static BladeLine carried_by(const Carriers& by, const Blade& blade, const PosedBody& posed,
                              const SkinInside& inside, double reach_mm);
  void pass(const Blade& to, const BladeEdge& edge, const PosedBody& posed,
            const SkinInside& inside, double reach_mm, CutSheet& sheet);

  std::optional<Blade> last_;
  Carriers last_by_{};
  bool cutting_ = false;  // the last line was added
  bool entered_ = false;  // it comes from beside the tissue
};

}  // namespace organbake
