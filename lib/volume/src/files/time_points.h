// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// Volumes of one place at several times in one file or series.
struct TimePoints {
  std::int64_t count = 1;
  std::string step = {};  // "every 0.5 s"; empty = not known
};

// The index, from 0, of the time point that options.time asks for. Throws UsageError for one that
// isn't there, and BadDataError ("holds 5 time points; choose one with --time 1…5") when none was
// asked for and there are several, unless options.any_time lets the first stand for all.
std::int64_t chosen_time(const TimePoints& times, const VolumeReadOptions& options,
                         const std::string& name);

// One volume of a file of `times`, of which `read_one` reads one. Of a mask they may be channels,
// each a mask of its own, as one-hot and probability maps have them: "channel 2", counted from 1,
// is then options.label, or the names of options.label_names, which number them.
Volume read_one_of(const TimePoints& times, const VolumeReadOptions& options,
                   const std::string& name, const std::function<Volume(std::int64_t)>& read_one);

}  // namespace organbake
