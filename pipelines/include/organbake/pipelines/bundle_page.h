// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/pipelines/bundle_page_run.h"

namespace organbake {

// One page about a bundle, with all its pictures inside: warnings first, the proxy over the
// surface, error and time of each stage, coverage, the maps of each camera, what was skipped and
// why. Without a run it tells no times. `player`, unless empty, is the file to link to as the page
// with the bundle's player. Throws BadDataError for a damaged bundle.
std::string bundle_page(const BundleReader& reader, const std::optional<BakeRun>& run,
                        const std::string& player);

}  // namespace organbake
