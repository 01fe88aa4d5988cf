// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <vector>

#include "measuring/measurement.h"

namespace organbake {

// How much is asked of all suites together: a first look in two minutes at small inputs; the whole
// inputs within 20 minutes; or every case that a figure was promised for, with more rounds, in an
// hour.
enum class Effort { quick, standard, thorough };

// A picture for the page.
struct Picture {
  std::string caption, data_uri;  // a PNG
  int width = 0, height = 0;      // pixels
};

// What one suite found out.
struct SuiteResult {
  struct Skipped {
    std::string what, why;
  };

  std::vector<Point> points;
  std::vector<Figure> figures;
  std::vector<Skipped> skipped;
  std::vector<Picture> pictures;
  std::string failure;  // why the suite ended early; empty when it did not
};

// All that one call of organbench found out.
struct RunReport {
  struct SuiteReport {
    std::string name, summary;
    double seconds = 0;
    SuiteResult result;
  };

  Effort effort = Effort::standard;
  std::map<std::string, std::string> machine;
  std::vector<SuiteReport> suites;
};

}  // namespace organbake
