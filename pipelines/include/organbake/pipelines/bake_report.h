// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "organbake/bundle/bundle_reader.h"

namespace organbake {

// A bundle's report.json, held against its schema and its stages' own: a bundle may come from
// anywhere, and its report is no part of what the reader checks. Throws NoInputError or
// BadDataError.
nlohmann::json read_bake_report(const BundleReader& reader);

}  // namespace organbake
