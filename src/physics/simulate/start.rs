//! Puts the droplet of a job in place and picks the concrete types of its effects, once.

use crate::parameters::{self, Deformable, GravityForm, Integrator, Job, MASS, Model, Point, Scene, regular_edge};
use crate::physics::motion::guard::GuardedMotion;
use crate::physics::motion::implicit::ImplicitMotion;
use crate::physics::motion::memory::WrongState;
use crate::physics::motion::placing::{self, Place, Pushes};
use crate::physics::motion::verlet::{RingEffects, RingMotion};
use crate::physics::point::{SoftEffects, SoftMotion};
use crate::physics::ring::Ring;
use crate::physics::ring::forces::area::Area;
use crate::physics::ring::forces::contact::{Contact, WallContact};
use crate::physics::ring::forces::far_drag::FarDrag;
use crate::physics::ring::forces::gravity::Gravity;
use crate::physics::ring::forces::hydrostatic::Hydrostatic;
use crate::physics::ring::forces::near_wall_drag::{NearWallDrag, PAPER_ALPHA};
use crate::physics::ring::forces::perimeter::Perimeter;
use crate::physics::ring::forces::self_contact::SelfContact;
use crate::physics::ring::forces::self_contact::apart::Apart;
use crate::physics::ring::forces::tension::{LinearTension, Tension};
use crate::physics::ring::forces::{Drag, EdgeForce, RingForce};
use crate::physics::simd::InstructionSet;
use crate::physics::simulate::{Context, Motion, MotionState};
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use crate::physics::walls::plate::Plate;
use crate::physics::walls::wall::Walls;
use crate::physics::walls::wedge::ChannelWalls;
use crate::results::trajectory::Failure;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Why there is no droplet in motion.
#[derive(Debug)]
pub(super) enum NotStarted {
    /// The job cannot be started.
    Failed(Failure),
    /// It was told to stop before the droplet was in place.
    Stopped,
    /// The state is not one of this job.
    WrongState(WrongState),
}

impl From<Failure> for NotStarted {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

impl From<WrongState> for NotStarted {
    fn from(wrong: WrongState) -> Self {
        Self::WrongState(wrong)
    }
}

/// The droplet of a job: as `from` has it, or in place and at rest, gravity just switched on.
///
/// # Errors
/// Those of the array, and of putting a droplet where there is no room.
pub(super) fn start(
    job: &Job,
    context: Context<'_>,
    from: Option<&MotionState>,
) -> Result<Box<dyn Motion>, NotStarted> {
    let Context { arrays, instruction_set, stop } = context;
    let (point, begin) = (&*job.point, Begin { from, stop, instruction_set });
    match &job.point.scene {
        Scene::Obstacles(field) => {
            let discs = arrays.get(job, field)?;
            let (at, clearance) = discs.widest_gap_near_centre();
            Start { point, walls: discs, place: Place::Gap { at, clearance }, begin }.droplet()
        }
        Scene::Channel(channel) => {
            let walls = Arc::new(ChannelWalls::new(channel.w, channel.angle, channel.tip_radius));
            Start { point, walls, place: Place::Free { at: [channel.h_start, 0.0] }, begin }.droplet()
        }
        Scene::Disc(disc) => {
            let walls = Arc::new(ObstacleArray::lone(0.5 * disc.sigma_ob));
            let place = Place::Free { at: [disc.h_start, disc.offset] };
            Start { point, walls, place, begin }.droplet()
        }
        Scene::Plate => Start { point, walls: Arc::new(Plate), place: Place::OnPlate, begin }.droplet(),
    }
}

/// Whether tension and perimeter add up to the linear spring, `kappa = 1/(N_v l0)`.
pub fn is_linear(ring: &Deformable) -> bool {
    (ring.kappa / ring.linear_kappa() - 1.0).abs() < 1e-9
}

/// How a droplet begins to move.
#[derive(Clone, Copy)]
struct Begin<'a> {
    /// From this state, or from rest.
    from: Option<&'a MotionState>,
    stop: &'a AtomicBool,
    instruction_set: InstructionSet,
}

/// A grid point and where it starts.
struct Start<'a, W: Walls> {
    point: &'a Point,
    walls: Arc<W>,
    place: Place,
    begin: Begin<'a>,
}

impl<W: Walls> Start<'_, W> {
    fn droplet(self) -> Result<Box<dyn Motion>, NotStarted> {
        match &self.point.model {
            Model::Soft(soft) => {
                let (dt, instruction_set) = (self.point.stepping.dt, self.begin.instruction_set);
                let effects = SoftEffects {
                    stiffness: soft.e_w,
                    weight: MASS,
                    far_rate: 1.0 / self.point.v_t,
                    b0: self.point.b0,
                    alpha: self.alpha(),
                };
                Ok(Box::new(match self.begin.from {
                    Some(MotionState::Soft(state)) => {
                        SoftMotion::resume(*state, effects, dt, self.walls, instruction_set)
                    }
                    Some(_) => return Err(WrongState.into()),
                    None => {
                        let position = placing::place_point(soft.e_w, &self.walls, self.place, dt, instruction_set)?;
                        SoftMotion::start(position, effects, dt, self.walls, instruction_set)
                    }
                }))
            }
            Model::Deformable(ring) => {
                let (n, rest) = (ring.n_vertices, regular_edge(ring.n_vertices));
                let tension = Tension { gamma: ring.gamma };
                if ring.kappa == 0.0 {
                    self.ring(ring, tension)
                } else if is_linear(ring) {
                    self.ring(ring, LinearTension { stiffness: ring.gamma / rest, rest })
                } else {
                    self.ring(ring, (tension, Perimeter { stiffness: ring.kappa * ring.gamma * n as f64, rest }))
                }
            }
        }
    }

    fn alpha(&self) -> f64 {
        self.point.alpha.unwrap_or(PAPER_ALPHA)
    }

    /// A ring with these forces along its edges; picks the drag.
    fn ring<E: EdgeForce>(&self, ring: &Deformable, edge: E) -> Result<Box<dyn Motion>, NotStarted> {
        let (n, v_t, b0) = (ring.n_vertices, self.point.v_t, self.point.b0);
        if b0 == 0.0 {
            return self.set_off(ring, edge, FarDrag { rate: 1.0 / v_t });
        }
        let (walls, alpha, instruction_set) = (self.walls.clone(), self.alpha(), self.begin.instruction_set);
        self.set_off(ring, edge, NearWallDrag::new(walls, n, v_t, b0, alpha, ring.delta, instruction_set))
    }

    /// A ring put in its place, among the walls alone.
    fn placed<E: EdgeForce>(&self, ring: &Deformable, edge: E) -> Result<Ring, NotStarted> {
        let pushes = Pushes { walls: self.contact(ring), others: self.repulsion(ring) };
        let (stepping, Begin { stop, instruction_set, .. }) = (&self.point.stepping, self.begin);
        let placed = placing::place_ring(ring, edge, self.place, pushes, stepping, instruction_set, stop)?;
        placed.ok_or(NotStarted::Stopped)
    }

    /// Switches gravity on, or goes on.
    fn set_off<E: EdgeForce, D: Drag>(
        &self,
        ring: &Deformable,
        edge: E,
        drag: D,
    ) -> Result<Box<dyn Motion>, NotStarted> {
        let smoothing = ring.eps * regular_edge(ring.n_vertices);
        let mut others = self.repulsion(ring);
        let gravity = match ring.gravity {
            GravityForm::Vertex => Gravity::new(ring.n_vertices),
            GravityForm::Centroid => {
                others.push(Box::new(Hydrostatic));
                Gravity::off()
            }
        };
        let effects = RingEffects {
            edge,
            area: Area { stiffness: ring.k_a, rest: MASS },
            gravity,
            drag,
            eps_squared: smoothing * smoothing,
            walls: self.contact(ring),
            others,
        };
        let (n, dt, instruction_set) = (ring.n_vertices, self.point.stepping.dt, self.begin.instruction_set);
        Ok(match (self.point.stepping.integrator, self.begin.from) {
            (Integrator::Verlet, None) => {
                let motion = RingMotion::start(self.placed(ring, edge)?, effects, dt, instruction_set);
                Box::new(GuardedMotion::new(motion))
            }
            (Integrator::Verlet, Some(MotionState::Verlet(state))) => {
                Box::new(GuardedMotion::resume(state, n, effects, dt, instruction_set)?)
            }
            (Integrator::Implicit, None) => {
                Box::new(ImplicitMotion::start(self.placed(ring, edge)?, effects, dt, instruction_set))
            }
            (Integrator::Implicit, Some(MotionState::Implicit(state))) => {
                Box::new(ImplicitMotion::resume(state, n, effects, dt, instruction_set)?)
            }
            _ => return Err(WrongState.into()),
        })
    }

    fn contact(&self, ring: &Deformable) -> Box<dyn WallContact> {
        let (n, k_w) = (ring.n_vertices, ring.k_w());
        Box::new(Contact::new(self.walls.clone(), ring.contact, n, k_w, ring.delta, self.begin.instruction_set))
    }

    fn repulsion(&self, ring: &Deformable) -> Vec<Box<dyn RingForce>> {
        match ring.self_contact {
            parameters::SelfContact::Off => Vec::new(),
            parameters::SelfContact::Auto => {
                let apart = Apart::of(ring);
                vec![Box::new(SelfContact::new(
                    ring.n_vertices,
                    apart.total_stiffness(),
                    ring.delta,
                    apart,
                    self.begin.instruction_set,
                ))]
            }
        }
    }
}
