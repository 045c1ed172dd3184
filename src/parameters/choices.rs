//! The choices that the physics leaves open, by the names that campaign files write. The first of each is the default.

use serde::{Deserialize, Serialize};

/// Gives the variants of an enum their names in files, tables and columns.
macro_rules! names {
    ($visibility:vis $kind:ident { $($variant:ident = $name:literal),+ $(,)? }) => {
        impl $kind {
            /// All names, in the order of the variants.
            $visibility const NAMES: &'static [&'static str] = &[$($name),+];
            /// Its name in files, tables and columns.
            $visibility const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }
            /// The variant of that name.
            $visibility fn from_name(name: &str) -> Option<Self> {
                match name { $($name => Some(Self::$variant),)+ _ => None }
            }
        }
    };
}
pub(crate) use names;

/// Declares a choice that campaign files make by name; the first variant is the default.
macro_rules! choice {
    ($(#[$doc:meta])* $kind:ident { $(#[$first_doc:meta])* $first:ident = $first_name:literal, $($(#[$other_doc:meta])* $other:ident = $name:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum $kind {
            $(#[$first_doc])*
            #[default]
            #[serde(rename = $first_name)]
            $first,
            $($(#[$other_doc])* #[serde(rename = $name)] $other),+
        }
        crate::parameters::names!(pub $kind { $first = $first_name, $($other = $name),+ });
        impl crate::parameters::parameter::Held for $kind {
            fn value(&self) -> crate::parameters::Value {
                crate::parameters::Value::Word(self.name())
            }
            fn of(value: crate::parameters::Value) -> Option<Self> {
                value.word().and_then(Self::from_name)
            }
        }
    };
}

choice!(
    /// What the wall stiffness E_w means.
    WallStiffness {
        /// The stiffness of all edges together: `k_w = E_w/N_v`.
        Total = "total",
        /// The literal [C24] eq. 3: `k_w = 4 E_w/delta^2` for each edge.
        PerVertex = "per_vertex",
    }
);
choice!(
    /// Which part of the ring touches walls.
    ContactKind {
        /// Its edges.
        Edge = "edge",
        /// Only its vertices, the literal [C24] eq. 3.
        Vertex = "vertex",
    }
);
choice!(
    /// How gravity acts on the ring.
    GravityForm {
        /// `M/N_v` on each vertex.
        Vertex = "vertex",
        /// Minus the gradient of the potential of the area centroid: a hydrostatic pressure.
        Centroid = "centroid",
    }
);
choice!(
    /// Whether the ring repels itself where it folds back.
    SelfContact {
        /// It does; a ring without folds costs nothing.
        Auto = "auto",
        /// It does not.
        Off = "off",
    }
);
choice!(
    /// What happens when an obstacle comes to lie inside the ring.
    Engulfed {
        /// The trajectory fails.
        Fail = "fail",
        /// The trajectory goes on; the column `engulfed_t` of `stability` says when that happened.
        Record = "record",
    }
);
choice!(
    /// The laws by which a deformable droplet moves.
    Dynamics {
        /// [C24] eqs 5 to 7: vertices with inertia, each with its own drag.
        Vertex = "vertex",
        /// A liquid without inertia that obeys Darcy's law inside.
        Darcy = "darcy",
    }
);
choice!(
    /// Which integrator a campaign asks for; a job has a definite one.
    IntegratorChoice {
        /// Implicit steps that follow their error where they are expected to cost less than Verlet's, else Verlet.
        Auto = "auto",
        /// Modified velocity-Verlet.
        Verlet = "verlet",
        /// Implicit steps of fixed length.
        Implicit = "implicit",
        /// Implicit steps that follow their error.
        Adaptive = "adaptive",
    }
);
choice!(
    /// The integrators.
    Integrator {
        /// Modified velocity-Verlet with implicit drag.
        Verlet = "verlet",
        /// Implicit backward differences of second order in steps of fixed length; only for the ring of springs.
        Implicit = "implicit",
        /// Implicit steps whose length follows their error; only for the deformable particle.
        Adaptive = "adaptive",
    }
);
