//! The process that writes a store, as a refusal or a `status` names it.

use crate::parameters::plain;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A process that writes a store.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Holder {
    /// Its process id; `None` in the instant before the holder has written it.
    pub pid: Option<u32>,
    /// The machine it runs on.
    pub host: String,
}

impl Holder {
    /// This process.
    pub(super) fn this_process() -> Self {
        let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
        Self { pid: Some(std::process::id()), host }
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.pid {
            Some(pid) => write!(f, "process {pid} on {}", plain(&self.host)),
            None => write!(f, "another process that has just started"),
        }
    }
}
