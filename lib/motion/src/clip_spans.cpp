// SPDX-License-Identifier: GPL-3.0-or-later
//
// An hour of surgery holds a few dozen spells in which a scope glides over tissue that keeps still;
// structure from motion works on those and nowhere else. Whether it will is told by what it starts
// from (two_views.h): pairs of pictures a second apart whose features one essential matrix
// explains, and no homography does. So pairs are tried all along the video, at a size at which that
// is cheap.
#include "organbake/motion/clip_spans.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/motion/feature_tracker.h"
#include "organbake/shading/prepared_frame.h"
#include "two_views.h"

namespace organbake {
namespace {

constexpr int kWidest_px = 640;            // that pictures are looked at in
constexpr std::size_t kTogether = 120;     // pictures whose tracks are kept together
constexpr double kMostInstruments = 0.35;  // share of the picture
constexpr double kLeastTissue = 0.25;      // likewise
constexpr double kBlurred = 0.3;           // of the usual sharpness
constexpr double kStill_px = 2;            // in a second, of 640
constexpr double kLeastParallax_px = 1, kGoodParallax_px = 4;  // likewise
// Of the features, what one rigid scene explains; of living tissue that can be baked, half.
constexpr double kSteady = 0.4;

struct PairFigures {
  double moved_px = 0, parallax_px = 0, steady = 0;
};

PairFigures compare(const ClipTracks& tracks, std::size_t a, std::size_t b) {
  constexpr double kUsualView_rad = 1.2;
  std::vector<Eigen::Vector2d> first, second;
  for (const FeatureTrack& track : tracks.tracks) {
    if (!track.is_in(a) || !track.is_in(b)) continue;
    first.push_back(track.at(a).cast<double>());
    second.push_back(track.at(b).cast<double>());
  }
  if (first.empty()) return {};
  const TwoViews views =
      relate_views(assumed_camera(tracks.width, tracks.height, kUsualView_rad), first, second);
  const double per_640 = double(kWidest_px) / tracks.width;
  return {motion_between(tracks, a, b).median_px * per_640, views.parallax_px * per_640,
          double(views.agreeing) / double(first.size())};
}

}  // namespace

struct SpanFinder::Impl {
  explicit Impl(const SpanOptions& o) : options(o) {}

  struct Sample {
    std::size_t frame = 0;
    double time_s = 0, sharpness = 0, instruments = 0;
    std::string flaw;  // why it is of no use; empty where it is
  };

  SpanOptions options;
  UsablePixels usable{1};  // a picture has little to do with the one before
  FeatureTracker tracker{tracking()};
  std::vector<Sample> samples;
  std::vector<ClipSpan> spans;

  static TrackingOptions tracking() {
    return {.features = 300, .refill_every = 1, .most_apart_px = 1};
  }

  void add(std::size_t frame, double time_s, Rgb8Image picture) {
    while (picture.width > kWidest_px) picture = half_size(picture);
    const Mask mask = usable.next(picture);
    Sample sample{frame, time_s, sharpness(picture), usable.instruments_now(), {}};
    const double tissue = double(std::count_if(mask.values.begin(), mask.values.end(),
                                               [](auto value) { return value != 0; })) /
                          double(mask.size());
    if (usable.is_colourless_now())
      sample.flaw = "no tissue is seen: all is grey";
    else if (sample.instruments > kMostInstruments)
      sample.flaw = "instruments cover the view";
    else if (tissue < kLeastTissue)
      sample.flaw = "hardly any tissue is seen";
    tracker.add(tracked_picture(picture), mask);
    samples.push_back(std::move(sample));
    if (samples.size() >= kTogether) close();
  }

  // Judges what was collected.
  void close() {
    const ClipTracks tracks = tracker.take();
    mark_blurred();
    std::size_t first = 0;
    for (std::size_t i = 1; i <= samples.size(); ++i) {
      const bool cut = std::find(tracks.shots.begin(), tracks.shots.end(), i) != tracks.shots.end();
      if (i < samples.size() && !cut && samples[i].flaw == samples[first].flaw) continue;
      if (samples[first].flaw.empty())
        judge(tracks, first, i);
      else
        put(first, i, 0, samples[first].flaw);
      first = i;
    }
    samples.clear();
  }

  // One blurred picture between sharp ones is a hasty move, which ends no span.
  void mark_blurred() {
    std::vector<double> all;
    for (const Sample& sample : samples) all.push_back(sample.sharpness);
    const double least = kBlurred * median(all);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const bool before = i == 0 || all[i - 1] < least;
      const bool after = i + 1 == all.size() || all[i + 1] < least;
      if (samples[i].flaw.empty() && all[i] < least && (before || after))
        samples[i].flaw = "blurred";
    }
  }

  double period_s() const {
    return (samples.back().time_s - samples.front().time_s) /
           std::max<double>(1, static_cast<double>(samples.size()) - 1);
  }

  // A run of good samples, in pieces that are not too long.
  void judge(const ClipTracks& tracks, std::size_t first, std::size_t end) {
    const auto longest = static_cast<std::size_t>(std::max(2.0, options.longest_s / period_s()));
    const std::size_t pieces = (end - first + longest - 1) / longest;
    for (std::size_t i = 0; i < pieces; ++i)
      judge_piece(tracks, first + i * (end - first) / pieces,
                  first + (i + 1) * (end - first) / pieces);
  }

  void judge_piece(const ClipTracks& tracks, std::size_t first, std::size_t end) {
    const double length_s = double(end - first) * period_s();
    const double length_share = std::min(1.0, length_s / options.longest_s);
    if (length_s < options.shortest_s)
      return put(first, end, SpanFinder::kShadingAlone * length_share,
                 "too short: " + to_text(length_s, 1) + " s");
    const auto second = std::max<std::size_t>(1, std::lround(1 / period_s()));
    std::vector<double> moved, parallax, steady;
    double instruments = 0;
    for (std::size_t i = first; i + second < end; i += second) {
      const PairFigures pair = compare(tracks, i, i + second);
      moved.push_back(pair.moved_px);
      parallax.push_back(pair.parallax_px);
      steady.push_back(pair.steady);
    }
    for (std::size_t i = first; i < end; ++i)
      instruments += samples[i].instruments / double(end - first);
    const PairFigures usual{median(moved), median(parallax), median(steady)};
    const std::string flaw = flaw_of(usual);
    if (!flaw.empty()) return put(first, end, SpanFinder::kShadingAlone * length_share, flaw);
    const double worth = length_share * std::min(1.0, usual.parallax_px / kGoodParallax_px) *
                         usual.steady * (1 - instruments);
    put(first, end, worth,
        "the scope moves over steady tissue for " + to_text(length_s, 1) +
            " s; instruments cover " + percent(instruments));
  }

  static std::string flaw_of(const PairFigures& usual) {
    if (usual.moved_px < kStill_px) return "the scope stands still";
    if (usual.steady < kSteady)
      return "the tissue moves by itself: one rigid scene explains " + percent(usual.steady);
    if (usual.parallax_px < kLeastParallax_px) return "the scope turns or zooms only";
    return "";
  }

  // Neighbours that are of no use for one reason are one span.
  void put(std::size_t first, std::size_t end, double worth, std::string reason) {
    const std::size_t begin = samples[first].frame, last = samples[end - 1].frame;
    if (!spans.empty() && worth == 0 && spans.back().worth == 0 && spans.back().reason == reason)
      spans.back().last = last;
    else
      spans.push_back({begin, last, worth, std::move(reason)});
  }
};

SpanFinder::SpanFinder(const SpanOptions& options) : impl_(std::make_unique<Impl>(options)) {}
SpanFinder::~SpanFinder() = default;

void SpanFinder::add(std::size_t frame, double time_s, const Rgb8Image& picture) {
  impl_->add(frame, time_s, picture);
}

std::vector<ClipSpan> SpanFinder::take() {
  if (!impl_->samples.empty()) impl_->close();
  return std::move(impl_->spans);
}

}  // namespace organbake
