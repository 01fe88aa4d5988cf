// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "measuring/measurement.h"

namespace organbake {

// Points that no other is both faster and more accurate than; in order of time. Points of one
// task are given; the first error of each counts. What was not timed is on no front.
std::vector<std::size_t> pareto_front(const std::vector<Point>& points);

// Time against error of one task, both axes logarithmic, as inline SVG: a line for each subject,
// peers dashed, a ring round the points of the Pareto front; what was not timed is a level.
std::string time_error_chart(const std::vector<Point>& points);

// Whether points tell how time grows with one number: timed, that knob alone, no error beside it.
bool shows_growth(const std::vector<Point>& points);
// Time against that number, the same way: a power is a straight line.
std::string time_work_chart(const std::vector<Point>& points);

}  // namespace organbake
