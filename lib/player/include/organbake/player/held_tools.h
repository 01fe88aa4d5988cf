// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"

namespace organbake {

class TrocarChooser;

// The tools of a script as a viewer sees them. Each comes through a trocar, which the script gives,
// or which is chosen once for all of the script from where its tip goes, the organs and the views
// (trocar.h), so that no shaft leaps from side to side; one with a direction for its shaft keeps
// that.
class ScriptTools {
 public:
  // motion: the script's. Keeps nothing by reference.
  ScriptTools(const Script& script, const InstrumentMotion& motion, const Player& player);
  ~ScriptTools();
  ScriptTools(ScriptTools&&) noexcept;

  // Of the active ones, each part with its instrument's number. instruments: one for each path.
  std::vector<Solid> solids(const std::vector<Instrument>& instruments, double time_s) const;
  // Nothing for an instrument whose shaft has a direction, or that is never there.
  std::optional<Eigen::Vector3d> trocar_mm(std::size_t instrument) const;

 private:
  struct Held;
  std::vector<Held> held_;
};

// The same of tools whose way nobody knows yet: a trocar is chosen when a tool comes, and kept
// until it goes.
class HeldTools {
 public:
  explicit HeldTools(const Player& player);
  ~HeldTools();
  HeldTools(HeldTools&&) noexcept;
  HeldTools& operator=(HeldTools&&) noexcept;

  void put_down();  // all of them
  // view: whose picture they are drawn into; time_s: of the tissue's, from any beginning.
  std::vector<Solid> solids(const std::vector<Instrument>& instruments, const View& view,
                            double time_s);
  // Of one that the last solids() drew.
  std::optional<Eigen::Vector3d> trocar_mm(std::size_t instrument) const;

 private:
  std::unique_ptr<TrocarChooser> chooser_;
  struct Held;
  std::vector<std::optional<Held>> held_;
};

}  // namespace organbake
