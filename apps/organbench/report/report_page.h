// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "report/run_report.h"

namespace organbake {

// One page for people: figures beside their targets, curves, tables; no network.
std::string report_page(const RunReport& report);

}  // namespace organbake
