// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "organbake/geometry/rigid_transform.h"

namespace organbake {

// A breath that moves tissue to and fro, as a clip tells it: what is at p at rest is at
// p + course(time) · push(p), one course in time times one smooth field in space. Lengths are the
// scene's own until its scale is known, then mm, as in the document; waves and rest have no unit.
struct Breath {
  static constexpr int kWaves = 4, kTerms = 10;
  using Waves = Eigen::Matrix<double, kWaves, 1>;
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  using Field = Eigen::Matrix<double, 3, kTerms>;

  double period_frames = 0;
  Waves waves = Waves::Zero();  // heights of its cosine and sine, and of those twice as fast
  double rest = 0;              // is taken from these
  Field field = Field::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // along which its terms are, in rows
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();    // of the tissue
  double reach = 1;                                    // of the tissue

  static Waves waves_at(double angle_rad);  // 2π · time / period
  double course(double time_frames) const;  // from the clip's first view
  Terms terms_at(const Eigen::Vector3d& place) const;
  Eigen::Vector3d push(const Eigen::Vector3d& place_at_rest) const;
  // The same of tissue that lies elsewhere and then becomes `factor` times as large.
  void move(const RigidTransform& now_from_before, double factor);
};

std::string breath_to_json(const Breath& breath);
// Throws BadDataError naming `name` and the key.
Breath breath_from_json(const std::string& text, const std::string& name);

inline constexpr const char* kBreathFile = "breath.json";  // in a bundle: its script

// A script (interaction.schema.json) that moves these vertices, which lie at rest, through one
// breath, frame by frame of the clip from its first view, 25 a second; to 0.1 µm.
std::string breath_script(const Breath& breath, const std::vector<Eigen::Vector3d>& vertices_mm);

}  // namespace organbake
