// Self-repulsions (paper sections 3 and 7, steps I.3 and V.4; Bridson et al. 2002): impulses between parts of
// deformable surfaces, of one body or of several, that are nearer than their thickness h.
#pragma once

#include "sim/deformable/materials/symmetric_block.h"
#include "sim/deformable/particle_mask.h"
#include "sim/deformable/particles.h"
#include "sim/deformable/self_contact/collision_candidates.h"
#include "sim/deformable/support_point.h"

namespace duet {

// The nearest points of two elements, as a constraint on particle velocities: n . sum w_i v_i is the speed at
// which they part.
struct RepulsionPair {
  std::array<int, 4> particle{};
  std::array<double, 4> weight{};
  Vec3 normal = Vec3::Zero();
  double distance = 0, thickness = 0;  // m
  double friction = 0;
  double mass = 0;      // kg, 1/(sum of w_i^2 / m_i)
  double row_mass = 0;  // kg, the same with the masses of the inner product that sweep() works in
  double target = 0;    // m/s, within a solve
  bool active = false;  // within a solve
};

Vec3 relative_velocity(const RepulsionPair& pair, const std::vector<Vec3>& v);
// Velocities change by w_i j / m_i, which keeps linear momentum; where the impulse is along the normal,
// angular momentum too.
void apply_impulse(const RepulsionPair& pair, const Vec3& impulse, const std::vector<double>& inverse_mass,
                   std::vector<Vec3>& v);

class SelfRepulsion {
 public:
  // Finds the pairs nearer than repulsion_range h at `x`, where the candidates have been updated from. Their
  // nearest points are support points of the surfaces around them, towards each other, where these are
  // boundaries of volumes, whose triangles `around` lists for each particle: the rim of a box that slides
  // over another one is near the surface ahead of it, too, but would only push it along.
  void find(const CollisionCandidates& candidates, const std::vector<Vec3>& x,
            const std::vector<double>& inverse_mass, const ElementLists& around,
            const std::vector<Triangle>& triangles);

  // Finds the pairs that are nearer than repulsion_range h at `x` or come so near within `dt` (s) as `v`
  // moves the particles, or those of one element while the other stays, as contact may hold it: with the
  // weights and the normal of that moment, and the distance along that normal at `x`.
  void find_meeting(const CollisionCandidates& candidates, const std::vector<Vec3>& x,
                    const std::vector<Vec3>& v, double dt, const ElementLists& around,
                    const std::vector<Triangle>& triangles);

  // Inelastic impulses and friction at positions `x`: pairs do not come nearer than h within `dt` (s). Linear
  // and angular momentum are kept.
  void apply(double dt, const std::vector<Vec3>& x, const std::vector<double>& inverse_mass,
             std::vector<Vec3>& v) const;
  // The elastic part: pairs nearer than h part by a tenth of what they lack in the step.
  void apply_elastic(double dt, const std::vector<double>& inverse_mass, std::vector<Vec3>& v) const;

  // The pairs as rows of the projection in the conjugate gradients (section 7.1): those about as near as h
  // that would come nearer within `dt` (s) if they went on from `start` by way of `velocity`, the mean of the
  // step. In the end of it they come nearer to h by a tenth of the way, which apply() keeps to.
  void choose_rows(double dt, const std::vector<Vec3>& start, const std::vector<Vec3>& velocity);
  // Drops the rows of pairs that `change` (of velocities) parts faster than by `tolerance` (m/s). Returns
  // whether there were any.
  bool release_rows(const std::vector<Vec3>& change, double tolerance);
  // Has sweep() work in the inner product of other masses than the particles' own, which null stands for.
  void use_inverse_masses(const std::vector<SymmetricBlock>* inverse_mass);
  // Only pairs of the chunks of `mask` take part in sweep() and use_inverse_masses(), until the next call;
  // null for all.
  void limit_to(const ParticleMask* mask) { mask_ = mask; }
  // One sweep over the rows to and fro, which is self-adjoint in the mass inner product. Without targets,
  // onto n.v_rel = 0.
  void sweep(bool with_target, const std::vector<double>& inverse_mass, std::vector<Vec3>& v) const;

  const std::vector<RepulsionPair>& pairs() const { return pairs_; }

 private:
  struct Chunk {
    std::vector<RepulsionPair> pairs;
  };
  std::vector<Chunk> chunks_;
  std::vector<RepulsionPair> pairs_;
  bool takes(const RepulsionPair& pair) const {
    return pair.active && (!mask_ || mask_->has(static_cast<std::size_t>(pair.particle[0])));
  }

  const ParticleMask* mask_ = nullptr;
  const std::vector<SymmetricBlock>* row_inverse_mass_ = nullptr;
};

}  // namespace duet
