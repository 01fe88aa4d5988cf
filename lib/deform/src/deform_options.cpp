// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/deform/deformer.h"

namespace organbake {

const char* to_string(TissueSolver solver) {
  return solver == TissueSolver::fem ? "fem" : "springs";
}

std::optional<TissueSolver> tissue_solver(std::string_view name) {
  for (const TissueSolver solver : {TissueSolver::springs, TissueSolver::fem}) {
    if (name == to_string(solver)) return solver;
  }
  return std::nullopt;
}

void DeformOptions::check() const {
  if (!(time_step_s >= 1e-5 && time_step_s <= 1)) {
    throw UsageError("time step is " + to_text(time_step_s) + " s; it must be 0.00001 to 1");
  }
  if (iterations < 1 || iterations > 1000) {
    throw UsageError("iterations is " + std::to_string(iterations) + "; it must be 1 to 1000");
  }
  if (!(friction >= 0 && friction <= 10)) {
    throw UsageError("friction is " + to_text(friction) + "; it must be 0 to 10");
  }
}

}  // namespace organbake
