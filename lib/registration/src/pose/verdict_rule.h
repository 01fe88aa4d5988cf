// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>

#include "organbake/core/text.h"
#include "organbake/registration/register_photo.h"

namespace organbake {

// What a finished pose must keep to.
struct VerdictRule {
  bool broken;
  Verdict verdict;  // if it is
  std::string reason;
};

// The first broken rule tells the verdict.
inline void judge_by(std::span<const VerdictRule> rules, PoseQuality& quality) {
  quality.verdict = Verdict::ok;
  quality.reason.clear();
  for (const VerdictRule& rule : rules) {
    if (!rule.broken) continue;
    quality.verdict = rule.verdict;
    quality.reason = rule.reason;
    return;
  }
}

}  // namespace organbake
