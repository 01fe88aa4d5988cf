// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/phantom/phantom.h"
#include "organbake/registration/register_photo.h"
#include "organbake/registration/registered_surface.h"
#include "support/testing.h"

namespace organbake {

// What the photographs show: the formula, of which the registered mesh is a piecewise flat copy, or
// that very mesh, for questions in which the copy's own error has no place.
enum class PhotographedSurface { formula, mesh };

// The phantom under a lamp at the camera, from poses that are known: what is measured against.
class LampScenes {
 public:
  LampScenes(int photo_size, int cameras, PhotographedSurface photographed);

  const RegisteredSurface& surface() const { return *surface_; }
  const std::vector<PosedCamera>& cameras() const { return cameras_; }
  const RegisteredSurface& other_organ(int seed) const;  // made once
  TriangleMesh mirrored() const;

  // `hard`: the organ's albedo, highlights, 40 % vignette. 2 % noise in any case.
  PhotoToRegister photo(std::size_t camera, std::uint64_t seed, bool hard) const;
  // A shaded grey shaft over a fifth of the organ.
  void put_instrument(Rgb8Image& photo, std::uint64_t seed) const;
  // Up to so far off, uniform in shift and in angle; and exactly so far off.
  RigidTransform start(std::size_t camera, double shift_mm, double turn_deg,
                       std::uint64_t seed) const;
  RigidTransform start_at_least(std::size_t camera, double shift_mm, double turn_deg,
                                std::uint64_t seed) const;

  double mtre_mm(std::size_t camera, const RigidTransform& camera_from_world) const;
  double reprojection_px(std::size_t camera, const RigidTransform& camera_from_world) const;
  // Cramér–Rao: RMS over the surface of the least error that any unbiased estimate from all of the
  // photograph's pixels can have, gain and offset unknown: Cov ≥ σ² (Jᵀ P J)⁻¹ with J the finite
  // differences of the noiseless photograph.
  double floor_mm(std::size_t camera) const;

 private:
  LampPicture picture(const PosedCamera& camera, const LampScene& scene) const;

  OrganPhantom phantom_;
  PhotographedSurface photographed_;
  std::unique_ptr<RegisteredSurface> surface_;
  std::vector<PosedCamera> cameras_;
  mutable std::map<int, std::unique_ptr<RegisteredSurface>> others_;
  mutable std::map<std::pair<std::size_t, bool>, LampPicture> pictures_;
  mutable std::map<std::size_t, double> floors_mm_;
};

// What people light organs with, and programs draw them with.
enum class StudioLight {
  at_lens,      // a lamp at the camera's centre, as the square of the distance
  beside_lens,  // 3–9 mm off, its beam weaker to the sides
  headlight,    // at the camera's centre, as strong at any distance
  far_away,     // from one direction, with some ambient light
};
inline constexpr int kStudioLights = 4;
const char* name_of(StudioLight light);

// An organ whose photographs are drawn, and what is registered of it.
struct PhotographedOrgan {
  std::string name;
  TriangleMesh drawn;
  std::unique_ptr<RegisteredSurface> whole;
};

// A seeded photograph with its truth, and a start.
struct RegistrationCase {
  PhotoToRegister photo;
  RigidTransform camera_from_world;  // the truth
  // The part of the organ that is registered; the organ's `whole` when there is none.
  std::unique_ptr<RegisteredSurface> patch;
};

// Organs: the phantom, drawn four times as finely as it is registered, and the livers of the shared
// data that are there.
class RegistrationCases {
 public:
  // `data`: the folder of the real data; may be empty.
  explicit RegistrationCases(const std::filesystem::path& data);

  const std::vector<PhotographedOrgan>& organs() const { return organs_; }

  // The whole organ, white, well inside a picture of 640 × 512; lens, pose and what is left of the
  // light drawn from the seed. The start is up to 10 mm and 10° off.
  RegistrationCase whole_organ(std::size_t organ, StudioLight light, std::uint64_t seed) const;
  // A laparoscope's view from near: texture and highlights, a lamp beside the lens with an uneven
  // beam, the organ all over the picture or nearly; what is registered is a piece of it that fills
  // a part of the view. The start is 10 mm and 8° off.
  RegistrationCase open_patch(std::size_t organ, std::uint64_t seed) const;

 private:
  void add_organ(const std::string& name, TriangleMesh drawn, TriangleMesh registered);

  OrganPhantom texture_;
  std::vector<PhotographedOrgan> organs_;
};

}  // namespace organbake
