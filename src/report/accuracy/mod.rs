//! What accuracy costs: a table for each ladder, the settings of each scene, and sentences that say what these show.

mod findings;
mod fronts;
mod ladders;
mod page;

pub(crate) use crate::report::accuracy::page::{Origin, page};

use crate::report::accuracy::findings::findings;
use crate::report::accuracy::fronts::{FRONT_NOTE, front};
use crate::report::accuracy::ladders::{LADDER_NOTE, ladder};
use crate::study::accuracy::Accuracy;

/// Everything for a terminal.
pub fn text(accuracy: &Accuracy) -> String {
    let ladders: Vec<String> = accuracy.ladders.iter().map(|one| ladder(one).text()).collect();
    let fronts: Vec<String> = accuracy.fronts.iter().map(|one| front(one).text()).collect();
    let findings = findings(accuracy).join("\n");
    format!("{}{LADDER_NOTE}\n{}{FRONT_NOTE}\n{findings}\n", ladders.join("\n"), fronts.join("\n"))
}
