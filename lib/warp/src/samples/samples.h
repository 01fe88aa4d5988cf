// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/core/background.h"
#include "organbake/cutting/cut_organ.h"
#include "organbake/geometry/shell.h"
#include "organbake/warp/organ_source.h"
#include "organbake/warp/view.h"

namespace organbake {

// Slot numbers share a 64-bit key with depth and offsets.
inline constexpr std::uint32_t kMostSlots = 1u << 24;

// Binds every texel that has a face, and confidence. rest holds the rest shell matrix of every
// face, world. Throws BadDataError when the map has more samples than kMostSlots.
SampleSet build_sample_set(CameraMaps maps, const PosedCamera& camera,
                           const std::vector<ShellMatrix>& rest);

// The texels of one chunk: texels[first … first + count).
struct TexelRun {
  std::uint32_t face = 0;
  std::uint32_t first = 0, count = 0;
};

struct TexelOrder {
  std::vector<std::uint32_t> texels;  // row-major indices of the texels in use
  std::vector<TexelRun> runs;         // by face
};

// Sorts a map's texels by face and, within a face, along a Morton curve of 8 × 8 tiles, and cuts
// the result into runs that stay compact in the map: at most kChunk texels within 16 × 16.
TexelOrder order_texels(const CameraMaps& maps);

// What a camera's map says of its texels together with their neighbours on the same surface: whole
// rows at a time cost a fifth of texel by texel. By slot, so that whoever binds texels face by face
// finds it in a row. maps.face: not the texels' faces but their slots, or kNoFace. Their colours
// and confidence the maps have no more.
struct MapDetail {
  MapDetail(CameraMaps& maps, double focal_px, std::size_t slots);

  std::vector<TexelColors> colors;
  // Change of depth per column and row, mm, by the same differences; NaN without a neighbour.
  std::unique_ptr<float[]> slope_u, slope_v;
};

// The sample sets of a bundle's cameras, each made when a view first needs it and kept from then
// on: a view needs three, a bundle may have dozens. What is made, and so every frame, does not
// depend on when.
class SampleStore {
 public:
  // Called once per camera, from any thread; once more when it threw.
  using Make = std::function<SampleSet(std::size_t camera)>;

  SampleStore(std::size_t cameras, Make make);
  ~SampleStore();  // waits for the camera that is being made ahead

  // Makes those of the cameras that are not there yet, side by side. Throws what making one throws.
  void require(std::span<const std::size_t> cameras);
  void require_all();
  // Starts a thread of its own that makes all the others, in order, where the build has threads.
  // What fails there is tried again, and thrown, when it is required.
  void make_ahead();
  // Makes the first that is not there yet, for who has no thread to spare. False: all are there.
  // Not beside make_ahead().
  bool make_next();

  // Of one camera, made when it is not there yet.
  const SampleSet& made(std::size_t camera);

 private:
  struct Slot;

  std::size_t count_;
  std::unique_ptr<Slot[]> slots_;
  Make make_;
  std::size_t next_ = 0;    // all before it were made
  BackgroundThread ahead_;  // last: it ends while the rest is there
};

ShellMatrix in_frame(const ShellMatrix& matrix, const RigidTransform& frame_from_world);

enum class CoarseFaces { of_proxy, of_skin };

// An organ for pictures whose pixels hold several of its texels: with 1 / shrink as many texels and
// nodes of the base layer a side, over the proxy's faces in place of its skin's, unless those have
// to stay. Small pictures cost by their pixels then, not by what the organ was baked in. Made of
// one that no blade has cut.
class CoarserOrgan {
 public:
  // whole: its maps are not needed; the samples of its cameras are made where they are not.
  CoarserOrgan(const Bundle& whole, std::shared_ptr<SampleStore> samples, int shrink,
               CoarseFaces over);
  CoarserOrgan(const CoarserOrgan&) = delete;

  const Bundle& bundle() const { return bundle_; }  // without maps
  SampleStore& samples() { return samples_; }
  // cut_into² faces of the whole one's lie over each of its own.
  std::uint32_t cut_into() const { return cut_into_; }
  // Binds what a pixel shows, which has skin, to the whole organ's.
  void bind_to_whole(BoundPixel& pixel) const;
  // Whether its skin, posed (shells, by face), lies where the whole one's does, to half of a pixel
  // of the camera: skin bends within the faces of a coarse proxy, and a deep poke bends it a lot.
  bool follows(const std::vector<Eigen::Vector3d>& proxy, const std::vector<ShellMatrix>& shells,
               const PosedCamera& camera) const;

 private:
  std::uint32_t cut_into_;
  Bundle bundle_;
  std::vector<ShellMatrix> rest_, whole_rest_;  // by face, world
  SmoothSkin middles_;                          // the whole skin's nodes in the middle of faces
  std::vector<ShellBinding> bound_middles_;     // and where they lie over these
  std::shared_ptr<SampleStore> whole_samples_;
  SampleStore samples_;
};

// The coarser ones of an organ, shared by all that draw it side by side, from threads of their own;
// made when a picture first asks.
class CoarserOrgans {
 public:
  static constexpr int kHalvings = 3;  // of the maps' sides, at most

  CoarserOrgans(const std::vector<PosedCamera>& cameras,
                const std::vector<Eigen::Vector3d>& proxy_at_rest);
  // How often a camera's picture can do with halved maps: their texels are still no larger than its
  // pixels where the organ is nearest. What is finer no pixel shows.
  int halvings(const std::vector<Eigen::Vector3d>& proxy, const PosedCamera& camera) const;
  // halvings ≥ 1; whole, samples, over: as for CoarserOrgan.
  std::shared_ptr<CoarserOrgan> of(int halvings, CoarseFaces over,
                                   const std::function<Bundle()>& whole,
                                   const std::shared_ptr<SampleStore>& samples);

 private:
  double texel_mm_ = 0;  // where the organ is nearest to its cameras, their mean
  std::mutex making_;
  // By what they lie over.
  std::array<std::array<std::shared_ptr<CoarserOrgan>, kHalvings>, 2> made_;
};

// Throws BadDataError unless cameras, viewing manifold, base layer and proxy go together; the maps
// are counted only.
void check_fit(const Bundle& bundle);
// Throws BadDataError unless a camera's maps have its size and name the proxy's faces.
void check_maps_fit(const CameraMaps& maps, std::size_t camera, const Intrinsics& lens,
                    std::size_t faces);
// Throws BadDataError unless there is a finite position for every vertex of the proxy.
void check_positions(const std::vector<Eigen::Vector3d>& positions, const TriangleMesh& proxy);

// Gives a camera's samples, once faces of the shell are cut, each to the part of its face that it
// lies in. Chunks of whole faces keep their slots.
void split_samples(const CutOrgan::FaceParts& parts, SampleSet& set);

}  // namespace organbake
