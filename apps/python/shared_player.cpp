// SPDX-License-Identifier: Apache-2.0
#include "shared_player.h"

#include <cstring>

#include "organbake/core/error.h"
#include "organbake/player/instrument_motion.h"
#include "organbake/player/orbit.h"
#include "organbake/player/skin_point.h"

namespace organbake {

namespace {

// What was asked for; the tracker needs its own for the next picture's flow.
void copy_layers(const PixelTruth& from, const LayerSet& layers, PixelTruth& to) {
  to.width = from.width, to.height = from.height;
  if (layers.depth) to.depth_mm = from.depth_mm;
  if (layers.mask) to.label = from.label;
  if (layers.normals) to.normal = from.normal;
  if (layers.id || layers.weight) to.bound = from.bound;
  if (layers.id) to.organ = from.organ;
}

}  // namespace

SharedPlayer::SharedPlayer(const std::vector<std::filesystem::path>& bundles,
                           const DeformOptions& options, std::optional<DrawnLight> light)
    : light_(light) {
  options.check();
  player_ = std::make_unique<Player>(bundles, options);
  if (light && *light != DrawnLight::baked && !player_->can_relight())
    throw UsageError(bundles.front().string() + " does not say in what light its colours were " +
                     "taken: light " + to_string(*light) + " cannot be shown");
}

Player& SharedPlayer::open() {
  if (!player_) throw UsageError("the player is closed; load the bundle anew");
  return *player_;
}

StepReport SharedPlayer::step(const std::vector<Instrument>& instruments) {
  const std::lock_guard lock(mutex_);
  StepReport report = open().step(instruments);
  instruments_ = instruments;
  for (std::size_t i = 0; i < instruments_.size(); ++i)
    instruments_[i].position_mm = report.tip_position_mm[i];
  return report;
}

void SharedPlayer::reset() {
  const std::lock_guard lock(mutex_);
  open().reset();
  instruments_.clear();
  tracker_.reset();
}

void SharedPlayer::close() {
  const std::lock_guard lock(mutex_);
  player_.reset();
  tracker_.reset();
  frame_ = {};
}

View SharedPlayer::orbit(const OrbitPose& pose, int width, int height) {
  const std::lock_guard lock(mutex_);
  return orbit_view(open().bundle().cameras, pose, width, height);
}

DrawnPicture SharedPlayer::draw(const View& view, const LayerSet& layers, bool tools,
                                std::uint8_t* pixels) {
  const std::lock_guard lock(mutex_);
  Player& player = open();
  DrawOptions options;
  options.light = light_.value_or(player.default_light());
  options.keep_bound = layers.any();
  if (tools) options.solids = solids_of(instruments_, player.bundle());
  player.draw(view, options, frame_);
  player.load_ahead();  // the next views won't wait
  DrawnPicture picture;
  picture.layers = layers;
  if (pixels) {
    std::memcpy(pixels, frame_.color.pixels.data(), frame_.color.pixels.size());
    picture.color.width = frame_.color.width, picture.color.height = frame_.color.height;
  } else {
    picture.color = frame_.color;
  }
  if (!layers.any()) return picture;
  if (!tracker_ || !(tracker_->layers() == layers)) tracker_.emplace(layers);
  tracker_->advance(player, view, options.solids, frame_);
  picture.has_flow = layers.flow && tracker_->has_before();
  if (picture.has_flow) {
    tracker_->find_backward(picture.backward);
    tracker_->find_forward(picture.forward);
  }
  copy_layers(tracker_->now(), layers, picture.truth);
  return picture;
}

std::size_t SharedPlayer::organ_count() {
  const std::lock_guard lock(mutex_);
  return open().organ_count();
}

std::vector<Eigen::Vector3d> SharedPlayer::proxy_positions(std::size_t organ) {
  const std::lock_guard lock(mutex_);
  return open().proxy_positions(organ);
}

std::vector<Face> SharedPlayer::proxy_faces(std::size_t organ) {
  const std::lock_guard lock(mutex_);
  return open().bundle_now(organ).proxy.faces;
}

Eigen::Vector3d SharedPlayer::skin_point(const Eigen::Vector3d& direction) {
  const std::lock_guard lock(mutex_);
  if (!direction.allFinite() || !(direction.squaredNorm() > 0))
    throw UsageError("a direction needs three finite numbers that are not all zero");
  return organbake::skin_point(open().bundle(), direction);
}

}  // namespace organbake
