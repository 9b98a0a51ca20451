// Hashes of the state in parts. They show in which body and which quantity two states differ; the hash of the
// whole state (FrameStats::hash) shows only that they do.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace duet {

struct World;

/// The owner of a quantity, which determines how many hashes the quantity has, and their order.
enum class Owner {
  rigid,       ///< one hash per rigid body
  deformable,  ///< one hash per deformable body
  body,        ///< one hash per body, rigid ones first
  scene,       ///< one hash for the scene
};

/// One quantity of the state, with a hash of its bytes for each owner.
struct QuantityHashes {
  std::string_view name;              ///< such as "velocity"
  Owner owner = Owner::scene;         ///< owner of the quantity
  std::vector<std::uint64_t> hashes;  ///< one per owner
};

/// Hashes everything that the next step reads, in a fixed order.
///
/// For rigid bodies these are position, orientation, velocity and angular momentum (for a body that is not
/// dynamic: angular velocity); for deformable bodies the positions and velocities of their particles; for the
/// scene the frequency bound, the accelerations at which solves begin, the pressures of incompressible bodies
/// if there are any, and the contact cache. `out` is overwritten and keeps its storage from call to call.
void hash_state(const World& world, std::vector<QuantityHashes>& out);

/// Hashes the quantities of hash_state(), and what a step works with.
///
/// The latter are the time and length of the step, and for each body the contacts in which it is the guest:
/// their geometry, impulses and targets. There are none before the step has found them (`has_contacts`):
/// those of the step before are still in the world unless the run was resumed. `out` is overwritten and keeps
/// its storage from call to call.
void hash_step(const World& world, bool has_contacts, std::vector<QuantityHashes>& out);

/// The hash of one quantity of one owner.
struct NamedHash {
  std::string_view name;   ///< name of the quantity
  std::uint64_t hash = 0;  ///< hash of its bytes
};

/// A body, or the scene, with its quantities.
struct BodyHashes {
  Owner owner = Owner::scene;         ///< rigid, deformable or scene
  std::string name;                   ///< name of the body in the scene file; empty for the scene
  std::vector<NamedHash> quantities;  ///< its quantities
};

/// Returns the hashes of hash_state() body by body: rigid bodies, deformable bodies, the scene.
std::vector<BodyHashes> state_hashes(const World& world);

}  // namespace duet
