// Newton's method for the velocity solves that are not linear. One is the fully implicit form of step I.1
// (paper section 3, after Baraff, Witkin 1998), V = v + dt M^-1 F(x^n + dt V, V) with dt half of the step,
// which makes the motion follow the implicit midpoint rule if no contact interferes. The others are those
// with contact inside.
#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/base/parallel.h"
#include "sim/base/stop.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {
namespace {

constexpr std::size_t grain = 2048;  // particles per task of a parallel loop

// Forcing term: fraction of the residual that conjugate gradients leave to the next Newton iteration. It
// holds in the preconditioned norm and in the largest velocity; the preconditioned norm alone hardly sees a
// motion of a whole stiff body.
constexpr double forcing_share = 0.01;
// Fraction of the squared residual that is rounding: sums of many terms lose up to four of sixteen digits.
constexpr double rounding_share = 1e-24;
// A Newton correction is shortened if the residual along it turns against it by more than this fraction of
// its value at the start.
constexpr double slope_share = 0.5;
constexpr double min_cut = 0.1;  // least factor by which one cut shortens a correction
constexpr int max_cuts = 10;     // largest number of lengths that a line search tries
// Largest rise of the potential along a correction, as a fraction of it, beyond what damping can account for
// (the slope). A correction that leads over a barrier of the energy is shortened, too.
constexpr double potential_slack = 1e-3;

// Numerical viscosity c: viscosity over stiffness in units of the step. It damps deformation alone. A mode
// that is much faster than the step shrinks by (1/2 - c) / (1/2 + c) per step; by the midpoint rule alone it
// would ring forever, and grow in steps that turn a body far.
constexpr double numerical_damping = 0.25;

// Largest number of times that constraints are released. A constraint may push bodies apart but not pull them
// together; those that pull are deactivated, and the rest is solved for again.
constexpr int max_releases = 8;

// A search with contacts minimizes a convex potential. When it has converged, multipliers and bounds of
// friction are updated, at most `max_multiplier_updates` times; it may take `max_contact_iterations` more
// iterations than other searches.
constexpr int max_multiplier_updates = 8, max_contact_iterations = 80;

// With elasticity or its damping in implicit steps, a search need not converge for multipliers that change
// afterwards: they are updated as soon as this fraction of the residual is left, of that at the start and of
// that after an update.
constexpr double first_left = 0.1, next_left = 0.3;

// A search begins with this many careful iterations (ContactForces::set_careful). Later iterations are
// careful if the one before took less than `min_free_share` of its correction.
constexpr int first_careful = 3;
constexpr double min_free_share = 0.5;

// Factor on the tolerance of searches with contact and explicit elasticity. They are piecewise linear, and
// find two more digits with their last step. The digits are used, because the residual moves bodies into
// those that they lie on.
constexpr double contact_share = 0.01;

// Largest residual of contact, as a fraction of the velocity that gravity gives in the solve. In short steps
// it is less than the tolerance.
constexpr double weight_share = 0.1;
constexpr double rounding = 1e-14;  // relative rounding error of the residual of a solve

// Number of iterations of conjugate gradients after which the matrix of a search is factorized: of all
// corrections with diagonal blocks, and of one with the factor of an earlier correction. A factorization
// takes the time of 100 to 300 iterations. With half of the first value a stack of soft cubes takes 5 %
// longer, and a curtain that a ball hits 10 % less.
constexpr int slow_iterations = 500, stale_iterations = 10;

// A search ends, because rounding bounds it, if this many iterations in a row leave more than the fraction
// `max_left` of the residual.
constexpr int max_stalls = 40;
constexpr double max_left = 0.99;

// One search for a velocity: it minimizes the potential of a VelocityProblem at context.solve.solution.
class Search {
 public:
  Search(World& world, StepContext& context, const VelocityProblem& problem)
      : world_(world),
        context_(context),
        problem_(problem),
        system_(world.bodies, problem.dt,
                problem.is_elastic ? ImplicitForces::damping_and_elasticity : ImplicitForces::damping,
                problem.projection, context.solve.damping_force, context.solve.inertia) {
    system_.limit_to(problem.islands);
    context.solve.factor.forget();
    tolerance_ = world.settings.cg_tolerance;
    if (problem.contacts && !world.settings.implicit_elasticity) tolerance_ *= contact_share;
    if (problem.contacts) bound_tolerance();
  }
  ~Search() { system_.limit_to(nullptr); }
  Search(const Search&) = delete;
  Search& operator=(const Search&) = delete;

  // Runs Newton's method under the active constraints. Returns whether it has converged, with contacts at
  // least once for some multipliers.
  bool converge() {
    const StepSettings& settings = world_.settings;
    if (problem_.contacts) {
      problem_.contacts->set_careful(true);
      problem_.contacts->begin_bounds();
    }
    evaluate();
    int settlings = 0, stalls = 0;
    double before = std::numeric_limits<double>::infinity();
    double enough = enough_of(first_left);
    bool multipliers_final = false;  // true if the multipliers are the impulses
    const int most = settings.newton_iterations + (problem_.contacts ? max_contact_iterations : 0);
    for (int iteration = 0;; ++iteration) {
      stop_if_asked();
      const double newton_residual = system_.norm(context_.solve.newton_residual);
      const bool may_update = problem_.contacts && !multipliers_final && settlings < max_multiplier_updates;
      if (newton_residual <= tolerance_ && !may_update) return true;
      if (newton_residual <= enough && may_update) {
        ++settlings;
        problem_.contacts->update_multipliers();
        if (problem_.joints) problem_.joints->update_multipliers();
        problem_.contacts->set_bounds();
        problem_.contacts->set_careful(true);
        evaluate();
        enough = enough_of(next_left);
        multipliers_final = true;
        continue;
      }
      multipliers_final = false;
      stalls = newton_residual > max_left * before ? stalls + 1 : 0;
      before = newton_residual;
      if (iteration >= most || stalls >= max_stalls || !std::isfinite(newton_residual)) return settlings > 0;
      world_.clock.time(Stage::damping_solve, [&] { find_correction(); });
      const double share = search_line();
      if (problem_.contacts)
        problem_.contacts->set_careful(iteration + 1 < first_careful || share < min_free_share);
      ++world_.counters.newton_iterations;
    }
  }

  // Returns the potential that the search minimizes, at context.solve.solution and with damping, J.
  double value() {
    evaluate();
    const GeneralizedVelocity& V = context_.solve.solution;
    GeneralizedVelocity& change = context_.solve.correction;
    VelocitySystem::subtract(V, context_.solve.right_side, change);
    double sum = contact_potential_;
    if (problem_.is_elastic) {
      for (Vec3& v : change.particle) v -= problem_.dt * world_.gravity;
      sum += world_.bodies.forces.energy(world_.bodies.particles.x);
    }
    restrict(change);
    sum += 0.5 * system_.inner(change, change);
    for (std::size_t p = 0; p < V.particle.size(); ++p) {
      const Vec3 damping = problem_.is_elastic
                               ? Vec3(context_.solve.damping_force[p] - context_.solve.force[p])
                               : context_.solve.damping_force[p];
      sum -= 0.5 * problem_.dt * V.particle[p].dot(damping);
    }
    return sum;
  }

 private:
  // Returns the residual at which multipliers are updated, if `left` of the residual now is to be left.
  double enough_of(double left) const {
    if (!world_.settings.implicit_elasticity) return tolerance_;
    return std::max(tolerance_, left * system_.norm(context_.solve.newton_residual));
  }

  // Bounds the tolerance for contact: below a fraction of the weight of a particle, also in short steps, and
  // above rounding, which is that of the velocities times what damping and stiffness make of them.
  void bound_tolerance() {
    const double weight = weight_share * problem_.dt * world_.gravity.norm();
    if (weight > 0) tolerance_ = std::min(tolerance_, weight);
    const Particles& particles = world_.bodies.particles;
    const std::vector<SymmetricBlock>& own = context_.solve.blocks.own();
    double noise = 0;
    for (std::size_t p = 0; p < particles.size(); ++p)
      if (!is_held(particles, p))
        noise = std::max(noise, particles.inverse_mass[p] / own[p].diagonal.minCoeff() *
                                    context_.solve.solution.particle[p].norm());
    tolerance_ = std::max(tolerance_, rounding * noise);
  }

  // Sets context.solve.unconstrained to the residual b + dt M^-1 F - V (m/s), with the impulses of contacts,
  // and context.solve.newton_residual to P times it. With elasticity all forces are those at x^n + dt V; the
  // particles and the elements' state of deformation are left there, and context.solve.force holds the
  // elastic forces and gravity.
  void evaluate() {
    Bodies& bodies = world_.bodies;
    Particles& particles = bodies.particles;
    const GeneralizedVelocity &V = context_.solve.solution, &b = context_.solve.right_side;
    GeneralizedVelocity& newton_residual = context_.solve.newton_residual;
    context_.solve.damping_force.assign(particles.size(), Vec3::Zero());
    if (problem_.is_elastic) {
      context_.solve.force.resize(particles.size());
      parallel_for(particles.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
          particles.x[p] = context_.states.x_n[p] + problem_.dt * V.particle[p];
          context_.solve.force[p] = particles.mass[p] * world_.gravity;
        }
      });
      world_.clock.time(Stage::elastic_forces,
                        [&] { bodies.forces.add_elastic_forces(particles.x, context_.solve.force); });
    }
    bodies.forces.add_damping_forces(V.particle, context_.solve.damping_force);
    if (problem_.is_elastic)
      parallel_for(particles.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) context_.solve.damping_force[p] += context_.solve.force[p];
      });
    newton_residual = V;  // gives it the size of V
    parallel_for(particles.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p)
        newton_residual.particle[p] =
            b.particle[p] - V.particle[p] +
            problem_.dt * particles.inverse_mass[p] * context_.solve.damping_force[p];
    });
    for (std::size_t i = 0; i < V.linear.size(); ++i) {
      newton_residual.linear[i] = b.linear[i] - V.linear[i];
      newton_residual.angular[i] = b.angular[i] - V.angular[i];
    }
    add_force_twists(bodies.rigid, bodies.bound, context_.solve.damping_force, problem_.dt,
                     newton_residual.linear, newton_residual.angular);
    if (problem_.contacts) {
      contact_potential_ = problem_.contacts->evaluate(V);
      problem_.contacts->add_velocities(1, newton_residual);
    }
    if (problem_.joints) {
      contact_potential_ += problem_.joints->evaluate(V);
      problem_.joints->add_velocities(1, newton_residual);
    }
    follow_twists(bodies.bound, newton_residual.linear, newton_residual.angular, newton_residual.particle);
    restrict(newton_residual);
    context_.solve.unconstrained = newton_residual;
    system_.project(newton_residual);
  }

  // Sets the velocities of bodies outside the searched islands to zero.
  void restrict(GeneralizedVelocity& v) const {
    if (!problem_.islands) return;
    std::size_t next = 0;
    const auto clear_to = [&](std::size_t end) {
      for (; next < end; ++next) v.particle[next].setZero();
    };
    for (const Islands::Range& range : problem_.islands->ranges()) {
      clear_to(range.begin);
      next = range.end;
    }
    clear_to(v.particle.size());
    for (std::size_t i = 0; i < v.linear.size(); ++i)
      if (!problem_.islands->is_searched_rigid(i)) v.linear[i] = v.angular[i] = Vec3::Zero();
  }

  // Returns the potential that bounds line searches, J; zero without elasticity.
  double potential() const {
    if (!problem_.is_elastic) return 0;
    return incremental_potential(world_, context_, problem_.dt) + contact_potential_;
  }

  // Factorizes the matrix of the system for precondition(), unless that takes too long. Returns whether it
  // has.
  bool factorize() {
    const ImplicitForces forces =
        problem_.is_elastic ? ImplicitForces::damping_and_elasticity : ImplicitForces::damping;
    is_factorized_ =
        context_.solve.factor.factorize(world_.bodies, problem_.dt, forces, context_.solve.inertia,
                                        problem_.islands, problem_.contacts, problem_.joints);
    return is_factorized_;
  }

  // Sets context.solve.preconditioned z = P B^-1 P^T r for the residual r, where B is the matrix of the
  // system or its diagonal blocks. Returns <r, z>. P is self-adjoint in the mass inner product, so that the
  // preconditioner is symmetric even if P has not converged to a projection.
  double precondition() {
    Bodies& bodies = world_.bodies;
    const GeneralizedVelocity& r = context_.solve.residual;
    GeneralizedVelocity& z = context_.solve.preconditioned;
    if (is_factorized_)
      context_.solve.factor.apply(bodies, context_.solve.inertia, r, z);
    else
      context_.solve.blocks.apply(bodies, context_.solve.inertia, r, z);
    restrict(z);
    follow_twists(bodies.bound, z.linear, z.angular, z.particle);
    system_.project(z);
    return system_.inner(r, z);
  }

  // Finds Newton's correction by preconditioned conjugate gradients. If they are slow, they begin anew with
  // the factorized matrix, with which those of later corrections of the search start.
  void find_correction() {
    Bodies& bodies = world_.bodies;
    if (problem_.is_elastic) {
      bodies.forces.linearize();
      find_blocks(world_, context_, problem_.dt, ImplicitForces::damping_and_elasticity);
    }
    context_.solve.blocks.add(bodies, context_.solve.inertia, problem_.contacts, problem_.joints);
    begin_correction();
    const int patience = is_factorized_ ? stale_iterations : std::max(slow_iterations - iterations_, 0);
    int iterations = 0;
    for (; iterations < world_.settings.cg_iterations; ++iterations) {
      stop_if_asked();
      if (is_corrected()) break;
      if (iterations == patience && may_factorize_) {
        const bool was_factorized = is_factorized_;
        may_factorize_ = factorize();
        if (may_factorize_ || was_factorized) begin_correction();
      }
      if (!advance_correction()) break;
    }
    iterations_ += iterations;
    world_.counters.cg_iterations += iterations;
  }

  // Begins conjugate gradients with no correction.
  void begin_correction() {
    GeneralizedVelocity& x = context_.solve.correction;
    context_.solve.residual = context_.solve.newton_residual;
    left_ = precondition();
    enough_ = forcing_share * forcing_share * left_;
    least_ = rounding_share * left_;
    norm_ = forcing_share * system_.norm(context_.solve.residual);
    x = context_.solve.preconditioned;
    VelocitySystem::axpy(-1, context_.solve.preconditioned, x);
    context_.solve.direction = context_.solve.preconditioned;
  }

  // Returns whether the correction is good enough, or only rounding is left.
  bool is_corrected() const {
    return !(left_ > least_) || (left_ <= enough_ && system_.norm(context_.solve.residual) <= norm_);
  }

  // Does an iteration of conjugate gradients. Returns false if only rounding is left.
  bool advance_correction() {
    GeneralizedVelocity &x = context_.solve.correction, &r = context_.solve.residual,
                        &s = context_.solve.direction, &q = context_.solve.image;
    system_.apply(s, q);
    if (problem_.contacts) problem_.contacts->add_differentials(s, q);
    if (problem_.joints) problem_.joints->add_differentials(s, q);
    restrict(q);
    system_.project(q);
    const double curvature = system_.inner(s, q);
    if (!(curvature > 0)) return false;
    VelocitySystem::axpy(left_ / curvature, s, x);
    VelocitySystem::axpy(-left_ / curvature, q, r);
    const double next = precondition();
    VelocitySystem::xpay(context_.solve.preconditioned, next / left_, s);
    left_ = next;
    return true;
  }

  // Line search: moves V along the correction by its whole length, or to where the residual along it vanishes
  // by the secant rule. That point has the least energy on the line, because the residual is the negative
  // gradient of the energy that backward Euler minimizes. Returns the fraction of the correction that was
  // taken.
  double search_line() {
    const double slope = system_.inner(context_.solve.correction, context_.solve.newton_residual),
                 start = potential();
    const double bound = start + slope + potential_slack * std::abs(start);
    double at = 0, next = 1;
    for (int cut = 0; cut < max_cuts; ++cut) {
      VelocitySystem::axpy(next - at, context_.solve.correction, context_.solve.solution);
      at = next;
      evaluate();
      const double now = system_.inner(context_.solve.correction, context_.solve.newton_residual);
      if (now >= -slope_share * slope && potential() <= bound) break;
      const double secant = now < 0 ? slope / (slope - now) : 0;
      next = at * (secant > min_cut ? secant : min_cut);  // also if the secant is NaN
    }
    return at;
  }

  World& world_;
  StepContext& context_;
  const VelocityProblem& problem_;
  VelocitySystem system_;
  double tolerance_ = 0;          // m/s
  double contact_potential_ = 0;  // J, of contacts and of the drive of joints
  bool is_factorized_ = false;    // true if context.solve.factor is the preconditioner
  bool may_factorize_ = true;     // false if the matrix could not be factorized
  int iterations_ = 0;            // of conjugate gradients, in all corrections so far
  // Of the conjugate gradients: <r, z>, its values at which they end and at which only rounding is left
  // (kg m^2/s^2), and the norm of r at which they end (m/s).
  double left_ = 0, enough_ = 0, least_ = 0, norm_ = 0;
};

}  // namespace

double incremental_potential(World& world, const StepContext& context, double dt) {
  Particles& particles = world.bodies.particles;
  const double motion = parallel_sum(particles.size(), grain, [&](std::size_t p, double& sum) {
    const Vec3& V = context.solve.solution.particle[p];
    const Vec3 change = V - context.solve.right_side.particle[p] - dt * world.gravity;
    sum += 0.5 * particles.mass[p] * change.squaredNorm();
    particles.x[p] = context.states.x_n[p] + dt * V;
  });
  double of_bodies = 0;
  const RigidBodies& rigid = world.bodies.rigid;
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (!rigid.properties[i].is_dynamic()) continue;
    const Vec3 change = context.solve.solution.linear[i] - context.solve.right_side.linear[i];
    const Vec3 turn = rigid.state[i].pose.orientation.conjugate() *
                      (context.solve.solution.angular[i] - context.solve.right_side.angular[i]);
    of_bodies += 0.5 * (rigid.properties[i].mass * change.squaredNorm() +
                        turn.dot(rigid.properties[i].inertia.cwiseProduct(turn)));
  }
  return motion + of_bodies + world.bodies.forces.energy(particles.x);
}

// An elastic force acts on the block of a solve like a damping of `dt` seconds times the stiffness.
void find_blocks(World& world, StepContext& context, double dt, ImplicitForces treated) {
  InternalForces& forces = world.bodies.forces;
  const double added = world.settings.implicit_elasticity ? numerical_damping * context.dt : 0;
  forces.set_added_damping(treated == ImplicitForces::damping_and_elasticity ? added + dt : added);
  context.solve.blocks.find(world.bodies, dt);
  forces.set_added_damping(added);
}

double solve_potential(World& world, StepContext& context, const VelocityProblem& problem) {
  return Search(world, context, problem).value();
}

bool find_velocity(World& world, StepContext& context, const VelocityProblem& problem) {
  ContactProjection* projection = problem.projection;
  if (problem.is_elastic) world.bodies.forces.set_added_damping(numerical_damping * 2 * problem.dt);
  Search search(world, context, problem);
  bool converged = search.converge();
  for (int release = 0; projection && release < max_releases; ++release) {
    if (!projection->release(context.solve.unconstrained, world.settings.cg_tolerance)) break;
    converged = search.converge();
  }
  return converged;
}

}  // namespace duet
