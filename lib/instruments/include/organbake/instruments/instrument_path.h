// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "organbake/instruments/instrument.h"

namespace organbake {

// Where a tip is at a time: at a place of the world, or pressed depth_mm below the skin (above it
// when negative) where the line from the organ's centre along `direction` leaves it at rest.
struct Waypoint {
  double time_s = 0;
  std::optional<Eigen::Vector3d> position_mm;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  double depth_mm = 0;
  double opening_mm = 0;  // between the tips of scissors' blades
};

// What an instrument does in a script: key frames, and all of it that stays.
struct InstrumentPath {
  std::string name;
  // Of radius 0: the bundle's default tool. The opening of scissors is the direction in which they
  // open, of any length but zero: how far, the waypoints tell.
  Instrument instrument = {.radius_mm = 0};
  // Strictly later each; the tip is away before the first and after the last.
  std::vector<Waypoint> path = {};
  // How the tool looks, which nothing that it does depends on: where its shaft leads at all times,
  // any length, or the place of the world that it comes through and turns about. Neither: the
  // player chooses such a place, once for the whole path.
  std::optional<Eigen::Vector3d> shaft = {}, trocar_mm = {};

  // The instrument at a time: linear between waypoints, all of which must have their places of the
  // world; inactive before the first and after the last.
  Instrument at(double time_s) const;
};

}  // namespace organbake
