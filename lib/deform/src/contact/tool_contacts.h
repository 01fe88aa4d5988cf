// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "body/skin.h"
#include "contact/contact_search.h"
#include "organbake/instruments/instrument.h"

namespace organbake::deform {

// Skin that anchors hold is a wall to probes, which stop at it; skin that gives way at all is held
// off by contacts (ContactSearch). Other tools pass: blades and needles part it, graspers hold it.
class AnchoredSkin {
 public:
  // Both outlive this.
  AnchoredSkin(Skin& skin, ContactSearch& search);

  // Where a probe stands at the wall.
  struct Touch {
    std::uint32_t instrument;
    SkinHit hit;
    Eigen::Vector3d outward;  // unit, from the skin to the probe
  };
  // In the skin's pose, before each step. In how many pieces a probe's way is to be followed so
  // that it ends on the side of the skin that it began on; 0: it comes near none.
  void begin_step() { touches_.clear(); }
  int pieces_between(const Instrument& from, const Instrument& to) const;
  // Moves a probe out of the wall, to the side on which it stands or, of one that is just placed,
  // to the outside.
  void push_off(std::uint32_t number, bool just_placed, Instrument& tip);
  const std::vector<Touch>& touches() const { return touches_; }  // of the last push of each

 private:
  struct Face {
    std::uint32_t face;
    Eigen::Vector3d center_mm;  // of a ball that holds its skin
    double radius_mm;
  };
  struct Overlap {
    Touch touch;
    double depth_mm = 0;
  };
  std::optional<Overlap> deepest(std::uint32_t number, bool just_placed, const Instrument& tip);

  Skin& skin_;
  ContactSearch& search_;
  std::vector<Face> faces_;  // any point of which cannot give way
  std::vector<Touch> touches_;
};

// Tools are hard: tips that would lie in each other are moved apart, each by half, until they
// touch. Inactive tips stay out of it. Many tools pressed together may keep a little overlap.
std::vector<Instrument> held_apart(std::vector<Instrument> tips);

// The same on the way from where tips were held to where they are asked for, piece by piece, so
// that neither a fast tool passes through another nor one that keeps being pushed. A tip that was
// not there before starts where it is asked for; one that meets none ends there. Probes stop at
// anchored skin, where there is some.
std::vector<Instrument> moved_apart(const std::vector<Instrument>& held,
                                    const std::vector<Instrument>& asked,
                                    AnchoredSkin* anchored = nullptr);

// Pairs of tips that touch.
std::size_t count_touching(const std::vector<Instrument>& tips);

// The parameters (0…1) of the nearest points of two segments, each from its `at` along its `way`,
// which may be zero.
struct NearestOnSegments {
  double first = 0, second = 0;
};
NearestOnSegments nearest_on_segments(const Eigen::Vector3d& first_at,
                                      const Eigen::Vector3d& first_way,
                                      const Eigen::Vector3d& second_at,
                                      const Eigen::Vector3d& second_way);

}  // namespace organbake::deform
