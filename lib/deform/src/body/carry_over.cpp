// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include "contact/grasp.h"
#include "solver/shape_solver.h"

namespace organbake::deform {

void ShapeSolver::take_over(ShapeSolver& before, const std::vector<NodeSource>& sources,
                            const std::vector<Instrument>& instruments) {
  to_rest();
  for (std::size_t n = 0; n < sources.size(); ++n) {
    const std::uint32_t slot = tissue_->slot_of_node()[n];
    if (slot >= tissue_->free_count()) continue;  // anchors stay
    x_[slot].setZero(), velocity_[slot].setZero();
    for (std::size_t k = 0; k < 4; ++k) {
      const double weight = sources[n].weights[k];
      if (weight == 0) continue;
      const std::uint32_t was = before.tissue_->slot_of_node()[sources[n].nodes[k]];
      x_[slot] += weight * before.x_[was];
      velocity_[slot] += weight * before.velocity_[was];
    }
  }
  tissue_->embedding().carry_positions(tissue_->rest(), x_);
  x_start_ = x_free_ = x_before_ = x_coasted_ = x_;
  std::vector<Row> at_rest;
  before.skin_.pose(before.tissue_->rest());
  for (const Contact& c : before.contacts_)
    at_rest.push_back(before.skin_.hit(c.at, Row::Zero()).point);
  before.skin_.pose(before.x_);
  std::size_t first = 0;  // of those of one tip: they stand together
  const auto grip_anew = [&] {
    if (first == contacts_.size()) return;
    grip(to_row(instruments[contacts_[first].instrument].position_mm), search_, skin_, contacts_,
         first);
    first = contacts_.size();
  };
  for (std::size_t i = 0; i < at_rest.size(); ++i) {
    Contact contact = before.contacts_[i];
    if (!contact.lasts() || contact.instrument >= instruments.size()) continue;
    if (first < contacts_.size() && contacts_[first].instrument != contact.instrument) grip_anew();
    if (!find_anew(contact, at_rest[i])) continue;
    const bool threaded = contact.as<Threaded>() != nullptr;
    if (threaded) search_.place(contact, to_row(instruments[contact.instrument].position_mm));
    contacts_.push_back(contact);
    if (threaded) first = contacts_.size();
  }
  grip_anew();
}

// The skin that is nearest to where the tip held it, at rest.
bool ShapeSolver::find_anew(Contact& contact, const Row& at_rest) {
  skin_.pose(tissue_->rest());
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (std::uint32_t face = 0; face < skin_.faces().size(); ++face) {
    if (skin_.least_distance(face, at_rest) >= nearest_mm) continue;
    const SkinHit hit = skin_.nearest(face, at_rest);
    if (hit.distance_mm < nearest_mm) nearest_mm = hit.distance_mm, contact.at = hit.at;
  }
  skin_.pose(x_);
  return search_.lever(contact.at).free_share > 0;
}

}  // namespace organbake::deform
