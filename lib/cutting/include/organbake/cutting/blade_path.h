// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "organbake/cutting/cut_sheet.h"
#include "organbake/cutting/cutting_edges.h"
#include "organbake/cutting/posed_body.h"
#include "organbake/cutting/skin_inside.h"

namespace organbake {

// What a stroke leaves of the tissue beside it.
struct StrokeOptions {
  double width_mm = 0;                      // of the strip of tissue that it takes away
  double fine_mm = CutSheet::kFineSkin_mm;  // of the skin beside it
};

// One blade on its way: adds to the sheet what it sweeps through tissue.
class BladePath {
 public:
  // The tissue lies as `posed` has it. Takes the blade to its next place; the first, and the first
  // after lift(), only puts it there. stroke: of all of it as at its beginning.
  void advance(const CuttingEdge& to, const StrokeOptions& stroke, const PosedBody& posed,
               const SkinInside& inside, double reach_mm, CutSheet& sheet);
  void lift() { last_.reset(), cutting_ = false; }

 private:
  using Carriers = std::array<TetrahedronCorner, BladeLine::kPoints>;
  struct Carried {
    BladeLine line;
    Carriers by;
  };
  static std::optional<Carried> carried(const CuttingEdge& blade, const PosedBody& posed,
                                        const SkinInside& inside, double reach_mm);
  static BladeLine carried_by(const Carriers& by, const CuttingEdge& blade, const PosedBody& posed,
                              const SkinInside& inside, double reach_mm);
  void pass(const CuttingEdge& to, const StrokeOptions& stroke, const PosedBody& posed,
            const SkinInside& inside, double reach_mm, CutSheet& sheet);

  std::optional<CuttingEdge> last_;
  Carriers last_by_{};
  bool cutting_ = false;  // the last line was added
  bool entered_ = false;  // it comes from beside the tissue
};

}  // namespace organbake
