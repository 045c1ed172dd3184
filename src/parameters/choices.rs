//! The choices that the physics leaves open, by the names that campaign files write. The first of each is the default.

use serde::{Deserialize, Serialize};

/// Declares a choice among named ways; the first is the default.
macro_rules! choice {
    ($(#[$doc:meta])* $kind:ident { $(#[$first_doc:meta])* $first:ident = $first_name:literal, $($(#[$way_doc:meta])* $way:ident = $name:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum $kind {
            $(#[$first_doc])*
            #[default]
            #[serde(rename = $first_name)]
            $first,
            $($(#[$way_doc])* #[serde(rename = $name)] $way),+
        }
        impl $kind {
            /// All names, as campaign files write them; the default first.
            pub const NAMES: &'static [&'static str] = &[$first_name, $($name),+];
            /// The name that campaign files write.
            pub const fn name(self) -> &'static str {
                match self { Self::$first => $first_name, $(Self::$way => $name),+ }
            }
            /// The way of that name.
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $first_name => Some(Self::$first), $($name => Some(Self::$way),)+ _ => None }
            }
        }
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
pub(super) use choice;

choice!(
    /// What the wall stiffness E_w means.
    WallStiffness {
        /// Shared by all edges: `k_w = E_w/N_v`.
        Total = "total",
        /// The literal [C24] eq. 3: `k_w = 4 E_w/delta^2` for each.
        PerVertex = "per_vertex",
    }
);
choice!(
    /// What of the ring touches walls.
    ContactKind {
        /// Its edges.
        Edge = "edge",
        /// Its vertices alone, the literal [C24] eq. 3.
        Vertex = "vertex",
    }
);
choice!(
    /// How gravity acts on the ring.
    GravityForm {
        /// `M/N_v` on each vertex.
        Vertex = "vertex",
        /// Minus the gradient of the area centroid: a hydrostatic pressure.
        Centroid = "centroid",
    }
);
choice!(
    /// Whether the ring repels itself.
    SelfContact {
        /// Where it folds back, and at no cost elsewhere.
        Auto = "auto",
        /// Not at all.
        Off = "off",
    }
);
choice!(
    /// What happens when an obstacle comes to lie inside the ring.
    Engulfed {
        /// The run fails.
        Fail = "fail",
        /// It goes on; the column `engulfed_t` of `stability` says when that happened.
        Record = "record",
    }
);
choice!(
    /// Which integrator a campaign asks for; a job has a definite one.
    IntegratorChoice {
        /// The cheaper of the two that is stable.
        Auto = "auto",
        /// Modified velocity-Verlet.
        Verlet = "verlet",
        /// The implicit one.
        Implicit = "implicit",
    }
);
