// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "contact/contact.h"
#include "organbake/deform/deformer.h"

namespace organbake::deform {

// Throws UsageError naming the tip whose position, radius or mode makes no sense; inactive tips may
// hold anything.
void check_tips(const std::vector<InstrumentTip>& tips);

// What the tips did since the last step.
class Instruments {
 public:
  // As given to the last advance().
  const std::vector<InstrumentTip>& tips() const { return last_; }
  // Whether nothing about the active tips differs from the last advance().
  bool unchanged(const std::vector<InstrumentTip>& tips) const;
  // The sweeps of all active tips, in tip order. Contacts of tips that opened, went away or changed
  // their mode are erased; `closing` lists the sweeps of graspers that close in this step.
  std::vector<TipSweep> advance(const std::vector<InstrumentTip>& tips,
                                std::vector<Contact>& contacts, std::vector<std::size_t>& closing);

 private:
  std::vector<InstrumentTip> last_;
};

// In how many pieces a step's sweeps are followed, so that no piece carries a tip past the skin. At
// most some thousand: a tip that is faster still may pass through.
struct SweepPieces {
  int count = 1;
  bool enough = true;
};
SweepPieces sweep_pieces(const std::vector<TipSweep>& sweeps);

}  // namespace organbake::deform
