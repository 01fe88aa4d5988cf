// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshes/mesh_readers.h"

void organbake_meshes(organbake::MeshFormat format, const std::filesystem::path& path,
                      const organbake::RunContext& context, organbake::WrittenMesh& read) {
  using enum organbake::MeshFormat;
  if (format == vtk_polydata) read = organbake::read_vtp(path);
  if (format == vtk_grid) read = organbake::read_vtu(path);
  if (format == legacy_vtk) read.mesh = organbake::read_legacy_vtk(path);
  if (format == gltf) read.mesh = organbake::read_gltf(path, context);
}
