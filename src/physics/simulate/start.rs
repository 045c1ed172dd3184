//! Decides which effects a job has, and puts its droplet at its start.

use crate::parameters::{
    Deformable, Dynamics, GravityForm, Integrator, Job, MASS, Model, PAPER_ALPHA, Point, STEP_ERROR, Scene, Soft,
    Stepping,
};
use crate::physics::liquid::{dissipation::Dissipation, near_wall::NearWall};
use crate::physics::liquid::{polygon::Polygon, potential::Potential, self_contact::SelfContact as FoldContact};
use crate::physics::motion::placing::{Placing, Site};
use crate::physics::motion::{
    Interruption, Motion, MotionState,
    darcy::DarcyMotion,
    guard::GuardedMotion,
    implicit::{self, AdaptiveMotion, ImplicitMotion},
    soft::adaptive::AdaptivePoint,
    verlet::VerletMotion,
};
use crate::physics::point::{SoftEffects, SoftMotion};
use crate::physics::ring::forces::self_contact::{SelfContact, apart::Apart};
use crate::physics::ring::forces::{
    contact::Contact, drag::Drag, gravity::Gravity, hydrostatic::Hydrostatic, near_wall_drag::NearWallDrag,
};
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simulate::Context;
use crate::physics::simulate::stability::StabilityLimit;
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use crate::physics::walls::{plate::Plate, wall::Walls, wedge::ChannelWalls};
use std::sync::Arc;

/// The droplet of a job: in the state `from`, or at its start and at rest, with gravity just switched on. `None` if the
/// state does not belong to this job.
///
/// # Errors
/// [`Interruption::Stopped`] before the droplet was at its start; a failure to make the array or to place the droplet.
pub(super) fn start(
    job: &Job,
    context: Context<'_>,
    from: Option<&MotionState>,
) -> Result<Option<Box<dyn Motion>>, Interruption> {
    let point = &*job.point;
    match &point.scene {
        Scene::Obstacles(field) => {
            let discs = context.arrays.get(job, field, context.stop)?.ok_or(Interruption::Stopped)?;
            let (at, clearance) = discs.widest_gap_near_centre();
            Start { point, walls: discs, site: Site::Gap { at, clearance }, context, from }.droplet()
        }
        Scene::Channel(channel) => {
            let walls = Arc::new(ChannelWalls::new(channel.w, channel.angle, channel.tip_radius));
            Start { point, walls, site: Site::Free { at: [channel.h_start, 0.0] }, context, from }.droplet()
        }
        Scene::Disc(disc) => {
            let walls = Arc::new(ObstacleArray::lone(0.5 * disc.sigma_ob));
            Start { point, walls, site: Site::Free { at: [disc.h_start, disc.offset] }, context, from }.droplet()
        }
        Scene::Plate => Start { point, walls: Arc::new(Plate), site: Site::OnPlate, context, from }.droplet(),
    }
}

/// The step with which a droplet is placed whose own steps follow their error, in t0.
const PLACING_STEP: f64 = 1.0 / 16.0;

/// The farthest that a vertex may move in a step that follows its error, in sigma.
const FARTHEST_MOVE: f64 = 0.05;

/// The total stiffness of the walls while a liquid droplet is placed.
const PLACING_STIFFNESS: f64 = 1e5;

struct Start<'a, W: Walls> {
    point: &'a Point,
    walls: Arc<W>,
    site: Site,
    context: Context<'a>,
    from: Option<&'a MotionState>,
}

impl<W: Walls> Start<'_, W> {
    fn droplet(&self) -> Result<Option<Box<dyn Motion>>, Interruption> {
        match &self.point.model {
            Model::Soft(soft) => self.soft(soft),
            Model::Deformable(ring) => self.ring(ring),
        }
    }

    fn soft(&self, soft: &Soft) -> Result<Option<Box<dyn Motion>>, Interruption> {
        let Point { v_t, b0, .. } = *self.point;
        let effects = SoftEffects { stiffness: soft.e_w, weight: MASS, far_rate: 1.0 / v_t, b0, alpha: self.alpha() };
        let (dt, walls, instruction_set) = (self.point.stepping.dt, self.walls.clone(), self.context.instruction_set);
        let follows_error = self.point.stepping.integrator == Integrator::Adaptive;
        Ok(match self.from {
            None => {
                // Where steps follow their error, the point is placed in steps of Verlet.
                let dt_of_placing = if follows_error { StabilityLimit::of(self.point).auto_dt() } else { dt };
                let stepping = Stepping { integrator: Integrator::Verlet, dt: dt_of_placing };
                let position = self.placing(&stepping).point(soft.e_w, &walls)?;
                if follows_error {
                    boxed(AdaptivePoint::start(position, effects, dt, walls, instruction_set))
                } else {
                    boxed(SoftMotion::start(position, effects, dt, walls, instruction_set))
                }
            }
            Some(MotionState::AdaptiveSoft(state)) if follows_error => {
                boxed(AdaptivePoint::resume(**state, effects, dt, walls, instruction_set))
            }
            Some(MotionState::Soft(state)) if !follows_error => {
                boxed(SoftMotion::resume(*state, effects, dt, walls, instruction_set))
            }
            Some(_) => None,
        })
    }

    fn ring(&self, ring: &Deformable) -> Result<Option<Box<dyn Motion>>, Interruption> {
        let (n, dt, instruction_set) = (ring.n_vertices, self.point.stepping.dt, self.context.instruction_set);
        let (effects, is_liquid) = (self.effects(ring), ring.dynamics == Dynamics::Darcy);
        Ok(match (self.point.stepping.integrator, self.from) {
            (Integrator::Verlet, None) => {
                let motion = VerletMotion::start(self.placed(ring)?, effects, dt, instruction_set);
                boxed(GuardedMotion::new(motion))
            }
            (Integrator::Verlet, Some(MotionState::Verlet(state))) => {
                GuardedMotion::resume(state, n, effects, dt, instruction_set).and_then(boxed)
            }
            (Integrator::Implicit, None) => {
                boxed(ImplicitMotion::start(self.placed(ring)?, effects, dt, instruction_set))
            }
            (Integrator::Implicit, Some(MotionState::Implicit(state))) => {
                ImplicitMotion::resume(state, n, effects, dt, instruction_set).and_then(boxed)
            }
            (Integrator::Adaptive, None) if !is_liquid => {
                let (placed, largest_move) = (self.placed(ring)?, self.largest_move());
                boxed(AdaptiveMotion::start(placed, effects, self.times(ring), largest_move, instruction_set))
            }
            (Integrator::Adaptive, Some(MotionState::Adaptive(state))) if !is_liquid => {
                let largest_move = self.largest_move();
                AdaptiveMotion::resume(state, n, effects, self.times(ring), largest_move, instruction_set)
                    .and_then(boxed)
            }
            (Integrator::Adaptive, None) => {
                let placed = self.placed(ring)?;
                let [x, y] = [&placed.x, &placed.y].map(|column| column[..n].to_vec());
                let liquid = self.liquid(ring);
                boxed(DarcyMotion::start(
                    Polygon { x, y },
                    placed.origin,
                    liquid,
                    self.dissipation(ring),
                    self.times(ring),
                    instruction_set,
                ))
            }
            (Integrator::Adaptive, Some(MotionState::Darcy(state))) if is_liquid => {
                let liquid = self.liquid(ring);
                DarcyMotion::resume(state, n, liquid, self.dissipation(ring), self.times(ring), instruction_set)
                    .and_then(boxed)
            }
            _ => None,
        })
    }

    /// The drag of a liquid droplet: `b_inf/a0 = M/(V_t a0)`, and the mass is a0.
    fn dissipation(&self, ring: &Deformable) -> Dissipation {
        let near_wall = match self.drag(ring) {
            Drag::Far { .. } => None,
            Drag::NearWall(drag) => Some(NearWall::new(drag, ring.n_vertices, 1.0 / self.point.v_t)),
        };
        Dissipation::new(ring.n_vertices, 1.0 / self.point.v_t, near_wall, self.context.instruction_set)
    }

    /// The nominal step and the error allowed in one step.
    fn times(&self, ring: &Deformable) -> [f64; 2] {
        [self.point.stepping.dt, ring.step_error.unwrap_or(STEP_ERROR)]
    }

    /// How far a vertex may move in a step that follows its error, in sigma: a third of the radius of obstacles or tips,
    /// so that it leaps over none.
    fn largest_move(&self) -> f64 {
        (self.walls.surface() / 3.0).clamp(implicit::LARGEST_MOVE, FARTHEST_MOVE)
    }

    /// The energy of a liquid droplet.
    fn liquid(&self, ring: &Deformable) -> Potential<W> {
        let folds = (ring.self_contact == crate::parameters::SelfContact::Auto)
            .then(|| FoldContact::new(ring.n_vertices, ring.delta, ring.k_w()));
        Potential {
            walls: self.walls.clone(),
            gamma: ring.gamma,
            k_a: ring.k_a,
            rest: MASS,
            weight: MASS,
            k_w: ring.k_w(),
            reach: self.walls.surface() + 0.5 * ring.delta,
            folds,
        }
    }

    fn placing<'b>(&'b self, stepping: &'b Stepping) -> Placing<'b> {
        let Context { instruction_set, stop, .. } = self.context;
        Placing { site: self.site, stepping, instruction_set, stop }
    }

    /// The ring at its start. A liquid droplet is placed as an even ring of springs, which has almost its shape. Where
    /// steps follow their error, the droplet is placed in fixed steps.
    fn placed(&self, ring: &Deformable) -> Result<Ring, Interruption> {
        let stepping = match self.point.stepping.integrator {
            Integrator::Adaptive => Stepping { integrator: Integrator::Implicit, dt: PLACING_STEP },
            Integrator::Verlet | Integrator::Implicit => self.point.stepping.clone(),
        };
        if ring.dynamics == Dynamics::Vertex {
            return self.placing(&stepping).ring(ring, self.weightless(ring));
        }
        let springs = Deformable { kappa: ring.linear_kappa(), e_w: PLACING_STIFFNESS, ..ring.clone() };
        self.placing(&stepping).ring(&springs, self.weightless(&springs))
    }

    /// All that acts on the ring of this job.
    fn effects(&self, ring: &Deformable) -> RingEffects {
        let mut effects = RingEffects { drag: self.drag(ring), ..self.weightless(ring) };
        match ring.gravity {
            GravityForm::Vertex => effects.gravity = Gravity::new(ring.n_vertices),
            GravityForm::Centroid => effects.others.push(Box::new(Hydrostatic)),
        }
        effects
    }

    /// Elasticity, walls, and self-contact.
    fn weightless(&self, ring: &Deformable) -> RingEffects {
        let (n, k_w, delta, instruction_set) = (ring.n_vertices, ring.k_w(), ring.delta, self.context.instruction_set);
        let contact = Contact::new(self.walls.clone(), ring.contact, n, k_w, delta, instruction_set);
        let mut effects = RingEffects::elastic(ring, Box::new(contact));
        if ring.self_contact == crate::parameters::SelfContact::Auto {
            let apart = Apart::of(ring);
            let folds = SelfContact::new(n, apart.total_stiffness(), delta, apart, instruction_set);
            effects.others.push(Box::new(folds));
        }
        effects
    }

    fn drag(&self, ring: &Deformable) -> Drag {
        let (n, v_t, b0, delta) = (ring.n_vertices, self.point.v_t, self.point.b0, ring.delta);
        if b0 == 0.0 {
            return Drag::Far { rate: 1.0 / v_t };
        }
        let (walls, instruction_set) = (self.walls.clone(), self.context.instruction_set);
        Drag::NearWall(NearWallDrag::new(walls, n, v_t, b0, self.alpha(), delta, instruction_set))
    }

    fn alpha(&self) -> f64 {
        self.point.alpha.unwrap_or(PAPER_ALPHA)
    }
}

fn boxed<M: Motion + 'static>(motion: M) -> Option<Box<dyn Motion>> {
    Some(Box::new(motion))
}
