// Finds the displacement by which a body as a whole leaves another body that it overlaps.
#pragma once

#include "sim/scene/build/overlap_probe.h"

namespace duet {

/// Factor on displacements by a depth, so that they end outside the surface in spite of rounding.
inline constexpr double beyond_surface = 1 + 1e-6;
/// Length of a displacement, over the depth of the overlap that it opens, beyond which a body that can deform
/// does so instead. Larger values lift bodies higher.
inline constexpr double far_exit = 5;

/// Returns the shortest displacement (m) found that takes body `b`, displaced by `shift` (m) against body
/// `a`, out of a; zero if none was found. `deepest` is their overlap at `shift`.
///
/// If a deformable body overlaps slightly, so that its deformation can open the overlap, only displacements
/// are considered that are not far longer than the overlap is deep. Longer ones would take the body off
/// another one that it encloses, like a rope that is bent around a bar. A body that crosses the middle of the
/// other one cannot get free by deformation, and moves as far as it has to.
Vec3 shortest_exit(OverlapProbe& probe, int a, int b, const Vec3& shift,
                   const OverlapProbe::Deepest& deepest);

}  // namespace duet
