// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/time_points.h"

#include <utility>

#include "labels/mask_labels.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

// The label of each name is its channel, counted from 1. Classes count from 0, the background;
// where there is a name for every channel, from the first.
std::vector<LabelName> channel_names(std::int64_t count, const VolumeReadOptions& options) {
  std::vector<LabelName> names;
  const bool has_background = std::cmp_not_equal(options.label_names.size(), count);
  for (const LabelName& known : options.label_names) {
    const int channel = known.label + (has_background ? 1 : 0);
    if (channel < 1 || channel > count) continue;
    names.push_back({channel, known.name, static_cast<int>(names.size())});
  }
  if (!names.empty()) return names;
  for (std::int64_t layer = 0; layer < count; ++layer) {
    const int number = static_cast<int>(layer) + 1;
    names.push_back({number, "channel " + std::to_string(number), static_cast<int>(layer)});
  }
  return names;
}

std::string channel_advice(std::int64_t count, const std::vector<LabelName>& names,
                           bool may_be_times) {
  const std::string all = std::to_string(count);
  return "holds " + all + " volumes of one place. If each is a mask of its own, choose one with " +
         "--label \"" + names.front().name + "\" … \"" + names.back().name + "\"" +
         (may_be_times ? "; if they are labels over time, with --time 1…" + all : "");
}

}  // namespace

std::int64_t chosen_time(const TimePoints& times, const VolumeReadOptions& options,
                         const std::string& name) {
  if (times.count < 1) {
    throw BadDataError(name + ": holds " + std::to_string(times.count) + " time points");
  }
  if (times.count == 1 && (options.is_mask || options.lasting)) return 0;
  if (options.time > times.count) {
    throw UsageError(name + ": holds " + std::to_string(times.count) +
                     (times.count == 1 ? " time point" : " time points") + ", no --time " +
                     std::to_string(options.time));
  }
  if (options.time > 0) return options.time - 1;
  if (times.count == 1 || options.any_time) return 0;
  throw BadDataError(name + ": holds " + std::to_string(times.count) + " time points" +
                     (times.step.empty() ? "" : ", " + times.step) + "; choose one with --time 1…" +
                     std::to_string(times.count));
}

Volume read_one_of(const TimePoints& times, const VolumeReadOptions& options,
                   const std::string& name, const std::function<Volume(std::int64_t)>& read_one) {
  constexpr std::int64_t kMostChannels = 1000;
  const bool channels = options.is_mask && times.count > 1 && times.count <= kMostChannels &&
                        !options.any_time && (options.time == 0 || options.only_channels);
  if (!channels) return read_one(chosen_time(times, options, name));
  const std::vector<LabelName> names = channel_names(times.count, options);
  return read_separate_masks(options, name, names,
                             channel_advice(times.count, names, !options.only_channels),
                             [&](std::int64_t layer) {
                               return read_one(names[static_cast<std::size_t>(layer)].label - 1);
                             });
}

}  // namespace organbake
