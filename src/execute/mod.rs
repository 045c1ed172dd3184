//! The whole of a run: what a campaign still needs is computed on all cores, round after round, and kept in a store.
//!
//! [`run`] does that. It opens the store, plans what is missing, hands the jobs to worker threads, commits every
//! outcome, saves what is under way when it is told to stop, and starts another round of seeds where an interval is
//! still too wide. It prints nothing: a callback hears how it goes, and the report says how it ended.
//!
//! ```
//! use meniscus::{campaign::file::Campaign, execute, store};
//!
//! let campaign = Campaign::parse("example.toml", r#"
//!     name = "example"
//!     model = "SP"
//!     scene = "obstacles"
//!     w_ob = 0.2
//!     sigma_ob = 0.3
//!     density = 0.7
//!     box_size = 20.0
//!     runs_per_point = 2
//!     limits = { t_max = 20.0 }
//!     grid = { e_w = [1.0, 10.0] }
//! "#)?;
//! let folder = tempfile::tempdir()?;
//! let dir = folder.path().join("example.meniscus");
//! let report = execute::run(&campaign, &dir, &execute::Options::default(), |_| ())?;
//! assert_eq!(report, execute::RunReport::Complete { done: 4, failed: 0 });
//!
//! let mut answer = Vec::new();
//! store::query(&dir, "select count(*) from runs where state = 'done'", store::Format::Csv, &mut answer)?;
//! assert_eq!(answer, b"count(*)\n4\n");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! This layer knows every layer below it, but neither reports nor the command line. What is decided stands in pure
//! functions that take the time and the results as arguments (`schedule`, `rounds`); the other files act on it. Read
//! `run` first.
//!
//! | file | idea |
//! |---|---|
//! | `run` | round after round, until the campaign is complete or the run is told to stop |
//! | `rounds` | which seeds each point needs now; pure |
//! | `executor` | one round: starts the workers and watches signals, deadline and failures |
//! | `schedule` | where a round stands, when to stop, how long the rest takes; pure |
//! | `worker` | takes one job after another from the list |
//! | `attempt` | one attempt at a job: it arrives, fails, panics, or is told to stop |
//! | `keeping`, `saved` | checkpoints and dumps: when they are written, and what is in them |
//! | `replay` | runs a dump again |
//! | `signals` | Ctrl-C, SIGTERM and SIGHUP as a flag |
//! | `machine_speed` | how fast this machine steps droplets |

mod attempt;
mod executor;
mod keeping;
pub(crate) mod machine_speed;
mod options;
pub(crate) mod replay;
mod rounds;
mod run;
mod saved;
mod schedule;
mod signals;
mod worker;

pub use crate::store::Deadline;
pub use executor::RunError;
pub use options::{Options, Retry};
pub use run::{Event, RunReport, Stopped, plan, run};
pub use schedule::{Paused, Progress, StopReason};
pub use signals::set_by_signals;
