// SPDX-License-Identifier: Apache-2.0
#pragma once

// From instruments that move to what they have swept through an organ at rest.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "organbake/cutting/cut_body.h"
#include "organbake/cutting/cut_organ.h"
#include "organbake/cutting/cut_sheet.h"
#include "organbake/cutting/cut_skin.h"
#include "organbake/instruments/instrument.h"

namespace organbake {

// An edge that cuts, in the world, mm: a segment from its tip to its upper end.
struct CuttingEdge {
  Eigen::Vector3d tip_mm, top_mm;
};

// Where an instrument's edge cuts to in a time step.
struct CuttingStep {
  std::size_t instrument = 0;
  CuttingEdge edge;
  double width_mm = 0;  // of the strip of tissue that it takes away
  // It is lifted, and put down there first.
  std::optional<CuttingEdge> put_down = {};
};

// What the blades of scissors cut as they close: where their edges cross runs from the pivot to the
// tips, and all that lay between the blades behind it is parted. It is an edge that stands across
// the tool, as long as the opening was there when the blades began to close.
class ClosingScissors {
 public:
  struct Snip {
    std::optional<CuttingEdge> put_down;  // first, where the blades begin to close
    CuttingEdge edge;
  };
  // One step. tip_mm: half-way between the tips; pivot_mm: where the blades hang together;
  // opening_mm: from the one tip to the other. Nothing, unless the opening became less.
  std::optional<Snip> advance(const Eigen::Vector3d& tip_mm, const Eigen::Vector3d& pivot_mm,
                              const Eigen::Vector3d& opening_mm);

 private:
  Eigen::Vector3d opened_mm_ = Eigen::Vector3d::Zero();  // when they began to close
  double last_mm_ = 0;
};

// Where instruments cut, time step by time step: at the edge of each blade, and where scissors
// close. Instruments keep their places in the list.
class CuttingEdges {
 public:
  std::vector<CuttingStep> advance(const std::vector<Instrument>& instruments);
  void forget() { scissors_.clear(); }  // how far scissors were open

 private:
  std::map<std::size_t, ClosingScissors> scissors_;  // by instrument
};

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
  bool lifted() const { return !last_; }

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

// What blades have swept through an organ so far, carried back to the organ at rest.
class BladeSweeps {
 public:
  explicit BladeSweeps(const CutOrgan& organ) : sheet_(organ.clean_sheet()) {}

  // One time step of the edges that cut; those that are not among them are lifted. nodes_mm: where
  // the nodes of the organ's body lie as it hangs together now.
  void advance(std::span<const CuttingStep> steps, const CutOrgan& organ,
               const std::vector<Eigen::Vector3d>& nodes_mm);

  // A needle went through the skin at a place of the world: a hole as wide as the needle, some way
  // down along it. up_needle: unit, from its point.
  void pierce(const Eigen::Vector3d& at_mm, const Eigen::Vector3d& up_needle, double radius_mm,
              const CutOrgan& organ, const std::vector<Eigen::Vector3d>& nodes_mm);

  void set_step(std::size_t step) { sheet_.set_step(step); }  // CutSheet::set_step()
  const CutSheet& sheet() const { return sheet_; }
  // Whether no edge is down: a step without edges then changes nothing.
  bool lifted() const {
    return std::all_of(paths_.begin(), paths_.end(),
                       [](const auto& path) { return path.second.lifted(); });
  }

 private:
  CutSheet sheet_;
  std::map<std::size_t, BladePath> paths_;  // by instrument
};

}  // namespace organbake
