// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "organbake/instruments/instrument.h"
#include "organbake/warp/view.h"

namespace organbake {

// Where the tool is that a pointer put onto the skin and has dragged since, as
// LiveSession::touch() tells. Pixels are those of the picture that was touched.
class PointerTool {
 public:
  // skin_depth_mm: of the skin that the picture shows there.
  PointerTool(const View& touched, const Eigen::Vector2d& at_px, double skin_depth_mm);

  // The tool as it touches the skin. radius_mm: of a ball or a grasper; other kinds have their own.
  Instrument tool(const InstrumentKind& kind, double radius_mm) const;

  void drag(const Eigen::Vector2d& to_px) { pointer_px_ = to_px; }
  void push(double mm) { pushed_mm_ += mm; }  // along the line of sight, away from the eye when > 0

  void move(Instrument& tool);                   // to where it is now; scissors open
  double depth_mm() const { return depth_mm_; }  // below the skin touched, once it was moved
  double opening_mm() const { return opening_mm_; }
  // Along which scissors open, of any length: across the view until they are dragged.
  const Eigen::Vector3d& opens_along() const { return opens_along_; }

 private:
  Eigen::Vector3d dragged_mm() const;
  Eigen::Vector3d position_mm(const Instrument& tool) const;
  void open(Scissors& scissors);

  View touched_;
  Eigen::Vector2d touched_px_, pointer_px_;
  Eigen::Vector3d touched_mm_;  // the skin there, world
  Eigen::Vector3d sight_;       // unit, from the eye to it
  Eigen::Vector3d opens_along_;
  double pushed_mm_ = 0, depth_mm_ = 0, opening_mm_ = 0;
};

}  // namespace organbake
