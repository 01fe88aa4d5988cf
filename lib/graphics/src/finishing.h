// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"
#include "program.h"
#include "table.h"
#include "targets.h"

namespace organbake {

// What scales depths, of the farthest skin (mm), and of a texel on the nearest; and what fades.
struct PictureScale {
  float reach_mm = 1, texel_mm = 1;
  int fade_px = 0;  // of skin beside the background: SkinFinish::border_fade_px()
  // Where the light at the scope is from the eye, mm, the view's frame; nothing by another light.
  std::optional<Eigen::Vector3f> scope_light_mm;
};

// The passes over the whole picture, after the organs are in it.
class Finishing {
 public:
  explicit Finishing(ShaderDialect dialect);

  // Of targets.resolved; returns the picture that is finished.
  const Targets::Picture& apply(const View& view, const DrawOptions& options, PictureScale scale,
                                Targets& targets);

 private:
  // Draws the next picture from the last one with a program that is in use and set.
  void pass(const Program& program, Targets& targets);
  void fill_holes(PictureScale scale, Targets& targets);
  void fade_borders(int width_px, const std::array<std::uint8_t, 3>& background, Targets& targets);
  void draw_solids(const View& view, const std::vector<Solid>& solids, PictureScale scale,
                   Targets& targets);
  void set_solids(const View& view, const std::vector<Solid>& solids);
  // With a program of tools; `wide`: the solids that tell what box of the picture it may touch.
  void pass_solids(const Program& program, const View& view, const std::vector<Solid>& wide,
                   PictureScale scale, Targets& targets);
  void smooth_outlines(PictureScale scale, Targets& targets);
  static void set_common(const Program& program, const Targets::Picture& from, Targets& targets);

  Program open_, slits_, holes_, across_, fade_, shadows_, solids_, edges_, outline_;
  Table solid_table_{Table::Texel::floats};
  std::vector<float> solid_numbers_;
  const Targets::Picture* last_ = nullptr;
  int next_ = 0;  // of targets.finished
};

}  // namespace organbake
