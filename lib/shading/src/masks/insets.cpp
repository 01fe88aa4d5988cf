// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a recorder has laid into a clip's frames, by two properties that tissue before a moving
// scope lacks. A second picture has seams round it, whether what it shows stands or moves
// (inset_boxes.cpp). Text and logos *stand*: their pixels keep their level, but for a rare switch
// (a clock), while what lies round them changes. Smooth tissue keeps its level, too, but ends
// without an edge. In: up to 32 frames spread over the clip. Out: a mask.
#include "organbake/shading/masks.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "masks/searches.h"
#include "organbake/core/text.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

constexpr int kWidest_px = 960;  // that frames are looked at in
constexpr std::size_t kMostSamples = 32;
constexpr int kRim = 80;  // of the width one such part

// Where most of a few frames have their field of view, without its rim: there the picture stands,
// blurred into the stop.
Mask usual_field(const std::vector<Rgb8Image>& samples) {
  constexpr std::size_t kLooked = 5;
  const std::size_t looked = std::min(samples.size(), kLooked);
  Mask field(samples[0].width, samples[0].height);
  for (std::size_t i = 0; i < looked; ++i) {
    const Mask one =
        field_of_view(samples[i * (samples.size() - 1) / std::max<std::size_t>(1, looked - 1)], 0);
    for (std::size_t k = 0; k < field.size(); ++k) field.values[k] += one.values[k];
  }
  for (std::uint8_t& value : field.values) value = 2 * value > looked;
  return eroded(field, std::max(2, field.width / kRim));
}

// Whether a pixel keeps its level over all samples, but for a few switches to another.
bool stands(const std::vector<Rgb8Image>& samples, std::size_t k) {
  constexpr int kSteady = 6, kSwitch = 24;  // levels: of coding; between letters and their ground
  const std::size_t most_switches = samples.size() / 4, most_strays = samples.size() / 10;
  const std::uint8_t* level = &samples[0].pixels[3 * k];
  std::size_t switches = 0, strays = 0;
  for (const Rgb8Image& sample : samples) {
    const std::uint8_t* now = &sample.pixels[3 * k];
    int off = 0;
    for (int c = 0; c < 3; ++c) off = std::max(off, std::abs(now[c] - level[c]));
    if (off <= kSteady) continue;
    if (off >= kSwitch) {
      ++switches;
      level = now;
    } else {
      ++strays;
    }
    if (switches > most_switches || strays > most_strays) return false;
  }
  return true;
}

// Mean over the samples of how far levels jump at a pixel.
Plane usual_jumps(const std::vector<Rgb8Image>& samples) {
  const int width = samples[0].width, height = samples[0].height;
  Plane mean(width, height);
  for (const Rgb8Image& sample : samples)
    for (int y = 1; y + 1 < height; ++y)
      for (int x = 1; x + 1 < width; ++x) {
        int most = 0;
        for (int c = 0; c < 3; ++c)
          most = std::max({most, std::abs(sample.at(x + 1, y)[c] - sample.at(x - 1, y)[c]),
                           std::abs(sample.at(x, y + 1)[c] - sample.at(x, y - 1)[c])});
        mean.at(x, y) += static_cast<float>(most);
      }
  for (float& value : mean.values) value /= static_cast<float>(samples.size());
  return mean;
}

Mask closed(const Mask& mask, int radius) { return eroded(dilated(mask, radius), radius); }
Mask opened(const Mask& mask, int radius) { return dilated(eroded(mask, radius), radius); }

class StandingSearch {
 public:
  StandingSearch(const std::vector<Rgb8Image>& samples, const Mask& field, const Mask& boxes)
      : field_(field),
        boxes_(boxes),
        standing_(field.width, field.height),
        jumps_(usual_jumps(samples)) {
    for (std::size_t k = 0; k < field.size(); ++k)
      standing_.values[k] = field.values[k] && !boxes.values[k] && stands(samples, k);
    const Mask moving = without(without(field, boxes), standing_);
    moving_share_ = share_of(moving) / std::max(1e-9, share_of(without(field, boxes)));
    edge_ = std::max(kLeastEdge, kOfUsual * static_cast<float>(median_inside(jumps_, moving)));
  }

  Mask run() const {
    Mask found(field_.width, field_.height);
    constexpr double kLeastMoving = 0.35;  // else the scope stands still
    if (moving_share_ < kLeastMoving) return found;
    const int letters = std::max(3, field_.width / 100), strokes = std::max(2, field_.width / 200);
    const Mask blocks =
        without(common(opened(closed(standing_, letters), strokes), field_), boxes_);
    Grid<std::int32_t> labels(blocks.width, blocks.height);
    cv::Mat out(blocks.height, blocks.width, CV_32S, labels.values.data()), stats, centres;
    const int count = cv::connectedComponentsWithStats(cv_view(blocks), out, stats, centres);
    Mask sharp(field_.width, field_.height), large = sharp;
    for (int label = 1; label < count; ++label) {
      const int* figures = stats.ptr<int>(label);
      const cv::Rect box(figures[cv::CC_STAT_LEFT], figures[cv::CC_STAT_TOP],
                         figures[cv::CC_STAT_WIDTH], figures[cv::CC_STAT_HEIGHT]);
      double area = figures[cv::CC_STAT_AREA];
      for (int y = box.y; y < box.y + box.height; ++y)
        for (int x = box.x; x < box.x + box.width; ++x) area += boxes_.at(x, y) != 0;
      if (!may_be_laid_over(box, area) || !has_sharp_border(labels, label, box)) continue;
      const bool whole = area >= kFilled * box.area();
      for (int y = box.y; y < box.y + box.height; ++y)
        for (int x = box.x; x < box.x + box.width; ++x)
          if (whole || labels.at(x, y) == label) {
            sharp.at(x, y) = 1;
            large.at(x, y) |= area >= kLeastAlone * static_cast<double>(field_.size());
          }
    }
    // A small letter counts beside others.
    return common(regions_touching(dilated(sharp, 2 * letters), large), sharp);
  }

 private:
  static constexpr float kLeastEdge = 8, kOfUsual = 2;
  static constexpr double kFilled = 0.8;       // of its bounding box: a rectangle with gaps
  static constexpr double kLeastAlone = 8e-4;  // of the frame

  bool may_be_laid_over(const cv::Rect& box, double area) const {
    constexpr double kSmallest = 2e-4, kLarge = 0.05;  // of the frame
    const double frame = static_cast<double>(field_.size());
    return area >= kSmallest * frame && (area <= kLarge * frame || area >= kFilled * box.area());
  }

  // Whether the picture jumps where the block ends, in frame after frame.
  bool has_sharp_border(const Grid<std::int32_t>& labels, int label, const cv::Rect& box) const {
    double border = 0, sharp = 0;
    for (int y = box.y; y < box.y + box.height; ++y)
      for (int x = box.x; x < box.x + box.width; ++x) {
        if (labels.at(x, y) != label || !is_border(labels, x, y)) continue;
        ++border;
        sharp += sharpest_round(x, y) >= edge_;
      }
    constexpr double kMostOfIt = 0.85;
    return sharp >= kMostOfIt * border;
  }

  // With tissue beside it.
  bool is_border(const Grid<std::int32_t>& labels, int x, int y) const {
    for (const auto& [dx, dy] :
         {std::pair(-1, 0), std::pair(1, 0), std::pair(0, -1), std::pair(0, 1)}) {
      const int u = x + dx, v = y + dy;
      if (u < 0 || v < 0 || u >= field_.width || v >= field_.height) continue;
      if (labels.at(u, v) == 0 && field_.at(u, v) && !boxes_.at(u, v)) return true;
    }
    return false;
  }

  float sharpest_round(int x, int y) const {
    constexpr int kRound_px = 3;
    float most = 0;
    for (int v = std::max(0, y - kRound_px); v <= std::min(field_.height - 1, y + kRound_px); ++v)
      for (int u = std::max(0, x - kRound_px); u <= std::min(field_.width - 1, x + kRound_px); ++u)
        most = std::max(most, jumps_.at(u, v));
    return most;
  }

  const Mask &field_, &boxes_;
  Mask standing_;
  Plane jumps_;
  double moving_share_ = 0;
  float edge_ = kLeastEdge;
};

}  // namespace

double share_of(const Mask& mask) {
  return static_cast<double>(cv::countNonZero(cv_view(mask))) /
         static_cast<double>(std::max<std::size_t>(1, mask.size()));
}

void InsetFinder::add(const Rgb8Image& frame) {
  width_ = frame.width;
  height_ = frame.height;
  if (count_++ % stride_ != 0) return;
  Rgb8Image sample = frame;
  while (std::max(sample.width, sample.height) > kWidest_px) sample = half_size(sample);
  samples_.push_back(std::move(sample));
  if (samples_.size() < kMostSamples) return;
  for (std::size_t i = 0; 2 * i < samples_.size(); ++i)
    if (i > 0) samples_[i] = std::move(samples_[2 * i]);
  samples_.resize((samples_.size() + 1) / 2);
  stride_ *= 2;
}

Mask InsetFinder::find() const {
  if (samples_.size() < kFewest) return {};
  const Mask field = usual_field(samples_);
  Mask found(field.width, field.height);
  for (const Box& box : boxes_of_seams(samples_, field))
    for (int y = box.top; y < box.bottom; ++y)
      std::fill_n(&found.at(box.left, y), box.right - box.left, std::uint8_t{1});
  const Mask standing = StandingSearch(samples_, field, found).run();
  for (std::size_t k = 0; k < found.size(); ++k) found.values[k] |= standing.values[k];
  if (share_of(found) == 0) return {};
  found = dilated(found, 1);  // what coding has spread
  Mask whole(width_, height_);
  cv::Mat target = cv_view(whole);
  cv::resize(cv_view(found), target, target.size(), 0, 0, cv::INTER_NEAREST);
  return whole;
}

std::string told_of_insets(double share) {
  return "a recorder has laid text, a logo or another picture over " + percent(share) +
         " of the frames: it is no tissue, and is left out";
}

}  // namespace organbake
