// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/phantom/known_answers.h"

namespace organbake {

class Bench;

// What ours makes of the scene on which it was most wrong.
struct WorstScene {
  double error = -1;
  std::string task;
  NearScene scene;
  Plane log_range;
};
void show_worst_scene(Bench& bench, const WorstScene& worst);

}  // namespace organbake
