//! Decides which effects a job has, and puts its droplet at its start.

use crate::parameters::{Deformable, GravityForm, Integrator, Job, MASS, Model, PAPER_ALPHA, Point, Scene, Soft};
use crate::physics::motion::placing::{Placing, Site};
use crate::physics::motion::{
    Interruption, Motion, MotionState, guard::GuardedMotion, implicit::ImplicitMotion, verlet::VerletMotion,
};
use crate::physics::point::{SoftEffects, SoftMotion};
use crate::physics::ring::forces::self_contact::{SelfContact, apart::Apart};
use crate::physics::ring::forces::{
    contact::Contact, drag::Drag, gravity::Gravity, hydrostatic::Hydrostatic, near_wall_drag::NearWallDrag,
};
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simulate::Context;
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
            let discs = context.arrays.get(job, field)?;
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
        Ok(match self.from {
            None => {
                let position = self.placing().point(soft.e_w, &walls)?;
                boxed(SoftMotion::start(position, effects, dt, walls, instruction_set))
            }
            Some(MotionState::Soft(state)) => boxed(SoftMotion::resume(*state, effects, dt, walls, instruction_set)),
            Some(_) => None,
        })
    }

    fn ring(&self, ring: &Deformable) -> Result<Option<Box<dyn Motion>>, Interruption> {
        let (n, dt, instruction_set) = (ring.n_vertices, self.point.stepping.dt, self.context.instruction_set);
        let effects = self.effects(ring);
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
            _ => None,
        })
    }

    fn placing(&self) -> Placing<'_> {
        let Context { instruction_set, stop, .. } = self.context;
        Placing { site: self.site, stepping: &self.point.stepping, instruction_set, stop }
    }

    fn placed(&self, ring: &Deformable) -> Result<Ring, Interruption> {
        self.placing().ring(ring, self.weightless(ring))
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
